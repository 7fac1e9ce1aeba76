"""Chebyshev polynomials of the first kind."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

# Terms of a recursion that are computed in one pass over the samples.
_AT_ONCE = 8


def chebyshev_nodes(n_nodes: int) -> Float[np.ndarray, " nodes"]:
    """Zeros of T_n in (-1, 1), descending."""
    return np.cos(_angles(n_nodes))


def node_weights(x: Float[Array, ""], n_nodes: int) -> Float[Array, " nodes"]:
    """Weights of the values at `chebyshev_nodes` in their interpolation to x; differentiable in [-1, 1]."""
    # The derivative of an angle arccos(x) is infinite at the ends.
    polynomials = [jnp.ones_like(x), x]
    while len(polynomials) < n_nodes:
        polynomials.append(2 * x * polynomials[-1] - polynomials[-2])
    degrees = np.arange(n_nodes)
    share = jnp.stack(polynomials[:n_nodes]) * np.where(degrees == 0, 1.0, 2.0) / n_nodes
    return share @ jnp.asarray(np.cos(np.outer(degrees, _angles(n_nodes))))


def _angles(n_nodes: int) -> np.ndarray:
    return (np.arange(n_nodes) + 0.5) * np.pi / n_nodes


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
