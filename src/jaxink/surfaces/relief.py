"""A body with a relief that is large against the distances that light travels in it.

The surface consists of facets with Gaussian slopes. Each is a piece of the plane body: it reflects by the
body's BSDF at its own angles. Facets hide one another from the source and from the detector (Smith's
shadowing and masking, correlated by height and by azimuth); `jaxink.surfaces.facets` adds the light
that they exchange.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from jaxink.numerics.own_derivatives import by_own_inputs
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.surfaces.body_series import Coefficients, Mirror, between, legendre

# Added to the variance of slopes, so that derivatives with respect to it are finite at the plane surface.
_LEAST_VARIANCE = 1e-10
# Variance of slopes at which half of the mirrored light counts as regular.
_REGULAR_VARIANCE = 1e-4
# Standard deviations of the slope that are integrated over, and nodes of each panel.
_REACH, _N_NODES = 4.5, 12
# Pairs of directions whose facets are averaged at a time.
_BATCH = 512


class Pairs(NamedTuple):
    """Pairs of directions above a surface.

    Parameters
    ----------
    cosine_in, cosine_out
        With the mean normal, above 0.
    azimuth_rad
        Between the directions to the source and to the receiver, seen from above, 0 to pi.
    """

    cosine_in: Float[ArrayLike, "*pairs"]
    cosine_out: Float[ArrayLike, "*pairs"]
    azimuth_rad: Float[ArrayLike, "*pairs"]

    @property
    def sines(self) -> tuple[Float[Array, "*pairs"], Float[Array, "*pairs"]]:
        """Of both polar angles."""
        return _sine(self.cosine_in), _sine(self.cosine_out)

    @property
    def cosine_between(self) -> Float[Array, "*pairs"]:
        """Cosine of the angle between the two directions."""
        sine_in, sine_out = self.sines
        of_cosines = self.cosine_in * self.cosine_out
        return jnp.asarray(of_cosines + sine_in * sine_out * jnp.cos(self.azimuth_rad))


class Facets(NamedTuple):
    """Facets turned to two directions.

    Parameters
    ----------
    along, across
        Slopes along and across the azimuth of the first direction.
    share
        Share of the mean plane that each covers.
    """

    along: Float[Array, "*directions facets"]
    across: Float[Array, "*directions facets"]
    share: Float[Array, "*directions facets"]

    @classmethod
    def turned_to(cls, pair: Pairs, slope_variance) -> "Facets":
        """A quadrature over Gaussian slopes, between the lines beyond which facets turn away."""
        sigma = jnp.sqrt(slope_variance + _LEAST_VARIANCE)
        first, second = (cosine / _sine(cosine) / sigma for cosine in (pair.cosine_in, pair.cosine_out))
        half = pair.azimuth_rad / 2
        beside = jnp.cos(pair.azimuth_rad) < 0
        # Lines of integration along the bisector of both azimuths, or across it if these are far apart. On
        # them the first direction sets a lower limit, the second a lower or an upper one.
        steep, flat = jnp.cos(half), jnp.sin(half)
        steep, flat = jnp.where(beside, flat, steep), jnp.where(beside, steep, flat)
        flat = jnp.where(jnp.abs(flat) > 1e-9, flat, 1e-9)
        # Where both limits meet.
        corner = jnp.where(beside, -(first + second), first - second) / (2 * flat)
        corner = jnp.clip(corner, -_REACH, _REACH)
        ends = jnp.stack([jnp.full_like(corner, -_REACH), corner, jnp.full_like(corner, _REACH)])
        t, weight_t = (one.ravel() for one in _panel(ends[:-1], ends[1:]))
        from_first = (-first - jnp.where(beside, t, -t) * flat) / steep
        from_second = jnp.where(beside, second + t * flat, -second - t * flat) / steep
        lower = jnp.where(beside, from_first, jnp.maximum(from_first, from_second))
        upper = jnp.where(beside, from_second, _REACH)
        lower = jnp.clip(lower, -_REACH, _REACH)
        x, weight_x = _panel(lower, jnp.clip(upper, lower, _REACH))
        share, t = weight_t[:, None] * weight_x, jnp.broadcast_to(t[:, None], x.shape)
        along = jnp.where(beside, x * steep + t * flat, x * steep - t * flat)
        across = jnp.where(beside, t * steep - x * flat, x * flat + t * steep)
        return cls(sigma * along.ravel(), sigma * across.ravel(), share.ravel())

    @property
    def up(self) -> Float[Array, " facets"]:
        """Cosine of the angle of each facet with the mean plane."""
        return 1 / jnp.sqrt(1 + self.along**2 + self.across**2)

    def facing(self, cosine, azimuth_rad) -> Float[Array, " facets"]:
        """Cosine between the facets' normals and a direction."""
        slope = self.along * jnp.cos(azimuth_rad) + self.across * jnp.sin(azimuth_rad)
        return (cosine + _sine(cosine) * slope) * self.up


def _panel(start, end):
    """Nodes between two ends and weights of a normal density, which sum to 1 over the whole reach."""
    unit, weight = gauss_legendre_unit(_N_NODES)
    width = (end - start)[..., None]
    nodes = start[..., None] + width * unit
    whole = _REACH * (2 * unit - 1)
    norm = np.sum(2 * _REACH * weight * np.exp(-(whole**2) / 2))
    return nodes, width * weight * jnp.exp(-(nodes**2) / 2) / norm


def _sine(cosine):
    return jnp.sqrt(jnp.maximum(1 - jnp.asarray(cosine, float) ** 2, 1e-24))


