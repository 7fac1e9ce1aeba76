"""Isotropic densities of facet slopes.

The slope s of a facet is the tangent of the angle between its normal and that of the surface. A density P(s)
is per unit area of the slope plane (s_x, s_y), for facets weighted by their projected area in the mean plane;
its integral over the slope plane is 1.
"""

import abc
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.quadrature import gauss_legendre_unit

# Added to every width, so that a flat surface is not a special case.
_LEAST_SCALE = 1e-7
# Nodes in v = arsinh(s / scale) that integrate all densities below to 1e-9.
_NORM_NODES = 48
_CUT_SLOPE = float(np.tan(np.deg2rad(80.0)))


class SlopeDensity(eqx.Module):
    """Isotropic density of facet slopes.

    Attributes
    ----------
    strength
        Field with respect to which the BSDF has a finite, nonzero derivative at the flat surface, or None.
    """

    strength: ClassVar[str | None]

    @abc.abstractmethod
    def _scale(self):
        """See `scale`."""

    @abc.abstractmethod
    def _largest_slope(self):
        """See `largest_slope`."""

    @abc.abstractmethod
    def _shape(self, slope):
        """Density times slope, up to a constant factor."""

    @property
    def scale(self) -> Float[Array, ""]:
        """Slope at which the density begins to decrease."""
        return self._scale()

    @property
    def largest_slope(self) -> Float[Array, ""]:
        """Slope beyond which the density is zero or negligible."""
        return self._largest_slope()

    @property
    def _norm(self):
        """Integral of the shape over all slopes and azimuths."""
        unit, weight = gauss_legendre_unit(_NORM_NODES)
        reach = jnp.arcsinh(self.largest_slope / self.scale)
        slope = self.scale * jnp.sinh(unit * reach)
        step = weight * reach * jnp.sqrt(self.scale**2 + slope**2)
        return 2 * jnp.pi * jnp.sum(step * self._shape(slope))

    def radial(self, slope: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """P(s) s at slopes of 0 or more: 2 pi times its integral is 1; it is 0 beyond the largest slope."""
        return jnp.where(slope <= self.largest_slope, self._shape(slope), 0.0) / self._norm

    def density(self, slope: Float[ArrayLike, "*shape"]) -> Float[Array, "*shape"]:
        """P(s) at slopes above 0."""
        return self.radial(slope) / slope


class Beckmann(SlopeDensity):
    """Gaussian slopes: exp(-s^2 / 2 v) / (2 pi v).

    Parameters
    ----------
    slope_variance
        Variance v of the slope along each axis; tan(sigma)^2.

    References
    ----------
    Beckmann, Spizzichino 1963 The Scattering of Electromagnetic Waves from Rough Surfaces.
    """

    slope_variance: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    strength: ClassVar[str | None] = "slope_variance"

    def _scale(self):
        return jnp.sqrt(self.slope_variance + _LEAST_SCALE**2)

    def _largest_slope(self):
        return 6.5 * self.scale

    def _shape(self, slope):
        return slope * jnp.exp(-((slope / self.scale) ** 2) / 2)


class _ByScale(SlopeDensity):
    """Densities whose width is a slope."""

    slope_scale: Float[Array, ""] = eqx.field(converter=jnp.asarray)

    def _scale(self):
        return self.slope_scale + _LEAST_SCALE


class Ggx(_ByScale):
    """t^2 / (pi (t^2 + s^2)^2).

    Its slope variance is infinite: near the flat surface, smooth light changes as t^2 log t, so no field has
    a finite derivative there.

    Parameters
    ----------
    slope_scale
        t = tan(sigma).

    References
    ----------
    Walter, Marschner, Li, Torrance 2007 EGSR, eq. 33.
    """

    strength: ClassVar[str | None] = None

    def _largest_slope(self):
        return jnp.asarray(100.0)

    def _shape(self, slope):
        return slope / (1 + (slope / self.scale) ** 2) ** 2


class Cauchy(_ByScale):
    """Cauchy density of the facet normal per solid angle: D ~ 1 / (1 + (tan theta_n / t)^2).

    That is P ~ 1 / ((1 + s^2)^2 (1 + s^2 / t^2)). The tail is so heavy that the fraction of steep facets
    varies as 1 / log(1/t): no field has a finite derivative at the flat surface.

    Parameters
    ----------
    slope_scale
        t = tan(sigma).

    References
    ----------
    Sokolov, Potemin, Zhdanov, Barladian 2021 CEUR-WS 3027, 13 (for the angle sigma; the density is not stated
    there, this is the interpretation per solid angle).
    """

    strength: ClassVar[str | None] = None

    def _largest_slope(self):
        return jnp.asarray(30.0)

    def _shape(self, slope):
        return slope / ((1 + slope**2) ** 2 * (1 + (slope / self.scale) ** 2))


class CauchyAngle(_ByScale):
    """Cauchy density of the facet angle, p(theta_n) ~ 1 / (1 + (tan theta_n / t)^2), azimuth uniform.

    Parameters
    ----------
    slope_scale
        t = tan(sigma).
    """

    strength: ClassVar[str | None] = "slope_scale"

    def _largest_slope(self):
        return jnp.asarray(100.0)

    def _shape(self, slope):
        return 1 / ((1 + slope**2) * (1 + (slope / self.scale) ** 2))


class CauchyPlane(_ByScale):
    """Two-dimensional Cauchy density of the slope, P ~ (s^2 + t^2)^-1.5, up to facets of 80 degrees.

    Parameters
    ----------
    slope_scale
        t = tan(sigma).
    """

    strength: ClassVar[str | None] = "slope_scale"

    def _largest_slope(self):
        return jnp.asarray(_CUT_SLOPE)

    def _shape(self, slope):
        return slope / (1 + (slope / self.scale) ** 2) ** 1.5


class SlopeMixture(SlopeDensity):
    """(1 - w) times the first density plus w, the ``second_weight``, times the second."""

    first: SlopeDensity
    second: SlopeDensity
    second_weight: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    strength: ClassVar[str | None] = "second_weight"

    def _scale(self):
        return jnp.minimum(self.first.scale, self.second.scale)

    def _largest_slope(self):
        return jnp.maximum(self.first.largest_slope, self.second.largest_slope)

    def _shape(self, slope):
        first, second = self.first.radial(slope), self.second.radial(slope)
        return (1 - self.second_weight) * first + self.second_weight * second


_BY_NAME = {"ggx": Ggx, "cauchy": Cauchy, "cauchy_angle": CauchyAngle, "cauchy2d": CauchyPlane}
DENSITIES = ("beckmann", *_BY_NAME)


def slope_density(name: str, sigma_deg) -> SlopeDensity:
    """Density by its name in sample files, one of `DENSITIES`; differentiable in the angle, 0 if flat."""
    tangent = jnp.tan(jnp.deg2rad(sigma_deg))
    return Beckmann(tangent**2) if name == "beckmann" else _BY_NAME[name](tangent)
