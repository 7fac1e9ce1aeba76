"""Facets visible from a direction, and the directions from which they redirect light into it.

Everything is computed from the receiving end: the radiance leaving along o is an average over the facets
visible from o, each of which shows the radiance from the mirrored or refracted direction. In this form there
is no Jacobian for reflection or refraction, and narrow lobes do not need a fine grid of directions.

Light that the facets of a relief exchange.

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
from jaxink.optics import fresnel_reflectance, refracted_cosine
from jaxink.surfaces.body_series import Coefficients, Mirror, legendre
from jaxink.surfaces.relief import Facets, Pairs, facet_averages, reflected_once, seen_from_both
from jaxink.surfaces.slopes import SlopeDensity

# Incidences at which the loss is known, up to the largest, and nodes over the exits.
_N_INCIDENCES, _LARGEST_DEG = 10, 89.5
_N_EXITS, _N_EXIT_AZIMUTHS = 10, 12
# Variance below which the quadrature over the exits misses the grazing light that facets hide; below it, the
# loss is proportional to the variance.
_RESOLVED_VARIANCE = 0.0025


class FacetRule(eqx.Module):
    """Numbers of quadrature nodes over the visible facets.

    Parameters
    ----------
    slopes
        Nodes over the slope, distributed over the panels between kinks of the integrand.
    azimuths
        Nodes over each panel of azimuth.
    total_reflection
        Whether some facets may reflect totally, which adds a kink.
    """

    slopes: int = eqx.field(static=True, default=24)
    azimuths: int = eqx.field(static=True, default=6)
    total_reflection: bool = eqx.field(static=True, default=True)

    @property
    def without_total_reflection(self) -> "FacetRule":
        """The rule for the medium of lower index, with the same number of nodes."""
        return FacetRule(self.slopes, 2 * self.azimuths, False)


class Views(eqx.Module):
    """The facets visible from each receiving direction.

    The x axis is along the azimuth of the receiving direction, the z axis along the normal on its side.

    Parameters
    ----------
    weight
        P(s) (o.m) / m_z with the quadrature weight, shape ``(receivers, facets)``.
    reflectance
        Fresnel reflectance of the facet.
    mirrored, refracted
        Unit vectors towards the origin of the light in the receiver's and in the other medium, shape
        ``(3, receivers, facets)``.
    """

    weight: Float[Array, "receivers facets"]
    reflectance: Float[Array, "receivers facets"]
    mirrored: Float[Array, "3 receivers facets"]
    refracted: Float[Array, "3 receivers facets"]


def _panels(ends, n_nodes):
    """Gauss-Legendre nodes on panels between ends, graded towards the start of each, where a kink may be."""
    unit, weight = gauss_legendre_unit(n_nodes)
    nodes, weights = [], []
    for k, (start, end) in enumerate(zip(ends[:-1], ends[1:], strict=True)):
        width, power = (end - start)[..., None], 1 if k == 0 else 2
        nodes.append(start[..., None] + width * unit**power)
        weights.append(width * weight * power * unit ** (power - 1))
    return jnp.concatenate(nodes, axis=-1), jnp.concatenate(weights, axis=-1)


def _safe_arccos(x):
    """Arc cosine clipped to [-1, 1], with finite derivatives."""
    return jnp.arccos(jnp.clip(x, -1 + 1e-12, 1 - 1e-12))


def _visible(cosine, sine, critical, density: SlopeDensity, rule: FacetRule, places: SlopeDensity):
    """Slope, azimuth, and weight P (o.m)/m_z of the facets of each receiver, shape (receivers, facets).

    Nodes are placed for the density ``places``.
    """
    scale = places.scale
    reach = jnp.arcsinh(places.largest_slope / scale)
    # At these slopes, facets begin to turn away, and begin or cease to reflect totally.
    horizon = jnp.abs(cosine) / sine
    slopes = [horizon]
    if critical is not None:
        towards, beside = critical, jnp.sqrt(1 - critical**2)
        turned = jnp.abs(cosine * towards + sine * beside)
        slopes.append(jnp.abs(sine * towards - cosine * beside) / jnp.maximum(turned, 1e-9))
    kinks = jnp.minimum(jnp.arcsinh(jnp.sort(jnp.stack(slopes), axis=0) / scale), reach)
    zero = jnp.zeros_like(cosine)
    ends = [zero, *kinks, zero + reach]
    v, step = _panels(ends, rule.slopes // (len(ends) - 1))
    slope = scale * jnp.sinh(v)
    weight = step * jnp.sqrt(scale**2 + slope**2) * density.radial(slope) * 2

    across = sine[:, None] * slope
    seen = _safe_arccos(-cosine[:, None] / across)
    unit, unit_weight = gauss_legendre_unit(rule.azimuths)
    if critical is None:
        azimuth, share = seen[..., None] * unit, seen[..., None] * unit_weight
    else:
        facing = (critical * jnp.sqrt(1 + slope**2) - cosine[:, None]) / across
        beyond = jnp.minimum(_safe_arccos(facing), seen)
        # Near total reflection the transmittance varies as a square root: graded towards the end.
        width, rest = beyond[..., None], (seen - beyond)[..., None]
        azimuth = jnp.concatenate([width * (1 - (1 - unit) ** 2), beyond[..., None] + rest * unit], axis=-1)
        share = jnp.concatenate([width * 2 * (1 - unit) * unit_weight, rest * unit_weight], axis=-1)
    projection = cosine[:, None, None] + across[..., None] * jnp.cos(azimuth)
    n = cosine.shape[0]
    slope = jnp.broadcast_to(slope[..., None], azimuth.shape)
    return tuple(part.reshape(n, -1) for part in (slope, azimuth, weight[..., None] * share * projection))


def views(
    cosine: Float[Array, " receivers"],
    sine: Float[Array, " receivers"],
    index_here: Float[Array, ""],
    index_there: Float[Array, ""],
    density: SlopeDensity,
    rule: FacetRule,
    are_held: bool = False,
) -> Views:
    """Facets visible from receiving directions.

    Parameters
    ----------
    cosine, sine
        Of the angle between the receiving direction and the normal on its side; a negative cosine is light
        that leaves a facet towards the surface. The sine is above 0.
    index_here, index_there
        Refractive index on the receiving side and on the other.
    density
        Density of the facets' slopes.
    rule
        Numbers of nodes.
    are_held
        Whether derivatives by the density are those at facets that stay where they are. Sums over facets have
        steps where, as these move, the origin of their light crosses the end of a block of channels.

    References
    ----------
    Walter, Marschner, Li, Torrance 2007 EGSR, eqs. 38 to 40.
    """
    # Facets seen at a smaller cosine reflect totally; practically 0 without total reflection.
    critical = jnp.sqrt(jnp.maximum(1 - (index_there / index_here) ** 2, 1e-16))
    places = jax.lax.stop_gradient(density) if are_held else density
    at = critical if rule.total_reflection else None
    slope, azimuth, weight = _visible(cosine, sine, at, density, rule, places)
    up = 1 / jnp.sqrt(1 + slope**2)
    normal = jnp.stack([slope * up * jnp.cos(azimuth), slope * up * jnp.sin(azimuth), up])
    receiver = jnp.stack([sine, jnp.zeros_like(sine), cosine])[:, :, None]
    facing = jnp.maximum(receiver[0] * normal[0] + receiver[2] * normal[2], 1e-12)
    ratio = index_here / index_there
    beyond = refracted_cosine(index_here, index_there, facing)
    return Views(
        weight,
        fresnel_reflectance(index_here, index_there, facing, beyond),
        2 * facing * normal - receiver,
        (ratio * facing - beyond) * normal - ratio * receiver,
    )


def projected_area(
    cosine: Float[Array, " receivers"],
    sine: Float[Array, " receivers"],
    density: SlopeDensity,
    rule: FacetRule,
) -> Float[Array, " receivers"]:
    """Area of the facets visible along a direction, per area of the surface: (1 + Lambda) cos(theta).

    The cosine, of the angle with the normal, is 0 or more. Smith's masking is the cosine over this area.

    References
    ----------
    Smith 1967 IEEE Trans. Antennas Propag. 15, 668; Heitz 2014 J. Comput. Graph. Tech. 3(2), eq. 19.
    """
    return jnp.sum(_visible(cosine, sine, None, density, rule, density)[2], axis=1)


def mean_transmittance(
    cosine: Float[Array, " receivers"],
    sine: Float[Array, " receivers"],
    index_here: Float[Array, ""],
    index_there: Float[Array, ""],
    density: SlopeDensity,
) -> Float[Array, " receivers"]:
    """Fresnel transmittance averaged over the visible facets by a coarse rule; arguments as for `views`.

    The cosine is 0 or more; for 0 the result is 1.
    """
    propagates = cosine > 0
    cosine, sine = jnp.where(propagates, cosine, 0.5), jnp.where(propagates, sine, 0.5)
    view = views(cosine, sine, index_here, index_there, density, FacetRule(12, 6, False))
    mean = jnp.sum(view.weight * (1 - view.reflectance), axis=1) / jnp.sum(view.weight, axis=1)
    return jnp.where(propagates, mean, 1.0)


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
