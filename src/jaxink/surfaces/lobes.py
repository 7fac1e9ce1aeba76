"""Lobes of light that meets one facet of a rough interface."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from jaxink.optics import fresnel_reflectance, refracted_cosine
from jaxink.surfaces.slopes import SlopeDensity


def _fresnel(index_1, index_2, cosine):
    return fresnel_reflectance(index_1, index_2, cosine, refracted_cosine(index_1, index_2, cosine))


def _facets_with(squared_across, along, density: SlopeDensity):
    """Density of normals per solid angle, P / cos^4, for a facet normal with these components."""
    slope = jnp.sqrt(jnp.maximum(squared_across, 1e-24)) / along
    return density.density(slope) * (1 + slope**2) ** 2


def reflected_lobe(
    index: tuple[Float[Array, ""] | float, Float[Array, ""] | float],
    cosine_out: Float[Array, " points"],
    cosine_in: Float[Array, " points"],
    azimuth_rad: Float[ArrayLike, " points"],
    density: SlopeDensity,
) -> Float[Array, " points"]:
    """BRDF of reflection by one facet times the projected areas of the facets along both directions, 1/sr.

    Parameters
    ----------
    index
        Refractive indices of the medium of the light and of the other one.
    cosine_out, cosine_in
        Cosines of the angles with the normal, above 0.
    azimuth_rad
        Azimuth between the directions of propagation.
    density
        Density of the facets' slopes.

    References
    ----------
    Walter, Marschner, Li, Torrance 2007 EGSR, eq. 20.
    """
    sine_out, sine_in = (jnp.sqrt(jnp.maximum(1 - c**2, 1e-24)) for c in (cosine_out, cosine_in))
    in_plane = sine_out * sine_in * jnp.cos(azimuth_rad)
    facing = jnp.sqrt(jnp.clip((1 + cosine_out * cosine_in - in_plane) / 2, 1e-24, 1.0))
    across = sine_out**2 + sine_in**2 - 2 * in_plane
    normals = _facets_with(across, cosine_out + cosine_in, density)
    return _fresnel(index[0], index[1], facing) * normals / 4


def transmitted_lobe(
    index: tuple[Float[Array, ""] | float, Float[Array, ""] | float],
    cosine_out: Float[Array, " points"],
    cosine_in: Float[Array, " points"],
    azimuth_rad: Float[ArrayLike, " points"],
    density: SlopeDensity,
) -> Float[Array, " points"]:
    """BTDF of refraction by one facet over the squared index of the exit side, times both projected areas.

    Parameters as for `reflected_lobe`, each cosine in its own medium. The result, basic radiance per
    irradiance in 1/sr, is 0 if no facet refracts light so far, and between equal media.

    References
    ----------
    Walter, Marschner, Li, Torrance 2007 EGSR, eq. 21.
    """
    n_in, n_out = index
    sine_out, sine_in = (jnp.sqrt(jnp.maximum(1 - c**2, 1e-24)) for c in (cosine_out, cosine_in))
    in_plane = sine_out * sine_in * jnp.cos(azimuth_rad)
    # With i towards the source and o away on the other side, the facet normal is along n_i i + n_o o.
    towards_each_other = -in_plane - cosine_out * cosine_in
    side = jnp.where(n_in > n_out, 1.0, -1.0)
    along = side * (n_in * cosine_in - n_out * cosine_out)
    facing_in = side * (n_in + n_out * towards_each_other)
    facing_out = -side * (n_out + n_in * towards_each_other)
    possible = (along > 1e-9) & (facing_in > 1e-12) & (facing_out > 1e-12)
    along, facing_in, facing_out = (jnp.where(possible, v, 1.0) for v in (along, facing_in, facing_out))
    squared = jnp.where(possible, n_in**2 + n_out**2 + 2 * n_in * n_out * towards_each_other, 1.0)
    across = (n_in * sine_in) ** 2 + (n_out * sine_out) ** 2 - 2 * n_in * n_out * in_plane
    normals = _facets_with(jnp.where(possible, across, 0.0), along, density)
    cosine = facing_in / jnp.sqrt(squared)
    passing = 1 - _fresnel(n_in, n_out, jnp.minimum(cosine, 1.0))
    lobe = facing_in * facing_out / squared**2 * passing * normals
    return jnp.where(possible, lobe, 0.0)
