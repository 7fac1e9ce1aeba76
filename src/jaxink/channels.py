"""Channels of transverse direction that a whole stack of media shares.

Snell's law keeps kappa = n sin(theta). Every medium uses the same channels of kappa, so a smooth interface
is diagonal. The interval of kappa is split at each refractive index of the stack, where some medium
begins to reflect totally; within a block the nodes are Gauss-Legendre in the cosine of the medium whose
index ends the block, which resolves both ends. Fluxes are carried as sqrt(c) L, with the basic radiance
L = I / n^2 and the etendue weight c = n^2 w mu, the same in every medium: reciprocity is symmetry.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.numerics.quadrature import barycentric_matrix, gauss_legendre_unit


class ChannelGrid(eqx.Module):
    """Quadrature channels, ascending blocks of kappa.

    Parameters
    ----------
    block_index
        Refractive index that ends each block, ascending, shape ``(blocks,)``; block 0 begins at kappa = 0,
        each other one where the one before it ends.
    nodes_per_block
        Number of nodes of each block.
    grazing_power
        Nodes are Gauss-Legendre in mu^(1/power) of block 0. 1 where the surface refracts; 2 where a
        scattering medium meets its surroundings without an index step, because its radiance then varies
        as mu log(mu) near grazing.
    """

    block_index: Float[Array, " blocks"]
    nodes_per_block: tuple[int, ...] = eqx.field(static=True)
    grazing_power: int = eqx.field(static=True, default=1)

    def _blocks(self):
        """Yield for each block: interval of the node variable, its nodes, cosines and etendue weights."""
        start = jnp.zeros(())
        for block, n_nodes in enumerate(self.nodes_per_block):
            index = self.block_index[block]
            power = self.grazing_power if block == 0 else 1
            unit_nodes, unit_weights = gauss_legendre_unit(n_nodes)
            top = jnp.ones(()) if block == 0 else jnp.sqrt(1 - (start / index) ** 2)
            variable = top * unit_nodes
            cosine = variable**power
            weight = top * unit_weights * power * variable ** (power - 1)
            yield index, variable, cosine, index**2 * weight * cosine
            start = index

    @property
    def etendue_weight(self) -> Float[Array, " channels"]:
        """Weight n^2 w mu of each channel, shape ``(channels,)``."""
        return jnp.concatenate([weight for *_, weight in self._blocks()])

    @property
    def kappa(self) -> Float[Array, " channels"]:
        """N sin(theta) of each channel, shape ``(channels,)``."""
        return jnp.concatenate([index * jnp.sqrt(1 - cosine**2) for index, _, cosine, _ in self._blocks()])

    def squared_cosine(self, refractive_index) -> Float[Array, " channels"]:
        """mu^2 of each channel in a medium; negative where the channel is evanescent there."""
        # n^2 mu^2 = n^2 - n_b^2 + n_b^2 mu_b^2 keeps all digits of grazing cosines where n = n_b.
        n2 = jnp.asarray(refractive_index) ** 2
        return jnp.concatenate(
            [(n2 - index**2 + (index * cosine) ** 2) / n2 for index, _, cosine, _ in self._blocks()]
        )

    def interpolation(self, kappa: Float[Array, " targets"]) -> Float[Array, "targets channels"]:
        """Matrix from values at the channels to values at other kappa.

        Parameters
        ----------
        kappa
            n sin(theta) of the wanted directions, shape ``(targets,)``.

        Returns
        -------
        Float[Array, "targets channels"]
            Each row has non-zero entries in the block of its kappa only.
        """
        columns, start = [], None
        for block, (index, variable, *_) in enumerate(self._blocks()):
            power = self.grazing_power if block == 0 else 1
            squared = 1 - (kappa / index) ** 2
            inside = squared >= 0
            cosine = jnp.sqrt(jnp.where(inside & (squared > 0), squared, 1.0)) * (squared > 0)
            rows = barycentric_matrix(variable, cosine ** (1 / power) if power > 1 else cosine)
            if start is not None:
                inside = inside & (kappa > start)
            columns.append(jnp.where(inside[:, None], rows, 0.0))
            start = index
        return jnp.concatenate(columns, axis=1)
