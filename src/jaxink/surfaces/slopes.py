"""Isotropic densities of facet slopes.

The slope s of a facet is the tangent of the angle between its normal and that of the surface. A density P(s)
is per unit area of the slope plane (s_x, s_y), for facets weighted by their projected area in the mean plane;
its integral over the slope plane is 1.
"""

import abc
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.numerics.validity import as_float

# Added to every width, so that a flat surface is not a special case.
_LEAST_SCALE = 1e-7
# Nodes in v = arsinh(s / scale) that integrate all densities below to 1e-9.
_NORM_NODES = 48


class SlopeDensity(eqx.Module):
    """Isotropic density of facet slopes."""

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


class SlopeLaw(NamedTuple):
    """Exponents of a density, s^p exp(-g x^2) / ((1 + s^2)^a (1 + x^2)^b) times constants, where x = s / t.

    They are numbers, not types: programs serve every law.

    Parameters
    ----------
    power
        p, 0 or 1, of the density times the slope.
    gaussian, facet, tail
        g, a and b.
    end_in_scales, end
        The largest slope is the first times the scale t plus the second.
    """

    power: Float[ArrayLike, ""]
    gaussian: Float[ArrayLike, ""] = 0.0
    facet: Float[ArrayLike, ""] = 0.0
    tail: Float[ArrayLike, ""] = 0.0
    end_in_scales: Float[ArrayLike, ""] = 0.0
    end: Float[ArrayLike, ""] = 0.0


class AnalyticSlopes(SlopeDensity):
    """Density given by a law and one width.

    Parameters
    ----------
    slope_variance
        t^2, where t = tan(sigma); of Gaussian slopes the variance along each axis. Where the slopes have a
        variance, the BSDF has a finite, nonzero derivative with respect to it at the flat surface.
    law
        One of `LAWS`, or numbers like them.
    """

    slope_variance: Float[Array, ""] = eqx.field(converter=as_float)
    law: SlopeLaw

    def _scale(self):
        return jnp.sqrt(self.slope_variance + _LEAST_SCALE**2)

    def _largest_slope(self):
        return self.law.end_in_scales * self.scale + self.law.end

    def _shape(self, slope):
        law, square = self.law, (slope / self.scale) ** 2
        falls = law.gaussian * square + law.facet * jnp.log1p(slope**2) + law.tail * jnp.log1p(square)
        return jnp.where(law.power > 0, slope, 1.0) * jnp.exp(-falls)


class SlopeMixture(SlopeDensity):
    """(1 - w) times the first density plus w, the ``second_weight``, times the second."""

    first: SlopeDensity
    second: SlopeDensity
    second_weight: Float[Array, ""] = eqx.field(converter=as_float)

    def _scale(self):
        return jnp.minimum(self.first.scale, self.second.scale)

    def _largest_slope(self):
        return jnp.maximum(self.first.largest_slope, self.second.largest_slope)

    def _shape(self, slope):
        first, second = self.first.radial(slope), self.second.radial(slope)
        return (1 - self.second_weight) * first + self.second_weight * second


LAWS = {
    # Gaussian, exp(-s^2 / 2 t^2) / (2 pi t^2): Beckmann, Spizzichino 1963 The Scattering of Electromagnetic
    # Waves from Rough Surfaces.
    "beckmann": SlopeLaw(1.0, gaussian=0.5, end_in_scales=6.5),
    # t^2 / (pi (t^2 + s^2)^2): Walter, Marschner, Li, Torrance 2007 EGSR, eq. 33. Its variance is infinite:
    # near the flat surface, smooth light changes as t^2 log t.
    "ggx": SlopeLaw(1.0, tail=2.0, end=100.0),
    # Cauchy density of the facet normal per solid angle, D ~ 1 / (1 + (tan theta_n / t)^2), that is
    # P ~ 1 / ((1 + s^2)^2 (1 + s^2 / t^2)): Sokolov, Potemin, Zhdanov, Barladian 2021 CEUR-WS 3027, 13, for
    # the angle sigma; the density is not stated there, this is the interpretation per solid angle. The
    # fraction of steep facets varies as 1 / log(1 / t).
    "cauchy": SlopeLaw(1.0, facet=2.0, tail=1.0, end=30.0),
    # Cauchy density of the facet angle, p(theta_n) ~ 1 / (1 + (tan theta_n / t)^2), azimuth uniform.
    "cauchy_angle": SlopeLaw(0.0, facet=1.0, tail=1.0, end=100.0),
    # Two-dimensional Cauchy density of the slope, P ~ (s^2 + t^2)^-1.5, up to facets of 80 degrees.
    "cauchy2d": SlopeLaw(1.0, tail=1.5, end=float(np.tan(np.deg2rad(80.0)))),
}
DENSITIES = tuple(LAWS)


def slope_density(law: str | SlopeLaw, sigma_deg) -> AnalyticSlopes:
    """Density of a law, or of one of `DENSITIES` by its name; differentiable in the angle, 0 if flat."""
    law = LAWS[law] if isinstance(law, str) else law
    return AnalyticSlopes(jnp.tan(jnp.deg2rad(sigma_deg)) ** 2, law)


def law_name(density: SlopeDensity) -> str:
    """Name of the law of a density, or that of its class if it has no law."""
    if not isinstance(density, AnalyticSlopes):
        return type(density).__name__
    return next((name for name, law in LAWS.items() if law == density.law), "own law")
