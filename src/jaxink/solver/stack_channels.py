"""First step of the solution: the response of every layer and interface on the channels of a stack."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.optics import ChannelGrid, ScatteringLayer, TruncatedOptics, delta_m
from jaxink.solver.config import SolverConfig
from jaxink.solver.layer_response import respond
from jaxink.solver.phase_matrices import PhaseMatrices, phase_matrices
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.rough import FacetsOnChannels, WavesOnChannels, escape_shares, rough_on_channels
from jaxink.solver.specular import FURTHEST, RegularFields, regular_fields
from jaxink.solver.stack import Stack


class LayerOnChannels(eqx.Module):
    """A scattering layer on the channels of its stack.

    Parameters
    ----------
    layer, truncated
        The layer, and its truncated optics.
    phase
        Its phase function between the channels.
    reflection, transmission
        See `layer_response`.
    """

    layer: ScatteringLayer
    truncated: TruncatedOptics
    phase: PhaseMatrices
    reflection: Float[Array, "orders channels channels"]
    transmission: Float[Array, "orders channels channels"]


class StackChannels(eqx.Module):
    """A stack on its channels: responses of its layers and interfaces, and regular light.

    Parameters
    ----------
    grid
        The channels.
    scale
        Square root of their etendue weights; 1 in a block without width.
    scattering, rough
        Scattering layers and rough interfaces by position.
    fields, escape
        Regular light in the channels, and `escape_shares` to the front and to the back; 1 instead of 0.
    fields_beyond, escape_beyond
        Regular light at the further directions, and their `escape_shares`.
    """

    grid: ChannelGrid
    scale: Float[Array, " channels"]
    scattering: dict[int, LayerOnChannels]
    rough: dict[int, FacetsOnChannels | WavesOnChannels]
    fields: RegularFields
    escape: tuple[Float[Array, " channels"], Float[Array, " channels"]]
    fields_beyond: RegularFields
    escape_beyond: tuple[Float[Array, " directions"], Float[Array, " directions"]]

    def at_directions(self, part: slice) -> "StackChannels":
        """The same with some of the further directions only."""
        fields, escape = jax.tree.map(lambda x: x[..., part], (self.fields_beyond, self.escape_beyond))
        return dataclasses.replace(self, fields_beyond=fields, escape_beyond=escape)


def put_on_channels(
    stack: Stack, plan: ChannelPlan, config: SolverConfig, kappa: Float[Array, " directions"]
) -> StackChannels:
    """First step of `solve_stack`, with the same arguments."""
    grid = plan.grid(stack, config)
    truncated = {k: delta_m(layer, config.n_moments) for k, layer in stack.scattering.items()}
    thickness = [truncated.get(k, layer).optical_thickness for k, layer in enumerate(stack.layers)]
    etendue = grid.etendue_weight
    indices = jnp.stack(stack.indices)
    column = indices[:, None]
    # Channels and further directions in one pass, for fewer operations to compile.
    squared = jnp.concatenate([grid.squared_cosine(column), 1 - (kappa / column) ** 2], axis=1)
    everywhere = regular_fields(indices, squared, jnp.stack(thickness), stack.kept_regular(squared), FURTHEST)
    to_front, to_back = escape_shares(stack, everywhere, squared)
    n_channels = etendue.shape[0]
    fields, fields_beyond = (
        jax.tree.map(lambda x, part=part: x[..., part], everywhere)
        for part in (slice(n_channels), slice(n_channels, None))
    )

    def on_channels(layer, optics, cosine):
        weight = etendue / (layer.refractive_index**2 * jnp.where(cosine > 0, cosine, 1.0))
        a_matrix, b_matrix, phase = phase_matrices(optics, cosine, weight, config.n_orders)
        response = respond(config.layer_method, a_matrix, b_matrix, optics.optical_thickness / 2)
        return LayerOnChannels(layer, optics, phase, *response)

    scattering = {
        k: on_channels(layer, truncated[k], fields.cosines[k]) for k, layer in stack.scattering.items()
    }
    # Channels of a block between equal indices have no width and carry no light.
    scale = jnp.where(etendue > 0, jnp.sqrt(jnp.where(etendue > 0, etendue, 1.0)), 1.0)
    return StackChannels(
        grid=grid,
        scale=scale,
        scattering=scattering,
        rough=rough_on_channels(stack, plan, config, grid, scale),
        fields=fields,
        escape=(_divisor(to_front[:n_channels]), _divisor(to_back[:n_channels])),
        fields_beyond=fields_beyond,
        escape_beyond=(to_front[n_channels:], to_back[n_channels:]),
    )


def _divisor(share: Float[Array, " channels"]) -> Float[Array, " channels"]:
    """Shares by which the light of a channel is divided; a channel that lets nothing escape carries none."""
    return jnp.where(share > 1e-100, share, 1.0)
