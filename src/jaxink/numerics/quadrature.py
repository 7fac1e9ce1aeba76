"""Gauss-Legendre nodes and weights, and barycentric interpolation through them."""

from functools import lru_cache

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float


@lru_cache(maxsize=64)
def gauss_legendre_unit(n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Legendre nodes and weights on (0, 1), ascending.

    Parameters
    ----------
    n_nodes
        Number of nodes.

    Returns
    -------
    nodes, weights
        Each of shape ``(n_nodes,)``; the weights sum to 1.
    """
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
    """Matrix that interpolates values at Gauss-Legendre nodes to other points.

    Parameters
    ----------
    nodes
        Gauss-Legendre nodes of any interval, ascending, shape ``(nodes,)``.
    targets
        Points to interpolate to, shape ``(targets,)``; one that meets a node takes its value.

    Returns
    -------
    Float[Array, "targets nodes"]
        Rows sum to 1.

    References
    ----------
    Berrut, Trefethen 2004 SIAM Rev. 46, 501, eq. 4.2.
    """
    weights = barycentric_weights_unit(nodes.shape[0])
    difference = targets[:, None] - nodes[None, :]
    hit = jnp.abs(difference) < 1e-14
    # A hit would divide by zero; its row is replaced by the unit row below.
    terms = weights / jnp.where(hit, 1.0, difference)
    rows = terms / jnp.sum(terms, axis=1, keepdims=True)
    return jnp.where(jnp.any(hit, axis=1, keepdims=True), hit.astype(rows.dtype), rows)


def _logarithmic_functions(x, xp):
    """The functions x log x and x^2 log x as columns."""
    logarithm = xp.log(xp.where(x > 0, x, 1.0))
    return xp.stack([x * logarithm, x**2 * logarithm], axis=-1)


@lru_cache(maxsize=64)
def _logarithmic_share(n_nodes: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows that take the two coefficients from values at the nodes, and the functions at the nodes.

    The coefficients are those that leave a rest without Legendre polynomials of the two highest degrees.
    """
    nodes, weights = gauss_legendre_unit(n_nodes)
    highest = np.polynomial.legendre.legvander(2 * nodes - 1, n_nodes - 1)[:, -2:].T * weights
    functions = _logarithmic_functions(nodes, np)
    return np.linalg.solve(highest @ functions, highest), functions


def logarithmic_matrix(n_nodes: int, targets: Float[Array, " targets"]) -> Float[Array, "targets nodes"]:
    """Matrix that interpolates values at Gauss-Legendre nodes of (0, 1), exact for x log x and x^2 log x.

    Parameters
    ----------
    n_nodes
        Number of nodes.
    targets
        Points in (0, 1) to interpolate to, shape ``(targets,)``.

    Returns
    -------
    Float[Array, "targets nodes"]
        Rows sum to 1; exact for polynomials two degrees short of those of `barycentric_matrix`.

    Notes
    -----
    The radiance that leaves a scattering medium without an index step varies as mu log(mu) near grazing;
    polynomials alone converge there as the square of the number of nodes only. Written as a correction to
    the polynomial interpolation, it does not magnify rounding however many nodes there are.
    """
    share, functions = _logarithmic_share(n_nodes)
    rows = barycentric_matrix(jnp.asarray(gauss_legendre_unit(n_nodes)[0]), targets)
    return rows + (_logarithmic_functions(targets, jnp) - rows @ functions) @ share
