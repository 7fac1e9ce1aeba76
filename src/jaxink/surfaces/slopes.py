"""Isotropic densities of facet slopes.

A facet's slope s is the tangent of the angle between its normal and the surface's. A density P(s) is per unit
area of the slope plane (s_x, s_y), for facets weighted by the area of the mean plane that they cover; its
integral over the plane is 1.
"""

import abc
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.quadrature import gauss_legendre_unit

# Added to every width: a flat surface is then the ordinary limit of all formulas.
_LEAST_SCALE = 1e-7
# Nodes in the variable v = arsinh(s / scale) that integrate every density below to 1e-9.
_NORM_NODES = 48
_CUT_SLOPE = float(np.tan(np.deg2rad(80.0)))


class SlopeDensity(eqx.Module):
    """Isotropic density of facet slopes.

    Attributes
    ----------
    strength
        Field in which the BSDF has a finite derivative, not zero, where the surface becomes flat; None if the
        density has no such field.
    """

    strength: ClassVar[str | None]

    @abc.abstractmethod
    def _scale(self):
        """Slope at which the density begins to fall."""

    @abc.abstractmethod
    def _largest_slope(self):
        """Slope beyond which there is nothing worth counting."""

    @abc.abstractmethod
    def _shape(self, slope):
        """Density times slope, up to a constant factor."""

    @property
    def scale(self) -> Float[Array, ""]:
        """Slope at which the density begins to fall."""
        return self._scale()

    @property
    def largest_slope(self) -> Float[Array, ""]:
        """Slope beyond which there is nothing worth counting, or nothing at all."""
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
        """P(s) s, of which 2 pi times the integral over s is 1; 0 beyond the largest slope.

        Parameters
        ----------
        slope
            Slopes, 0 or more.
        """
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

    Its slope variance is infinite: towards a flat surface smooth light changes as t^2 log t, so that no
    field has a finite derivative there.

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

    That is P ~ 1 / ((1 + s^2)^2 (1 + s^2 / t^2)), with a tail so heavy that the share of steep facets goes
    as 1 / log(1/t): none of its fields has a finite derivative at the flat surface.

    Parameters
    ----------
    slope_scale
        t = tan(sigma).

    References
    ----------
    Sokolov, Potemin, Zhdanov, Barladian 2021 CEUR-WS 3027, 13 (its angle sigma; the density is not written
    there, this is the reading per solid angle).
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
    """(1 - w) of one density and w of another.

    Parameters
    ----------
    first, second
        The densities.
    second_weight
        w.
    """

    first: SlopeDensity
    second: SlopeDensity
    second_weight: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    strength: ClassVar[str | None] = "second_weight"

    def _scale(self):
        return jnp.minimum(self.first.scale, self.second.scale)

    def _largest_slope(self):
        return jnp.maximum(self.first.largest_slope, self.second.largest_slope)

    def _shape(self, slope):
        return self._mixed(slope)

    def _mixed(self, slope):
        first, second = self.first.radial(slope), self.second.radial(slope)
        return (1 - self.second_weight) * first + self.second_weight * second


_BY_NAME = {"ggx": Ggx, "cauchy": Cauchy, "cauchy_angle": CauchyAngle, "cauchy2d": CauchyPlane}
DENSITIES = ("beckmann", *_BY_NAME)


def slope_density(name: str, sigma_deg) -> SlopeDensity:
    """Density by the name that sample files use.

    Parameters
    ----------
    name
        One of `DENSITIES`.
    sigma_deg
        Its angle, 0 for a flat surface; differentiable.
    """
    tangent = jnp.tan(jnp.deg2rad(sigma_deg))
    return Beckmann(tangent**2) if name == "beckmann" else _BY_NAME[name](tangent)