def smith_lambda(cosine: Float[ArrayLike, "*shape"], slope_variance) -> Float[Array, "*shape"]:
    """Smith's Lambda of Gaussian slopes: area hidden along a direction over the area seen.

    References
    ----------
    Smith 1967 IEEE Trans. Antennas Propag. 15, 668.
    """
    steepness = jnp.asarray(cosine, float) / _sine(cosine)
    steepness = steepness / jnp.sqrt(2 * (slope_variance + _LEAST_VARIANCE))
    # Beyond 26 the function is 0 in 64 bits.
    near = jnp.clip(steepness, 1e-9, 26.0)
    hidden = (jnp.exp(-(near**2)) / (near * jnp.sqrt(jnp.pi)) - jax.scipy.special.erfc(near)) / 2
    return jnp.where(steepness < 26.0, hidden, 0.0)


def seen_from_both(pairs: Pairs, slope_variance) -> Float[Array, "*pairs"]:
    """Share of the facets turned to both directions that are hidden from neither.

    References
    ----------
    Van Ginneken, Stavridi, Koenderink 1998 Appl. Opt. 37, 130 (facets seen along nearly the same azimuth).
    """
    into, out = (smith_lambda(cosine, slope_variance) for cosine in (pairs.cosine_in, pairs.cosine_out))
    apart = jnp.arccos(jnp.clip(jnp.cos(pairs.azimuth_rad), -1 + 1e-12, 1 - 1e-12))
    independent = 4.41 * apart / (4.41 * apart + 1)
    return 1 / (1 + jnp.maximum(into, out) + independent * jnp.minimum(into, out))


def facet_averages(pairs: Pairs, slope_variance) -> Float[Array, "pairs degrees degrees"]:
    """The polynomials of i.m and o.m of a body's series, averaged over the facets turned to both directions.

    With the coefficients of the body they give its BSDF if every facet reflected once and none were hidden.
    They do not depend on the body, so their derivative is taken once, by the variance.
    """

    def averages(inputs):
        pairs, slope_variance = inputs
        return jax.lax.map(lambda pair: _average(pair, slope_variance), pairs, batch_size=_BATCH)

    inputs = Pairs(*map(jnp.asarray, pairs)), jnp.asarray(slope_variance, float)
    return by_own_inputs(averages, inputs)


def _average(pair: Pairs, slope_variance):
    facets = Facets.turned_to(pair, slope_variance)
    towards = facets.facing(pair.cosine_in, 0.0), facets.facing(pair.cosine_out, pair.azimuth_rad)
    a, b = (jnp.maximum(cosine, 1e-12) for cosine in towards)
    share = facets.share * a * b / ((a + b) * facets.up)
    return jnp.einsum("k,kp,kq->pq", share, legendre(a), legendre(b)) / (pair.cosine_in * pair.cosine_out)


class Once(NamedTuple):
    """BSDF in 1/sr of a body with a plane surface, and of light that meets one facet of its relief."""

    plane: Float[Array, " pairs"]
    facets: Float[Array, " pairs"]


def reflected_once(
    pairs: Pairs,
    body: Int[ArrayLike, " pairs"],
    coefficients: Coefficients,
    averages: Float[Array, "pairs degrees degrees"],
    slope_variance,
) -> Once:
    """Light that the volume of a body returns through a plane surface, or through one facet.

    Parameters
    ----------
    pairs
        Pairs of directions.
    body
        Position of the body of each pair among the bodies.
    coefficients
        Of each body, shape ``(bodies, degrees, degrees, orders)``.
    averages
        From `facet_averages` for the pairs and the variance.
    slope_variance
        Variance of the slope along each axis.
    """

    def at(given):
        pair, which, average = given
        of_pair = between(coefficients[which], pair.cosine_between)
        a, b = pair.cosine_in, pair.cosine_out
        return Once(legendre(a) @ of_pair @ legendre(b) / (a + b), jnp.sum(of_pair * average))

    arrays = Pairs(*map(jnp.asarray, pairs)), jnp.asarray(body), averages
    plane, facets = jax.lax.map(at, arrays, batch_size=_BATCH)
    return Once(plane, facets * seen_from_both(pairs, slope_variance))


def mirrored_once(pairs: Pairs, mirror: Mirror, slope_variance) -> Float[Array, "*pairs"]:
    """BSDF of light that one facet mirrors, 1/sr.

    References
    ----------
    Walter, Marschner, Li, Torrance 2007 EGSR, eq. 20.
    """
    sine_in, sine_out = pairs.sines
    across = sine_in**2 + sine_out**2 + 2 * sine_in * sine_out * jnp.cos(pairs.azimuth_rad)
    squared = across / (pairs.cosine_in + pairs.cosine_out) ** 2
    variance = slope_variance + _REGULAR_VARIANCE
    density = jnp.exp(-squared / (2 * variance)) / (2 * jnp.pi * variance) * (1 + squared) ** 2
    reflectance = mirror.reflectance(jnp.sqrt(jnp.maximum(1 + pairs.cosine_between, 1e-24) / 2))
    lobe = reflectance * density / (4 * pairs.cosine_in * pairs.cosine_out)
    return lobe * seen_from_both(pairs, slope_variance) * (1 - regular_share(slope_variance))


def regular_share(slope_variance) -> Float[Array, ""]:
    """Share of the mirrored light that counts as regular: all at the plane surface, little beyond.

    A lobe made by slopes of a hundredth differs from a regular peak in no measurement, and without this share
    it would have no finite derivative at the plane surface.
    """
    return _REGULAR_VARIANCE / (jnp.asarray(slope_variance, float) + _REGULAR_VARIANCE)
