"""Smooth interface between two transparent media."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float


@jax.jit
def propagating_cosine(squared_cosine: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Cosine of a channel; 0, with a finite derivative, if it is evanescent or exactly grazing."""
    positive = squared_cosine > 0
    return jnp.where(positive, jnp.sqrt(jnp.where(positive, squared_cosine, 1.0)), 0.0)


def refracted_cosine(
    index_1: Float[ArrayLike, "*#shape"],
    index_2: Float[ArrayLike, "*#shape"],
    cosine_1: Float[Array, "*shape"],
) -> Float[Array, "*shape"]:
    """Cosine after refraction into the second medium; 0 if the light is evanescent there."""
    return propagating_cosine(1 - (index_1 / index_2) ** 2 * (1 - cosine_1**2))


@jax.jit
def polarised_reflectance(
    index_1: Float[Array, "*#shape"],
    index_2: Float[Array, "*#shape"],
    cosine_1: Float[Array, "*shape"],
    cosine_2: Float[Array, "*shape"],
) -> tuple[Float[Array, "*shape"], Float[Array, "*shape"]]:
    """Power reflectance of a smooth interface for light polarised parallel and perpendicular to the plane.

    Arguments and source are those of `fresnel_reflectance`.
    """
    s_1, s_2 = index_1 * cosine_1, index_2 * cosine_2
    p_1, p_2 = index_2 * cosine_1, index_1 * cosine_2
    # Both cosines vanish only for a channel that is grazing in equal media; it is transmitted.
    both = (cosine_1 <= 0) & (cosine_2 <= 0)
    r_s = (s_1 - s_2) / jnp.where(both, 1.0, s_1 + s_2)
    r_p = (p_1 - p_2) / jnp.where(both, 1.0, p_1 + p_2)
    return r_p**2, r_s**2


@jax.jit
def fresnel_reflectance(
    index_1: Float[Array, "*#shape"],
    index_2: Float[Array, "*#shape"],
    cosine_1: Float[Array, "*shape"],
    cosine_2: Float[Array, "*shape"],
) -> Float[Array, "*shape"]:
    """Power reflectance of a smooth interface for unpolarised light, the same from either side (0 to 1).

    Parameters
    ----------
    index_1, index_2
        Refractive indices of the two media; broadcast against the cosines.
    cosine_1, cosine_2
        Cosines of the channel in the two media; 0 if it is evanescent, which gives total reflection.

    References
    ----------
    Born, Wolf 1999 Principles of Optics, section 1.5.2.
    """
    parallel, perpendicular = polarised_reflectance(index_1, index_2, cosine_1, cosine_2)
    return (parallel + perpendicular) / 2
