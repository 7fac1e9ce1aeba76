"""Gauss-Legendre nodes and weights, and barycentric interpolation through them."""

from functools import lru_cache

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


@lru_cache(maxsize=64)
def gauss_legendre_unit(n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes, ascending, and weights, with sum 1, on (0, 1), each of shape ``(n_nodes,)``."""
    nodes, weights = np.polynomial.legendre.leggauss(n_nodes)
    return (nodes + 1) / 2, weights / 2


@lru_cache(maxsize=64)
def barycentric_weights_unit(n_nodes: int) -> np.ndarray:
    """Barycentric weights of the Gauss-Legendre nodes on (0, 1).

    References
    ----------
    Berrut, Trefethen 2004 SIAM Rev. 46, 501, section 5: w_j = (-1)^j sqrt((1 - x_j^2) lambda_j).
    """
    nodes, weights = np.polynomial.legendre.leggauss(n_nodes)
    return (-1.0) ** np.arange(n_nodes) * np.sqrt((1 - nodes**2) * weights)


def barycentric_matrix(
    nodes: Float[Array, " nodes"], targets: Float[Array, " targets"]
) -> Float[Array, "targets nodes"]:
    """Matrix that interpolates values at ascending Gauss-Legendre nodes of any interval; rows sum to 1.

    References
    ----------
    Berrut, Trefethen 2004 SIAM Rev. 46, 501, eq. 4.2.
    """
    weights = barycentric_weights_unit(nodes.shape[0])
    difference = targets[:, None] - nodes[None, :]
    hit = jnp.abs(difference) < 1e-14
    # A target on a node would divide by zero; its row is replaced by a unit row below.
    terms = weights / jnp.where(hit, 1.0, difference)
    rows = terms / jnp.sum(terms, axis=1, keepdims=True)
    return jnp.where(jnp.any(hit, axis=1, keepdims=True), hit.astype(rows.dtype), rows)


def _logarithmic_functions(x, xp):
    """The functions x log x and x^2 log x as columns."""
    logarithm = xp.log(xp.where(x > 0, x, 1.0))
    return xp.stack([x * logarithm, x**2 * logarithm], axis=-1)


@lru_cache(maxsize=64)
def _logarithmic_share(n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows that give the two coefficients from values at the nodes, and the functions at the nodes.

    The remainder has no component of the Legendre polynomials of the two highest degrees.
    """
    nodes, weights = gauss_legendre_unit(n_nodes)
    highest = np.polynomial.legendre.legvander(2 * nodes - 1, n_nodes - 1)[:, -2:].T * weights
    functions = _logarithmic_functions(nodes, np)
    return np.linalg.solve(highest @ functions, highest), functions


def logarithmic_matrix(n_nodes: int, targets: Float[Array, " targets"]) -> Float[Array, "targets nodes"]:
    """Matrix that interpolates values at Gauss-Legendre nodes of (0, 1), exact for x log x and x^2 log x.

    Rows sum to 1. It is exact for polynomials of two degrees less than `barycentric_matrix`.

    Notes
    -----
    The radiance that leaves a scattering medium without an index step varies as mu log(mu) near grazing,
    where polynomials alone converge only with the square of the number of nodes. Written as a correction to
    polynomial interpolation, it does not amplify rounding errors for any number of nodes.
    """
    share, functions = _logarithmic_share(n_nodes)
    rows = barycentric_matrix(jnp.asarray(gauss_legendre_unit(n_nodes)[0]), targets)
    return rows + (_logarithmic_functions(targets, jnp) - rows @ functions) @ share
