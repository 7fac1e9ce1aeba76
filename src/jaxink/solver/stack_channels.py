"""First step of the solution: the response of every layer and interface on the channels of a stack."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.optics.channels import ChannelGrid
from jaxink.optics.layers import ScatteringLayer, TruncatedOptics, delta_m
from jaxink.solver.config import SolverConfig
from jaxink.solver.layer_response import respond
from jaxink.solver.phase_matrices import PhaseMatrices, phase_matrices
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.rough import escape_shares, interface_between_channels, rough_element
from jaxink.solver.specular import FURTHEST, RegularFields, regular_fields
from jaxink.solver.stack import Stack
from jaxink.solver.star_product import RoughElement
from jaxink.surfaces.interface import WaveLobes


class StackChannels(eqx.Module):
    """A stack on its channels: responses of its layers and interfaces, and regular light.

    Parameters
    ----------
    grid
        The channels.
    scale
        Square root of their etendue weights; 1 in a block without width.
    truncated
        Truncated optics of each layer, None for clear layers.
    phase
        Phase function of each layer between the channels, None for clear layers.
    responses
        Reflection and transmission of each layer, see `layer_response`, None for clear layers.
    rough, lobes
        Rough interfaces by position, and their `RoughInterface.lobes`.
    fields, escape
        Regular light in the channels, and `escape_shares` to the front and to the back; 1 instead of 0.
    fields_beyond, escape_beyond
        Regular light at the further directions, and their `escape_shares`.
    """

    grid: ChannelGrid
    scale: Float[Array, " channels"]
    truncated: tuple[TruncatedOptics | None, ...]
    phase: tuple[PhaseMatrices | None, ...]
    responses: tuple[tuple[Array, Array] | None, ...]
    rough: dict[int, RoughElement]
    lobes: dict[int, WaveLobes | None]
    fields: RegularFields
    escape: tuple[Float[Array, " channels"], Float[Array, " channels"]]
    fields_beyond: RegularFields
    escape_beyond: tuple[Float[Array, " directions"], Float[Array, " directions"]]


def put_on_channels(
    stack: Stack, plan: ChannelPlan, config: SolverConfig, kappa: Float[Array, " directions"]
) -> StackChannels:
    """First step of `solve_stack`, with the same arguments."""
    grid = plan.grid(stack, config)
    truncated = tuple(
        delta_m(layer, config.n_moments) if isinstance(layer, ScatteringLayer) else None
        for layer in stack.layers
    )
    thickness = [
        layer.optical_thickness if optics is None else optics.optical_thickness
        for layer, optics in zip(stack.layers, truncated, strict=True)
    ]
    etendue = grid.etendue_weight
    indices = jnp.stack(stack.indices)
    column = indices[:, None]
    # Channels and further directions in one pass, for fewer operations to compile.
    squared = jnp.concatenate([grid.squared_cosine(column), 1 - (kappa / column) ** 2], axis=1)
    everywhere = regular_fields(indices, squared, jnp.stack(thickness), stack.kept_regular(squared), FURTHEST)
    escape = escape_shares(stack, everywhere, squared)
    n_channels = etendue.shape[0]
    fields, fields_beyond = (
        jax.tree.map(lambda x, part=part: x[..., part], everywhere)
        for part in (slice(n_channels), slice(n_channels, None))
    )

    def scattering(layer, optics, cosine):
        if optics is None:
            return None, None
        weight = etendue / (layer.refractive_index**2 * jnp.where(cosine > 0, cosine, 1.0))
        a_matrix, b_matrix, phase = phase_matrices(optics, cosine, weight, config.n_orders)
        return phase, respond(config.layer_method, a_matrix, b_matrix, optics.optical_thickness / 2)

    phase, responses = zip(*map(scattering, stack.layers, truncated, fields.cosines), strict=True)
    # Channels of a block between equal indices have no width and carry no light.
    scale = jnp.where(etendue > 0, jnp.sqrt(jnp.where(etendue > 0, etendue, 1.0)), 1.0)
    interfaces = {k: interface_between_channels(stack, k, plan, config) for k in stack.rough}
    return StackChannels(
        grid=grid,
        scale=scale,
        truncated=truncated,
        phase=phase,
        responses=responses,
        rough={k: rough_element(stack, k, grid, scale, found) for k, found in interfaces.items()},
        lobes={k: found.lobes for k, found in interfaces.items()},
        fields=fields,
        escape=tuple(_divisor(share[:n_channels]) for share in escape),
        fields_beyond=fields_beyond,
        escape_beyond=tuple(share[n_channels:] for share in escape),
    )


def _divisor(share: Float[Array, " channels"]) -> Float[Array, " channels"]:
    """Shares by which the light of a channel is divided; a channel that lets nothing escape carries none."""
    return jnp.where(share > 1e-100, share, 1.0)
