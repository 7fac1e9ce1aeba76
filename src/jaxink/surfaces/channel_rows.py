"""Rows of matrices between channels, from samples of the incoming directions."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.chebyshev import chebyshev
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.optics import ChannelGrid, propagating_cosine


def block_polynomials(
    grid: ChannelGrid, block: int, kappa: Float[Array, "*samples"]
) -> Float[Array, "nodes *samples"]:
    """Chebyshev polynomials in the cosine of a block, at samples in it, as in `node_coefficients`."""
    reference, end, start = (cosine[block] for cosine in grid.block_cosines)
    width = start - end
    cosine = propagating_cosine(1 - (kappa / reference) ** 2)
    x = 2 * (cosine - end) / jnp.where(width > 0, width, 1.0) - 1
    return chebyshev(jnp.clip(x, -1.0, 1.0), grid.nodes_per_block[block])


def _at_samples(grid: ChannelGrid, kappa):
    """For each block, Chebyshev polynomials at the samples (0 outside it), and coefficients by nodes."""
    below = jnp.concatenate([jnp.full(1, -1.0), grid.block_index[:-1]])
    for block, n_nodes in enumerate(grid.nodes_per_block):
        inside = (kappa <= grid.block_index[block]) & (kappa > below[block])
        at_end = jnp.where(inside, kappa, grid.block_index[block])
        yield jnp.where(inside, block_polynomials(grid, block, at_end), 0.0), node_coefficients(n_nodes)


def node_coefficients(n_nodes: int) -> np.ndarray:
    """Chebyshev coefficients of the polynomial through values at the Gauss-Legendre nodes."""
    nodes = 2 * gauss_legendre_unit(n_nodes)[0] - 1
    return np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, n_nodes - 1))


def rows_of_samples(
    grid: ChannelGrid,
    kappa: Float[Array, "receivers samples"],
    cos_azimuth: Float[Array, "receivers samples"],
    weights: list[Float[Array, "receivers samples"]],
    n_orders: int,
) -> Float[Array, "weights orders receivers channels"]:
    """Rows that give weighted sums of a field over samples from its values at the channels, for each weight.

    Parameters
    ----------
    grid
        The channels.
    kappa
        Optical sines n sin(theta) of the samples.
    cos_azimuth
        Cosines of the azimuths between the propagation directions of sample and receiver.
    weights
        One or more sets of weights of the samples.
    n_orders
        Number of azimuthal orders.
    """
    series = chebyshev(cos_azimuth, n_orders)
    # Odd orders vanish like the sine towards the normal; they are interpolated without it.
    series = series * jnp.where((jnp.arange(n_orders) % 2 == 1)[:, None, None], kappa, 1.0)
    series = jnp.concatenate([series * weight for weight in weights])
    samples = list(_at_samples(grid, kappa))
    blocks = [jnp.einsum("mrq,krq->mrk", series, polynomials) @ c for polynomials, c in samples]
    rows = jnp.concatenate(blocks, axis=-1).reshape(len(weights), n_orders, kappa.shape[0], -1)
    return rows / jnp.where((jnp.arange(n_orders) % 2 == 1)[:, None, None], grid.kappa, 1.0)
