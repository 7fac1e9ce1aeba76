"""Chebyshev polynomials of the first kind."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

# Terms of a recursion that are computed in one pass over the samples.
_AT_ONCE = 8


def chebyshev(x: Float[Array, "*points"], n_terms: int) -> Float[Array, "terms *points"]:
    """T_0 ... T_(n-1) at points in [-1, 1]."""

    def following(carry, _):
        before, here = carry
        return (here, 2 * x * here - before), here

    _, rows = jax.lax.scan(following, (x, jnp.ones_like(x)), None, length=n_terms)
    return rows


def chebyshev_moments(
    x: Float[Array, "*shape samples"], weights: Float[Array, "*shape samples"], n_terms: int
) -> Float[Array, "terms *shape"]:
    """Weighted sums of T_0 ... T_(n-1) over samples in [-1, 1], without an array of all polynomials."""

    def following(carry, _):
        before, here = carry
        moments = []
        for _ in range(_AT_ONCE):
            moments.append(jnp.sum(before * weights, axis=-1))
            before, here = here, 2 * x * here - before
        return (before, here), jnp.stack(moments)

    _, groups = jax.lax.scan(following, (jnp.ones_like(x), x), None, length=-(-n_terms // _AT_ONCE))
    return groups.reshape(-1, *x.shape[:-1])[:n_terms]
