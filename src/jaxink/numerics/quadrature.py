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


# Functions beside the polynomials: x log x and x^2 log x. More of them magnify the rounding of the values.
_LOGARITHMIC_TERMS = 2


def _logarithmic_basis(x, n_functions: int, xp):
    """Chebyshev polynomials on (0, 1), and x log x times the first of them, as columns."""
    angle = xp.arccos(xp.clip(2 * x - 1, -1.0, 1.0))
    singular = x * xp.log(xp.where(x > 0, x, 1.0))
    columns = [xp.cos(i * angle) for i in range(n_functions - _LOGARITHMIC_TERMS)]
    columns += [singular * xp.cos(i * angle) for i in range(_LOGARITHMIC_TERMS)]
    return xp.stack(columns, axis=-1)


@lru_cache(maxsize=64)
def _logarithmic_inverse(n_nodes: int) -> np.ndarray:
    nodes, _ = gauss_legendre_unit(n_nodes)
    return np.linalg.pinv(_logarithmic_basis(nodes, n_nodes, np), rcond=1e-15)


def logarithmic_matrix(n_nodes: int, targets: Float[Array, " targets"]) -> Float[Array, "targets nodes"]:
    """Matrix that interpolates values at Gauss-Legendre nodes of (0, 1), with x log x among its functions.

    Parameters
    ----------
    n_nodes
        Number of nodes.
    targets
        Points in (0, 1) to interpolate to, shape ``(targets,)``.

    Returns
    -------
    Float[Array, "targets nodes"]
        Rows sum to 1.

    Notes
    -----
    The radiance that leaves a scattering medium without an index step varies as mu log(mu) near grazing;
    polynomials alone converge there as the square of the number of nodes only.
    """
    return _logarithmic_basis(targets, n_nodes, jnp) @ _logarithmic_inverse(n_nodes)
