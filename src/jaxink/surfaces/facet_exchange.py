"""Light that the facets of a relief exchange.

What the first reflection sends to other facets leaves after one or more further reflections. It is
distributed over incidence and exit as the loss itself is, which is reciprocal (Kelemen, Szirmay-Kalos 2001
Eurographics short papers, for mirrors), and its power is what the reflections leave of the loss. A relief of
a white body is white.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float, Int

from jaxink.display.brief import brief_repr
from jaxink.numerics.quadrature import barycentric_matrix, gauss_legendre_unit
from jaxink.surfaces.body_series import Coefficients, Mirror, legendre
from jaxink.surfaces.relief import Facets, Pairs, facet_averages, reflected_once, seen_from_both

# Incidences at which the loss is known, up to the largest, and nodes over the exits.
_N_INCIDENCES, _LARGEST_DEG = 10, 89.5
_N_EXITS, _N_EXIT_AZIMUTHS = 10, 12
# Variance below which the quadrature over the exits misses the grazing light that facets hide; below it, the
# loss is proportional to the variance.
_RESOLVED_VARIANCE = 0.0025


def _incidences_deg():
    return _LARGEST_DEG * gauss_legendre_unit(_N_INCIDENCES)[0]


def _cosines():
    return np.cos(np.deg2rad(_incidences_deg()))


def _exits() -> tuple[Pairs, np.ndarray]:
    """Pairs of every incidence with every exit, and projected solid angles of the exits."""
    root, weight = gauss_legendre_unit(_N_EXITS)
    turn, turn_weight = gauss_legendre_unit(_N_EXIT_AZIMUTHS)
    # The squares of the nodes crowd at grazing, where facets hide one another.
    solid = (4 * root**3 * weight)[:, None] * np.pi * turn_weight
    out, azimuth = (a.ravel() for a in np.meshgrid(root**2, np.pi * turn, indexing="ij"))
    pairs = np.broadcast_arrays(_cosines()[:, None], out, azimuth)
    return Pairs(*(one.ravel() for one in pairs)), solid.ravel()


class FacetExchange(eqx.Module):
    """What the facets of a body, or of several, exchange.

    Parameters
    ----------
    loss
        Share of the incident power that the first reflection sends to other facets, at the incidences, over
        ``strength``.
    albedo
        Share of the light on all facets that they reflect, under diffuse light.
    strength
        Factor that vanishes with the variance of slopes.
    """

    __repr__ = brief_repr

    loss: Float[Array, "*bodies incidences"]
    albedo: Float[Array, "*bodies"]
    strength: Float[Array, ""]

    @classmethod
    def of(cls, coefficients: Coefficients, mirrors: Mirror, slope_variance) -> "FacetExchange":
        """For several bodies, along the leading axis."""
        pairs, solid = _exits()
        resolved = jnp.maximum(slope_variance, _RESOLVED_VARIANCE)
        averages = facet_averages(pairs, resolved)
        strength = jnp.minimum(slope_variance / _RESOLVED_VARIANCE, 1.0)

        def at(given):
            body, mirror = given
            same = np.zeros(solid.size * _N_INCIDENCES, int)
            found = reflected_once(pairs, same, body[None], averages, resolved)
            plane, once = (light.reshape(_N_INCIDENCES, -1) @ solid for light in found)
            once = once + _mirrored_power(mirror, resolved)
            on_facets = _on_facets(plane, mirror, resolved)
            return jnp.maximum(on_facets - once, 0.0), _diffuse_mean(on_facets)

        loss, albedo = jax.lax.map(at, (coefficients, mirrors))
        return cls(loss, albedo, strength)

    def at(self, theta_deg: Float[ArrayLike, "2 pairs"], body: Int[ArrayLike, " pairs"]):
        """BSDF of light that met more than one facet, from the polar angles in and out, 1/sr."""
        mean = jax.vmap(_diffuse_mean)(self.loss)
        lost = self.strength * mean
        left = self.strength * (self.albedo - lost) / (1 - lost) / (jnp.pi * jnp.maximum(mean, 1e-30))
        into, out = (
            jnp.sum(_at_incidences(theta) * self.loss[body], axis=1) for theta in jnp.asarray(theta_deg)
        )
        return left[body] * into * out


def _at_incidences(theta_deg):
    """Matrix that interpolates what is known at the incidences."""
    return barycentric_matrix(jnp.asarray(_incidences_deg()), jnp.asarray(theta_deg))


def _diffuse_mean(values):
    """Mean under diffuse light of what is known at the incidences."""
    weights = gauss_legendre_unit(_N_INCIDENCES)[1] * np.sin(2 * np.deg2rad(_incidences_deg()))
    return jnp.sum(weights * values) / np.sum(weights)


def _on_facets(diffuse, mirror: Mirror, slope_variance):
    """Share of the light on the facets seen from each incidence that they reflect."""
    cosines = _cosines()
    degree = cosines.size - 1
    series = np.linalg.inv(np.polynomial.legendre.legvander(2 * cosines - 1, degree)) @ diffuse

    def at(facets, facing):
        area = facets.share * facing / facets.up
        return area @ (legendre(facing, degree) @ series + mirror.reflectance(facing)) / jnp.sum(area)

    return jax.vmap(at)(*_seen_facets(slope_variance))


def _mirrored_power(mirror: Mirror, slope_variance):
    """Share of the incident power that one facet mirrors out of the relief."""

    def at(cosine, facets, facing):
        x, y = (2 * facing * facets.up * slope for slope in (facets.along, facets.across))
        out, x = 2 * facing * facets.up - cosine, x - jnp.sqrt(1 - cosine**2)
        pairs = Pairs(jnp.broadcast_to(cosine, out.shape), jnp.maximum(out, 1e-6), jnp.arctan2(y, x))
        seen = jnp.where(out > 0, seen_from_both(pairs, slope_variance), 0.0)
        return jnp.sum(facets.share * facing / facets.up * mirror.reflectance(facing) * seen) / cosine

    return jax.vmap(at)(jnp.asarray(_cosines()), *_seen_facets(slope_variance))


def _seen_facets(slope_variance):
    """Facets turned to each incidence, and the cosines under which they face it."""

    def at(cosine):
        facets = Facets.turned_to(Pairs(cosine, cosine, jnp.zeros(())), slope_variance)
        return facets, jnp.maximum(facets.facing(cosine, 0.0), 1e-12)

    return jax.vmap(at)(jnp.asarray(_cosines()))
