"""Solve a stack: regular light, single scattering and multiple scattering.

Three parts are kept apart to the very end. Regular light (undeviated or specular) is a number for each
channel. Light scattered once, in a layer or by one facet of a rough interface, with any number of regular
reflections before and after, is known exactly at any pair of directions. The rest is smooth: it is solved on
the channels and interpolated.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.optics.channels import ChannelGrid
from jaxink.optics.fresnel import propagating_cosine
from jaxink.optics.layers import ScatteringLayer, TruncatedOptics, delta_m
from jaxink.solver.config import SolverConfig
from jaxink.solver.lateral import bessel_j0
from jaxink.solver.layer_response import doubled_response, layer_method, layer_response
from jaxink.solver.phase_matrices import PhaseMatrices, phase_matrices
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.rough import (
    crossing_share,
    interface_between_channels,
    met_between_channels,
    rough_element,
)
from jaxink.solver.single_scattering import scattered_between_channels
from jaxink.solver.specular import RegularFields, attenuation, regular_fields
from jaxink.solver.stack import Stack
from jaxink.solver.star_product import Below, FromBehind, Pile, RoughElement

_RESPONSES = {"discrete_ordinates": layer_response, "adding_doubling": doubled_response}


class StackChannels(eqx.Module):
    """A stack on its channels: what each layer and interface does there, and the regular light.

    Parameters
    ----------
    grid
        The channels.
    scale
        Root of their etendue weights; 1 in a block without width.
    truncated
        Truncated optics of each layer, None for clear ones.
    phase
        Scattering of each layer between the channels, None for clear ones.
    rough
        Rough interfaces by position.
    lobe_factors
        `RoughInterface.lobe_factors` of these.
    fields, escape
        Regular light in the channels, and `_escape_shares` to the front and to the back.
    fields_beyond, escape_beyond
        The same at the further directions that were asked for.
    """

    grid: ChannelGrid
    scale: Float[Array, " channels"]
    truncated: tuple[TruncatedOptics | None, ...]
    phase: tuple[PhaseMatrices | None, ...]
    rough: dict[int, RoughElement]
    lobe_factors: dict
    fields: RegularFields
    escape: tuple[Float[Array, " channels"], Float[Array, " channels"]]
    fields_beyond: RegularFields
    escape_beyond: tuple[Float[Array, " directions"], Float[Array, " directions"]]


class StackResponse(eqx.Module):
    """Multiple scattering of a stack between its channels, without regular and once-scattered light.

    Parameters
    ----------
    channels
        The stack on its channels.
    reflection, transmission
        Basic radiance per irradiance for each azimuthal order (factor 1/(2 pi) and the cosine series left
        out) over the escape shares of either direction, shape ``(orders, channels, channels)``,
        incident channel last; meaningful for channels that reach the surroundings only.
    reflected_power, transmitted_power
        Share of the light of each incident channel that leaves not regularly, over its escape share to the
        front, shape ``(channels,)``. The peak that delta-M takes as undeviated counts as regular.
    backing_gain
        Diffuse light that a backing sends towards the stack, all its reflections to and fro summed, over the
        light that first comes to it; 0 without one.
    returned_power
        Share of that light which leaves in front.
    """

    channels: StackChannels
    reflection: Float[Array, "orders channels channels"]
    transmission: Float[Array, "orders channels channels"]
    reflected_power: Float[Array, " channels"]
    transmitted_power: Float[Array, " channels"]
    backing_gain: Float[Array, ""] | float
    returned_power: Float[Array, ""] | float


class _Whole(NamedTuple):
    """All light of a stack between its channels, in the basis of fluxes.

    ``regular`` holds the regular reflectance and transmittance that it includes; the last two are those of
    `StackResponse`.
    """

    reflection: Array
    transmission: Array
    regular: tuple[Array, Array]
    backing_gain: Array | float
    returned_power: Array | float


def solve_stack(
    stack: Stack, plan: ChannelPlan, config: SolverConfig, kappa: Float[Array, " directions"]
) -> StackResponse:
    """Solve the multiple scattering of a stack for every pair of channels.

    Parameters
    ----------
    stack
        The stack.
    plan
        Its channels.
    config
        Sizes of the discretisation.
    kappa
        Further directions, n sin(theta), at which the regular light is wanted.

    Returns
    -------
    StackResponse
        Serves any number of incidences and directions.
    """
    return solve_channels(stack, put_on_channels(stack, plan, config, kappa), config)


def solve_channels(
    stack: Stack, channels: StackChannels, config: SolverConfig, frequency: Float[Array, ""] | None = None
) -> StackResponse:
    """Solve a stack that has been put on its channels.

    Parameters
    ----------
    stack, channels, config
        As of `put_on_channels`.
    frequency
        Lateral frequency in 1/mm at which the multiply scattered light is wanted, without the first way in
        and the last way out; None: its sum over all places.
    """
    return _without_exact_light(stack, channels, _add_layers(stack, channels, config, frequency))


def put_on_channels(
    stack: Stack, plan: ChannelPlan, config: SolverConfig, kappa: Float[Array, " directions"]
) -> StackChannels:
    """First step: the channels, what layers and interfaces do between them, and the regular light.

    Parameters
    ----------
    stack, plan, config, kappa
        As for `solve_stack`.
    """
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
    # Channels and further directions in one pass: fewer operations to trace and to compile.
    squared = jnp.concatenate([grid.squared_cosine(column), 1 - (kappa / column) ** 2], axis=1)
    everywhere = regular_fields(indices, squared, jnp.stack(thickness), stack.kept_regular(squared))
    escape = _escape_shares(stack, everywhere, squared)
    # The numbers of the channels come first.
    n_channels = etendue.shape[0]
    fields, fields_beyond = (
        jax.tree.map(lambda x, part=part: x[..., part], everywhere)
        for part in (slice(n_channels), slice(n_channels, None))
    )

    def scattering(layer, optics, cosine):
        if optics is None:
            return None
        weight = etendue / (layer.refractive_index**2 * jnp.where(cosine > 0, cosine, 1.0))
        return phase_matrices(optics, cosine, weight, config.n_orders)

    # A block between equal indices has no width, and its channels nothing in them.
    scale = jnp.where(etendue > 0, jnp.sqrt(jnp.where(etendue > 0, etendue, 1.0)), 1.0)
    interfaces = {k: interface_between_channels(stack, k, grid, plan, config) for k in stack.rough}
    return StackChannels(
        grid=grid,
        scale=scale,
        truncated=truncated,
        phase=tuple(map(scattering, stack.layers, truncated, fields.cosines)),
        rough={k: rough_element(stack, k, grid, scale, found) for k, found in interfaces.items()},
        lobe_factors={k: found.lobe_factors for k, found in interfaces.items()},
        fields=fields,
        escape=tuple(share[:n_channels] for share in escape),
        fields_beyond=fields_beyond,
        escape_beyond=tuple(share[n_channels:] for share in escape),
    )


def _escape_shares(stack: Stack, fields: RegularFields, squared_cosine):
    """Share of light that finds its way between what scatters first and the front, and last and the back.

    Scattered light leaves in proportion to it. It has poles close to grazing, of light that thin layers
    reflect to and fro many times, and is hard to interpolate at a rough face, too.
    """
    first, last = stack.scattering[0], stack.scattering[-1]
    front = fields.down_from_front[first] + fields.up_from_front[last]
    back = fields.down_from_back[first] + fields.up_from_back[last]
    if stack.rough and stack.rough[0] <= first:
        k = stack.rough[0]
        front = fields.arriving_from_front[k] * crossing_share(stack, k, squared_cosine, k, k + 1)
    if stack.rough and stack.rough[-1] > last:
        k = stack.rough[-1]
        back = fields.arriving_from_back[k] * crossing_share(stack, k, squared_cosine, k + 1, k)
    return tuple(jnp.where(share > 1e-200, share, 1.0) for share in (front, back))


def _add_layers(stack: Stack, channels: StackChannels, config: SolverConfig, frequency) -> _Whole:
    """Second step: everything put together by the star product, from the back to the front."""
    fields, etendue = channels.fields, channels.grid.etendue_weight
    behind, diffuse = None, None
    if stack.backing is not None:
        behind = jnp.where(channels.grid.squared_cosine(stack.index_back) > 0, jnp.sqrt(etendue), 0.0)
        diffuse = FromBehind(behind, 0.0)
    # Elements that are diagonal in the channels are joined first.
    pile, ways = Pile(Below(None, None, True, diffuse)), [0.0] * len(stack.layers)
    if frequency is not None:
        pile = pile._replace(damping=lambda way: bessel_j0(frequency * way))
        ways = stack.lateral.displacements(fields.cosines)
    respond = _RESPONSES[layer_method(config.layer_method)]
    for k in reversed(range(len(stack.layers) + 1)):
        if k in channels.rough:
            pile = pile.with_rough(channels.rough[k])
        else:
            r = fields.interfaces[k]
            pile = pile.with_diagonal((r, r, 1 - r))
        if k == 0:
            break
        optics, phase, cosine = channels.truncated[k - 1], channels.phase[k - 1], fields.cosines[k - 1]
        if optics is None:
            inside = attenuation(stack.layers[k - 1].optical_thickness, cosine)
            pile = pile.with_diagonal((0.0, 0.0, inside), ways[k - 1])
        else:
            response = respond(phase.a_matrix, phase.b_matrix, optics.optical_thickness / 2)
            pile = pile.with_layer(*response, attenuation(optics.optical_thickness, cosine))
    pile = pile.closed(is_front=True)
    reflection, transmission, _, from_behind = pile.below
    regular = fields.reflection, fields.transmission
    if frequency is not None:
        regular = pile.regular[0], pile.regular[2]
    gain, returned = 0.0, 0.0
    if stack.backing is not None:
        sent = behind @ behind
        gain = stack.backing / (1 - stack.backing * from_behind.returned / sent)
        returned = jnp.sqrt(etendue) @ from_behind.passed / sent
    return _Whole(reflection, transmission, regular, gain, returned)


def _without_exact_light(stack: Stack, channels: StackChannels, whole: _Whole) -> StackResponse:
    """Third step: what is known exactly at any direction taken out; the rest made smooth and summed."""
    scale, fields, grid = channels.scale, channels.fields, channels.grid
    (front, back), regular = channels.escape, whole.regular
    reflection, transmission = whole.reflection, whole.transmission
    reflected_power = (scale @ reflection[0] / scale - regular[0]) / front
    transmitted_power = (scale @ transmission[0] / scale - regular[1]) / front
    for k, element in channels.rough.items():
        met = met_between_channels(element, fields, k)
        reflection, transmission = reflection - met[0], transmission - met[1]
    once_reflected, once_transmitted = 0.0, 0.0
    for k in reversed(stack.scattering):
        once = scattered_between_channels(
            stack.layers[k], channels.truncated[k], channels.phase[k], fields, k
        )
        once_reflected, once_transmitted = once_reflected + once[0], once_transmitted + once[1]
    norm = scale[:, None] * scale[None, :]
    reflection = (reflection - jnp.diag(regular[0])) / norm - once_reflected
    transmission = (transmission - jnp.diag(regular[1])) / norm - once_transmitted
    reflection = reflection / (front[:, None] * front)
    transmission = transmission / (back[:, None] * front)
    if grid.exposed:
        # Near grazing the light scattered twice still varies as 1/(mu_o + mu_i): interpolate without it.
        cosine = propagating_cosine(grid.squared_cosine(grid.block_index[0]))
        reflection = reflection * (cosine[:, None] + cosine[None, :])
    return StackResponse(
        channels=channels,
        reflection=reflection,
        transmission=transmission,
        reflected_power=reflected_power,
        transmitted_power=transmitted_power,
        backing_gain=whole.backing_gain,
        returned_power=whole.returned_power,
    )
