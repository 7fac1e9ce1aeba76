"""Channels: discrete directions (streams) that all media of a stack share.

Snell's law conserves kappa = n sin(theta). Every medium uses the same channels of kappa, so a smooth
interface is diagonal. The interval of kappa is split at each refractive index of the stack, where total
reflection begins in some medium. Within a block the nodes are Gauss-Legendre in the cosine of the medium
whose index ends the block, which resolves both ends. If a scattering medium is only slightly denser, its
cosine is used instead, in which its own integrals are exact however small the difference.

Fluxes are carried as sqrt(c) L, with the basic radiance L = I / n^2 and the etendue weight c = n^2 w mu,
which is equal in all media: reciprocity becomes symmetry.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxink.numerics.quadrature import (
    barycentric_matrix,
    gauss_legendre_unit,
    logarithmic_matrix,
)
from jaxink.optics.fresnel import propagating_cosine

# Relative index excess up to which a block takes its nodes from the next medium, if that scatters.
CLOSE = 3e-4


class ChannelGrid(eqx.Module):
    """Quadrature channels in ascending blocks of kappa.

    Parameters
    ----------
    block_index
        Refractive index that ends each block, ascending, shape ``(blocks,)``; block 0 begins at kappa = 0,
        each other block at the end of the previous one.
    scatters
        Whether the medium of that index scatters, shape ``(blocks,)``.
    nodes_per_block
        Number of nodes of each block.
    exposed
        Whether a scattering medium meets its surroundings without an index step: its radiance then varies
        as mu log(mu) near grazing, which the interpolation in block 0 takes into account.
    """

    block_index: Float[Array, " blocks"]
    scatters: Bool[Array, " blocks"]
    nodes_per_block: tuple[int, ...] = eqx.field(static=True)
    exposed: bool = eqx.field(static=True)
    # For each block: index of the medium that defines the nodes, its cosines at the end and the start.
    block_cosines: tuple[Float[Array, " blocks"], ...]
    # For each channel: index of that medium, cosine in it and quadrature weight.
    _nodes: tuple[Float[Array, " channels"], ...]

    def __init__(self, block_index, scatters, nodes_per_block, exposed=False):
        self.block_index, self.scatters = block_index, scatters
        self.nodes_per_block, self.exposed = nodes_per_block, exposed
        self.block_cosines, self._nodes = _nodes_of(block_index, scatters, nodes_per_block, exposed)

    @property
    def etendue_weight(self) -> Float[Array, " channels"]:
        """Weight n^2 w mu of each channel."""
        index, cosine, weight = self._nodes
        return index**2 * weight * cosine

    @property
    def kappa(self) -> Float[Array, " channels"]:
        """Transverse direction n sin(theta) of each channel."""
        index, cosine, _ = self._nodes
        return index * jnp.sqrt(1 - cosine**2)

    def squared_cosine(self, refractive_index) -> Float[Array, "*media channels"]:
        """mu^2 of each channel in a medium; negative if the channel is evanescent there.

        Parameters
        ----------
        refractive_index
            Index of the medium, or of several media as a column, shape ``(media, 1)``.
        """
        # n^2 mu^2 = n^2 - n_b^2 + n_b^2 mu_b^2 keeps all digits of grazing cosines if n = n_b.
        index, cosine, _ = self._nodes
        n2 = jnp.asarray(refractive_index) ** 2
        return (n2 - index**2 + (index * cosine) ** 2) / n2

    def interpolation(self, kappa: Float[Array, " targets"]) -> Float[Array, "targets channels"]:
        """Matrix that interpolates from the channels to other kappa.

        Parameters
        ----------
        kappa
            n sin(theta) of the directions to interpolate to. A row is zero outside the block of its kappa.
        """
        _, nodes, _ = self._nodes
        reference, end, _ = self.block_cosines
        columns, first, start = [], 0, None
        for block, n_nodes in enumerate(self.nodes_per_block):
            index = self.block_index[block]
            inside = kappa <= index
            cosine = propagating_cosine(1 - (kappa / reference[block]) ** 2)
            if block == 0 and self.exposed:
                rows = logarithmic_matrix(n_nodes, cosine)
            else:
                # The nodes of a block between equal indices coincide; it contains no direction.
                here = nodes[first : first + n_nodes]
                wide = here[-1] > end[block]
                rows = barycentric_matrix(jnp.where(wide, here, jnp.arange(n_nodes)), cosine)
            if start is not None:
                inside = inside & (kappa > start)
            columns.append(jnp.where(inside[:, None], rows, 0.0))
            first, start = first + n_nodes, index
        return jnp.concatenate(columns, axis=1)


# Jitted separately: traced once for all programs.
@partial(jax.jit, static_argnums=(2, 3))
def _nodes_of(index, scatters, nodes_per_block, exposed):
    """Media and cosines of the blocks, and medium, cosine and weight of the channels."""
    denser = jnp.append(index[1:], index[-1])
    close = (denser < index * (1 + CLOSE)) & jnp.append(scatters[1:], False)
    if exposed:
        close = close.at[0].set(False)
    reference = jnp.where(close, denser, index)
    starts = jnp.concatenate([jnp.zeros(1), index[:-1]])
    # Exactly 0 where kappa is the reference itself, however the compiler rounds.
    end, start = (
        propagating_cosine((reference - kappa) * (reference + kappa) / reference**2)
        for kappa in (index, starts)
    )
    units = [gauss_legendre_unit(n_nodes) for n_nodes in nodes_per_block]
    block = np.repeat(np.arange(len(units)), nodes_per_block)
    unit_node, unit_weight = (np.concatenate(parts) for parts in zip(*units, strict=True))
    medium, first, last = (part[block] for part in (reference, end, start))
    nodes = medium, first + (last - first) * unit_node, (last - first) * unit_weight
    return (reference, end, start), nodes
