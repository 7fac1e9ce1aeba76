"""Legendre polynomials: series, moments, and the normalised associated functions."""

from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from jaxtyping import Array, Float


@jax.jit
def legendre_series(
    moments: Float[Array, " moments"], cosines: Float[ArrayLike, "*points"]
) -> Float[Array, "*points"]:
    """Sum of (2l + 1) chi_l P_l(cosine).

    Parameters
    ----------
    moments
        Unweighted moments chi_l, chi_0 = 1 for a phase function, shape ``(moments,)``.
    cosines
        Points in [-1, 1], any shape; differentiable, including the end points.
    """
    cosines = jnp.asarray(cosines)

    def add_degree(carry, inputs):
        previous, current, total = carry
        degree, weight = inputs
        following = ((2 * degree + 1) * cosines * current - degree * previous) / (degree + 1)
        return (current, following, total + weight * current), None

    degrees = jnp.arange(moments.shape[0], dtype=moments.dtype)
    zero = jnp.zeros(cosines.shape, jnp.result_type(moments, cosines))
    (_, _, total), _ = jax.lax.scan(
        add_degree, (zero, zero + 1, zero), (degrees, (2 * degrees + 1) * moments)
    )
    return total


def moments_of_function(
    values: Float[ArrayLike, "*batch nodes"],
    nodes: Float[ArrayLike, " nodes"],
    weights: Float[ArrayLike, " nodes"],
    n_moments: int,
) -> Float[Array, "*batch moments"]:
    """Moments chi_l = 1/2 integral f(x) P_l(x) dx by a quadrature on (-1, 1).

    Parameters
    ----------
    values
        f at the nodes, shape ``(..., nodes)``.
    nodes, weights
        Quadrature on (-1, 1), the weights sum to 2, each of shape ``(nodes,)``.
    n_moments
        Number of moments, from degree 0; inverse of `legendre_series` if the quadrature is exact.
    """
    polynomials = associated_legendre(n_moments, 1, nodes)[0]
    return (values * weights / 2) @ polynomials.T


@lru_cache(maxsize=64)
def _recurrence_factors(n_moments: int, n_orders: int) -> tuple[np.ndarray, ...]:
    """Factors of the degrees l - 1 and l - 2 in the recurrence for l, and where a new order starts.

    sqrt(l^2 - m^2) Lambda_l^m = (2l - 1) mu Lambda_{l-1}^m - sqrt((l-1)^2 - m^2) Lambda_{l-2}^m.
    """
    degree = np.arange(n_moments, dtype=float)[:, None]
    order = np.arange(n_orders, dtype=float)[None, :]
    above = degree > order
    divisor = np.sqrt(np.where(above, degree**2 - order**2, 1.0))
    one_below = np.where(above, (2 * degree - 1) / divisor, 0.0)
    two_below = np.where(above, np.sqrt(np.maximum((degree - 1) ** 2 - order**2, 0.0)) / divisor, 0.0)
    return one_below, two_below, (degree == order).astype(float)


@lru_cache(maxsize=64)
def _sectoral_factors(n_orders: int) -> np.ndarray:
    """Square roots of (2m - 1)!! / (2m)!!, that is Lambda_m^m / (1 - mu^2)^(m/2)."""
    order = np.arange(1, n_orders, dtype=float)
    return np.sqrt(np.cumprod(np.concatenate([[1.0], (2 * order - 1) / (2 * order)])))


@partial(jax.jit, static_argnums=(0, 1))
def associated_legendre(
    n_moments: int, n_orders: int, cosines: Float[ArrayLike, "*points"]
) -> Float[Array, "orders moments *points"]:
    """Normalised associated Legendre functions sqrt((l-m)!/(l+m)!) P_l^m(mu), without sign (-1)^m.

    Parameters
    ----------
    n_moments, n_orders
        Number of degrees l and of orders m, both from 0.
    cosines
        Points mu in [-1, 1], any shape. Differentiable; at mu = 1 and -1 the infinite derivative of order 1
        is returned as finite.

    Returns
    -------
    Float[Array, "orders moments *points"]
        Lambda_l^m(mu), zero for l < m.

    Notes
    -----
    P_l(cos Theta) = sum_m (2 - delta_m0) Lambda_l^m(mu) Lambda_l^m(mu') cos m(phi - phi').
    The functions are bounded by 1 and the upward recurrence in l is stable; tested to l, m = 300.

    References
    ----------
    Siewert 2000 JQSRT 64, 109, section 2; Abramowitz, Stegun 1964, eq. 8.5.3.
    """
    cosines = jnp.asarray(cosines)
    tail = (1,) * cosines.ndim
    one_below, two_below, starts = (
        f.reshape(f.shape + tail) for f in _recurrence_factors(n_moments, n_orders)
    )
    orders = np.arange(n_orders).reshape(-1, *tail)
    squared_sine = (1 - cosines) * (1 + cosines)
    # Even powers of the sine are polynomials, so only order 1 meets the pole of the root.
    inside = squared_sine > 0
    sine = jnp.where(inside, jnp.sqrt(jnp.where(inside, squared_sine, 1.0)), 0.0)
    power = jnp.power(squared_sine, orders // 2) * jnp.where(orders % 2 == 1, sine, 1.0)
    sectoral = _sectoral_factors(n_orders).reshape(-1, *tail) * power

    def next_degree(carry, factors):
        two_back, one_back = carry
        here = factors[0] * cosines * one_back - factors[1] * two_back + factors[2] * sectoral
        return (one_back, here), here

    zero = jnp.zeros_like(sectoral)
    _, rows = jax.lax.scan(next_degree, (zero, zero), (one_below, two_below, starts))
    return jnp.swapaxes(rows, 0, 1)
