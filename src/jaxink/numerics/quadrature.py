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
