"""Chebyshev polynomials of the first kind."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def chebyshev(x: Float[Array, "*points"], n_terms: int) -> Float[Array, "terms *points"]:
    """T_0 ... T_(n-1) at points in [-1, 1]."""

    def following(carry, _):
        before, here = carry
        return (here, 2 * x * here - before), here

    _, rows = jax.lax.scan(following, (x, jnp.ones_like(x)), None, length=n_terms)
    return rows
