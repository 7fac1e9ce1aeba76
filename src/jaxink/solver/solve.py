"""Solve a stack: regular light, single scattering and multiple scattering.

The three parts are kept apart to the end. Regular (specular or directly transmitted) light is one number
per channel. Light scattered once, in a layer or by one facet of a rough interface, with any number of regular
reflections before and after, is known exactly for any pair of directions. The rest is smooth: it is solved on
the channels and interpolated.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.optics import propagating_cosine
from jaxink.solver.config import SolverConfig
from jaxink.solver.lateral import LateralWave
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.rough import met_between_channels
from jaxink.solver.single_scattering import scattered_between_channels
from jaxink.solver.specular import FURTHEST, attenuation
from jaxink.solver.stack import Stack
from jaxink.solver.stack_channels import StackChannels, put_on_channels
from jaxink.solver.star_product import BackingResponse, Nothing, StackAssembly


class StackResponse(eqx.Module):
    """Multiple scattering of a stack between its channels, without regular and singly scattered light.

    Parameters
    ----------
    reflection, transmission
        Basic radiance per irradiance for each azimuthal order (without the factor 1/(2 pi) and the cosine
        series) over the escape shares of both directions, shape ``(orders, channels, channels)``,
        incident channel last; meaningful only for channels that reach the surroundings.
    reflected_power, transmitted_power
        Diffuse share of the light of each incident channel over its escape share to the front, shape
        ``(channels,)``. The forward peak that delta-M treats as unscattered counts as regular.
    backing_gain
        Diffuse light that a backing sends towards the stack, with all interreflections, over the light that
        first reaches it; 0 without a backing.
    returned_power
        Share of that light that leaves at the front.
    transmitted_from_back
        As ``transmitted_power``, of light incident on the back, over its escape share to the back.
    reflectance_from_back
        Of the stack for uniformly diffuse light incident on its back; 0 without a backing.
    """

    reflection: Float[Array, "orders channels channels"]
    transmission: Float[Array, "orders channels channels"]
    reflected_power: Float[Array, " channels"]
    transmitted_power: Float[Array, " channels"]
    backing_gain: Float[Array, ""] | float
    returned_power: Float[Array, ""] | float
    transmitted_from_back: Float[Array, " channels"]
    reflectance_from_back: Float[Array, ""] | float


class _Whole(NamedTuple):
    """Light of a stack between its channels in the basis of fluxes, with its regular part given again.

    What clear layers and smooth interfaces at the front reflect by themselves is left out of both. The last
    three are those of `StackResponse`.
    """

    reflection: Array
    transmission: Array
    regular: tuple[Array, Array]
    backing_gain: Array | float
    returned_power: Array | float
    reflectance_from_back: Array | float


def solve_stack(
    stack: Stack, plan: ChannelPlan, config: SolverConfig, kappa: Float[Array, " directions"]
) -> tuple[StackChannels, StackResponse]:
    """Solve the multiple scattering of a stack for every pair of channels.

    In three steps: the response of every layer and interface on the channels, their star product, and the
    subtraction of what is known exactly.

    Parameters
    ----------
    stack, plan
        The stack and its channels.
    config
        Resolution.
    kappa
        n sin(theta) of further directions at which the regular light is needed.
    """
    channels = put_on_channels(stack, plan, config, kappa)
    return channels, solve_channels(stack, channels)


def solve_channels(stack: Stack, channels: StackChannels, wave: LateralWave | None = None) -> StackResponse:
    """Second and third step, for a stack that has been put on its channels.

    Parameters
    ----------
    stack, channels
        The stack and the result of `put_on_channels`.
    wave
        Lateral frequency of the multiply scattered light; None for the light integrated over the sample.
    """
    return _without_exact_light(channels, _add_layers(stack, channels, wave))


def _add_layers(stack: Stack, channels: StackChannels, wave: LateralWave | None) -> _Whole:
    """Second step: star product of all layers and interfaces, from the back to the front."""
    fields, etendue = channels.fields, channels.grid.etendue_weight
    diffuse = None
    if stack.backing is not None:
        light = jnp.where(channels.grid.squared_cosine(stack.index_back) > 0, jnp.sqrt(etendue), 0.0)
        diffuse = BackingResponse.of(stack.backing, light)
    # Elements diagonal in the channels are joined first.
    pile = StackAssembly(Nothing(diffuse), None if wave is None else wave.damping)
    ways = [0.0] * len(stack.layers) if wave is None else wave.displacements(fields.cosines)
    for k in reversed(range(len(stack.layers) + 1)):
        if k in channels.rough:
            pile = pile.with_rough(channels.rough[k].element)
        else:
            r = fields.interfaces[k]
            pile = pile.with_diagonal((r, r, 1 - r))
        if k == 0:
            break
        cosine = fields.cosines[k - 1]
        if k - 1 in channels.scattering:
            layer = channels.scattering[k - 1]
            undeviated = attenuation(layer.truncated.optical_thickness, cosine, FURTHEST)
            pile = pile.with_layer(layer.reflection, layer.transmission, undeviated)
        else:
            inside = attenuation(stack.layers[k - 1].optical_thickness, cosine, FURTHEST)
            dark = jnp.zeros_like(inside)
            pile = pile.with_diagonal((dark, dark, inside), ways[k - 1])
    (reflection, transmission, _, from_behind), regular = pile.whole()
    gain: Array | float = 0.0
    returned: Array | float = 0.0
    from_back: Array | float = 0.0
    if from_behind is not None:
        sent = from_behind.light @ from_behind.light
        from_back = from_behind.returned / sent
        gain = from_behind.reflectance / (1 - from_behind.reflectance * from_back)
        returned = jnp.sqrt(etendue) @ from_behind.passed / sent
    return _Whole(reflection, transmission, (regular[0], regular[2]), gain, returned, from_back)


def _without_exact_light(channels: StackChannels, whole: _Whole) -> StackResponse:
    """Third step: subtract what is known exactly for any direction; make the rest smooth."""
    scale, fields, grid = channels.scale, channels.fields, channels.grid
    (front, back), regular = channels.escape, whole.regular
    reflection, transmission = whole.reflection, whole.transmission
    reflected_power = (scale @ reflection[0] / scale - regular[0]) / front
    transmitted_power = (scale @ transmission[0] / scale - regular[1]) / front
    # By reciprocity, light that takes each way backwards.
    transmitted_from_back = (transmission[0] @ scale / scale - regular[1]) / back
    for k, face in channels.rough.items():
        met = met_between_channels(face.element, fields, k)
        reflection, transmission = reflection - met[0], transmission - met[1]
    once_reflected: Array | float = 0.0
    once_transmitted: Array | float = 0.0
    for k, layer in reversed(channels.scattering.items()):
        once = scattered_between_channels(layer.layer, layer.truncated, layer.phase, fields, k)
        once_reflected, once_transmitted = once_reflected + once[0], once_transmitted + once[1]
    norm = scale[:, None] * scale[None, :]
    reflection = (reflection - jnp.diag(regular[0])) / norm - once_reflected
    transmission = (transmission - jnp.diag(regular[1])) / norm - once_transmitted
    # One after the other: the product of two shares may be too small for a number.
    reflection = reflection / front[:, None] / front
    transmission = transmission / back[:, None] / front
    if grid.exposed:
        # Near grazing, doubly scattered light varies as 1/(mu_o + mu_i): interpolate without that factor.
        cosine = propagating_cosine(grid.squared_cosine(grid.block_index[0]))
        reflection = reflection * (cosine[:, None] + cosine[None, :])
    return StackResponse(
        reflection=reflection,
        transmission=transmission,
        reflected_power=reflected_power,
        transmitted_power=transmitted_power,
        backing_gain=whole.backing_gain,
        returned_power=whole.returned_power,
        transmitted_from_back=transmitted_from_back,
        reflectance_from_back=whole.reflectance_from_back,
    )
