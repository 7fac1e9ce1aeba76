"""Solve a stack: regular light, single scattering and multiple scattering.

Three parts are kept apart to the very end. Regular light (undeviated or specular) is a number for each
channel. Light scattered once, in a layer or by one facet of a rough interface, with any number of regular
reflections before and after, is known exactly at any pair of directions. The rest is smooth: it is solved on
the channels and interpolated.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.numerics.legendre import associated_legendre
from jaxink.numerics.linear_algebra import transpose
from jaxink.optics.channels import ChannelGrid
from jaxink.optics.fresnel import fresnel_reflectance, propagating_cosine
from jaxink.optics.layers import ScatteringLayer, TruncatedOptics, delta_m
from jaxink.solver.lateral import bessel_j0
from jaxink.solver.layer_response import doubled_response, layer_method, layer_response
from jaxink.solver.specular import RegularFields, attenuation, regular_fields
from jaxink.solver.stack import SolverConfig, Stack
from jaxink.solver.star_product import (
    Below,
    FromBehind,
    Pile,
    RoughElement,
)
from jaxink.surfaces.facets import mean_transmittance
from jaxink.surfaces.interface import RoughInterface, rough_interface
from jaxink.surfaces.wave_face import WaveFace, wave_interface


def _passages(stack: Stack, fields: RegularFields, squared_cosine):
    """Share of light that finds its way between what scatters first and the front, and last and the back.

    Scattered light leaves in proportion to it. It has poles close to grazing, of light that thin layers
    reflect to and fro many times, and is hard to interpolate at a rough face, too.
    """
    first, last = stack.scattering[0], stack.scattering[-1]
    front = fields.down_from_front[first] + fields.up_from_front[last]
    back = fields.down_from_back[first] + fields.up_from_back[last]
    if stack.rough and stack.rough[0] <= first:
        k = stack.rough[0]
        front = fields.arriving_from_front[k] * _facets_pass(stack, k, squared_cosine, k, k + 1)
    if stack.rough and stack.rough[-1] > last:
        k = stack.rough[-1]
        back = fields.arriving_from_back[k] * _facets_pass(stack, k, squared_cosine, k + 1, k)
    return tuple(jnp.where(share > 1e-200, share, 1.0) for share in (front, back))


def _facets_pass(stack: Stack, interface, squared_cosine, here, there):
    """Share of light that crosses a rough interface, about."""
    cosine = propagating_cosine(squared_cosine[here])
    sine = jnp.sqrt(jnp.maximum(1 - cosine**2, 1e-12))
    indices = stack.indices[here], stack.indices[there]
    face = stack.faces[interface]
    if isinstance(face, WaveFace):
        beyond = propagating_cosine(squared_cosine[there])
        return 1 - fresnel_reflectance(*indices, cosine, beyond)
    return mean_transmittance(cosine, sine, *indices, face)


@jax.jit
def single_scattering_kernels(cosine_out, cosine_in, optical_thickness):
    """Depth integrals of light scattered once in a layer.

    Parameters
    ----------
    cosine_out, cosine_in
        Cosines inside the layer, broadcast together; 0 gives 0.
    optical_thickness
        Of the layer.

    Returns
    -------
    reflected, transmitted
        Per unit albedo and unit phase function, times 4 pi: the layer's BRDF and BTDF.
    """
    inside = (cosine_out > 0) & (cosine_in > 0)
    out, into = jnp.where(inside, cosine_out, 1.0), jnp.where(inside, cosine_in, 1.0)
    a, b = 1 / out, 1 / into
    reflected = -jnp.expm1(-optical_thickness * (a + b)) / (out + into)
    difference = jnp.abs(a - b) * optical_thickness
    near = difference < 1e-6
    ratio = jnp.where(near, 1 - difference / 2, -jnp.expm1(-difference) / jnp.where(near, 1.0, difference))
    slow = optical_thickness * jnp.minimum(a, b)
    transmitted = a * b * optical_thickness * jnp.exp(-slow) * ratio
    return jnp.where(inside, reflected, 0.0), jnp.where(inside, transmitted, 0.0)


def _layer_matrices(truncated: TruncatedOptics, cosine, weight, table):
    """A and B of `layer_response` for all azimuthal orders, and the phase matrices of both parities.

    ``weight`` is the layer's own quadrature weight w of each channel; ``table`` holds the associated
    Legendre functions, shape ``(orders, moments, channels)``.
    """
    n_orders, n_moments, _ = table.shape
    inside = cosine > 0
    safe_cosine = jnp.where(inside, cosine, 1.0)
    scale = jnp.where(inside, jnp.sqrt(jnp.where(inside, weight, 1.0) / safe_cosine), 0.0)
    factors = (2 * jnp.arange(n_moments) + 1) * truncated.phase_moments
    parity = (jnp.arange(n_orders)[:, None] + jnp.arange(n_moments)[None, :]) % 2
    even_table = jnp.where(parity[..., None] == 0, table, 0.0)
    odd_table = jnp.where(parity[..., None] == 1, table, 0.0)
    even = jnp.einsum("mli,l,mlj->mij", even_table, factors, even_table)
    odd = jnp.einsum("mli,l,mlj->mij", odd_table, factors, odd_table)
    # The quadrature does not integrate the phase function exactly. What is missing is made up by a smooth
    # symmetric term, so that a layer without absorption conserves energy to rounding.
    solid = jnp.where(inside, weight, 0.0)
    missing = 1 - even[0] @ solid
    whole = jnp.sum(solid)
    made_up = (missing[:, None] + missing - solid @ missing / whole) / whole
    scaled_even = scale[:, None] * even.at[0].add(made_up) * scale[None, :]
    scaled_odd = scale[:, None] * odd * scale[None, :]
    albedo = truncated.single_scattering_albedo
    diagonal = jnp.diag(1 / safe_cosine)
    return diagonal - albedo * scaled_odd, diagonal - albedo * scaled_even, even, odd


class StackResponse(eqx.Module):
    """Multiple scattering of a stack between its channels, without regular and once-scattered light.

    Parameters
    ----------
    grid
        The channels.
    reflection, transmission
        Basic radiance per irradiance for each azimuthal order (factor 1/(2 pi) and the cosine series left
        out) over the `_passages` of either direction, shape ``(orders, channels, channels)``,
        incident channel last; meaningful for channels that reach the surroundings only.
    reflected_power, transmitted_power
        Share of the light of each incident channel that leaves not regularly, over its passage from the
        front, shape ``(channels,)``. The peak that delta-M takes as undeviated counts as regular.
    truncated
        Truncated optics of each layer, None for clear ones.
    fields
        Regular light at the further directions that were asked for.
    passage_front, passage_back
        `_passages` of these directions.
    backing_gain
        Diffuse light that a backing sends towards the stack, all its reflections to and fro summed, over the
        light that first comes to it; 0 without one.
    returned_power
        Share of that light which leaves in front.
    lobe_factors
        By position of a rough interface, `RoughInterface.lobe_factors`.
    """

    grid: ChannelGrid
    reflection: Float[Array, "orders channels channels"]
    transmission: Float[Array, "orders channels channels"]
    reflected_power: Float[Array, " channels"]
    transmitted_power: Float[Array, " channels"]
    truncated: tuple
    fields: RegularFields
    passage_front: Float[Array, " directions"]
    passage_back: Float[Array, " directions"]
    backing_gain: Float[Array, ""] | float
    returned_power: Float[Array, ""] | float
    lobe_factors: dict


def solve_stack(
    stack: Stack,
    config: SolverConfig,
    kappa: Float[Array, " directions"],
    frequency: Float[Array, ""] | None = None,
) -> StackResponse:
    """Solve the multiple scattering of a stack for every pair of channels.

    Parameters
    ----------
    stack
        The stack.
    config
        Sizes of the discretisation.
    kappa
        Further directions, n sin(theta), at which the regular light is wanted.
    frequency
        Lateral frequency in 1/mm at which the multiply scattered light is wanted, without the first way in
        and the last way out; None: its sum over all places.

    Returns
    -------
    StackResponse
        Serves any number of incidences and directions.
    """
    grid = stack.grid(config)
    truncated = tuple(
        delta_m(layer, config.n_moments) if isinstance(layer, ScatteringLayer) else None
        for layer in stack.layers
    )
    thickness = [
        layer.optical_thickness if optics is None else optics.optical_thickness
        for layer, optics in zip(stack.layers, truncated, strict=True)
    ]
    etendue = grid.etendue_weight
    n_channels = etendue.shape[0]
    indices = jnp.stack(stack.indices)
    column = indices[:, None]
    # Channels and further directions in one pass: fewer operations to trace and to compile.
    squared = jnp.concatenate([grid.squared_cosine(column), 1 - (kappa / column) ** 2], axis=1)
    kept = stack.kept_regular(squared)
    everywhere = regular_fields(indices, squared, jnp.stack(thickness), kept)
    fields = jax.tree.map(lambda x: x[..., :n_channels], everywhere)

    # A block between equal indices has no width, and its channels nothing in them.
    scale = jnp.where(etendue > 0, jnp.sqrt(jnp.where(etendue > 0, etendue, 1.0)), 1.0)
    known = {k: _interface(stack, k, grid, config) for k in stack.rough}
    rough = {k: _rough_element(stack, k, grid, scale, interface) for k, interface in known.items()}

    # From the back to the front; elements that are diagonal in the channels are joined first.
    diffuse = None
    if stack.backing is not None:
        behind = jnp.where(grid.squared_cosine(stack.index_back) > 0, jnp.sqrt(etendue), 0.0)
        diffuse = FromBehind(behind, 0.0)
    pile, ways = Pile(Below(None, None, True, diffuse)), [0.0] * len(stack.layers)
    if frequency is not None:
        pile = pile._replace(damping=lambda way: bessel_j0(frequency * way))
        ways = stack.lateral.displacements(fields.cosines)
    respond = _RESPONSES[layer_method(config.layer_method)]
    once_reflected, once_transmitted = 0.0, 0.0
    for k in reversed(range(len(stack.layers) + 1)):
        if k in rough:
            pile = pile.with_rough(rough[k])
        else:
            r = fields.interfaces[k]
            pile = pile.with_diagonal((r, r, 1 - r))
        if k == 0:
            break
        layer, optics, cosine = stack.layers[k - 1], truncated[k - 1], fields.cosines[k - 1]
        if optics is None:
            inside = attenuation(layer.optical_thickness, cosine)
            pile = pile.with_diagonal((0.0, 0.0, inside), ways[k - 1])
        else:
            n2 = layer.refractive_index**2
            safe_cosine = jnp.where(cosine > 0, cosine, 1.0)
            table = associated_legendre(config.n_moments, config.n_orders, cosine)
            a_matrix, b_matrix, even, odd = _layer_matrices(
                optics, cosine, etendue / (n2 * safe_cosine), table
            )
            response = respond(a_matrix, b_matrix, thickness[k - 1] / 2)
            pile = pile.with_layer(*response, attenuation(optics.optical_thickness, cosine))
            once = _once_on_channels(optics, n2, fields, k - 1, (even + odd, even - odd))
            once_reflected = once_reflected + once[0]
            once_transmitted = once_transmitted + once[1]
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

    passages = _passages(stack, everywhere, squared)
    front, back = (passage[:n_channels] for passage in passages)
    reflected_power = (scale @ reflection[0] / scale - regular[0]) / front
    transmitted_power = (scale @ transmission[0] / scale - regular[1]) / front
    norm = scale[:, None] * scale[None, :]
    for k, element in rough.items():
        met = _met_on_channels(element, fields, k)
        reflection, transmission = reflection - met[0], transmission - met[1]
    reflection = (reflection - jnp.diag(regular[0])) / norm - once_reflected
    transmission = (transmission - jnp.diag(regular[1])) / norm - once_transmitted
    reflection = reflection / (front[:, None] * front)
    transmission = transmission / (back[:, None] * front)
    if stack.exposed:
        # Near grazing the light scattered twice still varies as 1/(mu_o + mu_i): interpolate without it.
        cosine = propagating_cosine(grid.squared_cosine(grid.block_index[0]))
        reflection = reflection * (cosine[:, None] + cosine[None, :])
    beyond = jax.tree.map(lambda x: x[..., n_channels:], everywhere)
    powers = reflected_power, transmitted_power
    beyond_front, beyond_back = (passage[n_channels:] for passage in passages)
    return StackResponse(
        grid,
        reflection,
        transmission,
        *powers,
        truncated,
        beyond,
        beyond_front,
        beyond_back,
        gain,
        returned,
        {k: interface.lobe_factors for k, interface in known.items()},
    )


def _once_on_channels(optics, n2, fields: RegularFields, k, phase):
    """Light scattered once, for each azimuthal order, between the channels."""
    forward, backward = phase
    cosine = fields.cosines[k]
    reflected, transmitted = single_scattering_kernels(
        cosine[:, None], cosine[None, :], optics.optical_thickness
    )
    back = backward * reflected * optics.single_scattering_albedo / (2 * n2)
    ahead = forward * transmitted * optics.single_scattering_albedo / (2 * n2)
    down, up = fields.down_from_front[k], fields.up_from_front[k]

    def seen(out_up, out_down):
        return out_up[:, None] * (back * down + ahead * up) + out_down[:, None] * (ahead * down + back * up)

    return seen(down, up), seen(fields.down_from_back[k], fields.up_from_back[k])


_RESPONSES = {"discrete_ordinates": layer_response, "adding_doubling": doubled_response}


def _met_on_channels(element: RoughElement, fields: RegularFields, k):
    """Light that meets a rough interface once and is regular else, between the channels."""
    down, up_from_back = fields.arriving_from_front[k], fields.arriving_from_back[k]
    if element.regular is None:
        # No regular light comes from beyond.
        return down[:, None] * element.one_above * down, up_from_back[:, None] * element.one_down * down
    up, down_from_back = fields.returning_from_front[k], fields.returning_from_back[k]
    to_front = element.one_above * down + transpose(element.one_down) * up
    to_back = element.one_down * down + element.one_below * up
    return (
        down[:, None] * to_front + up[:, None] * to_back,
        down_from_back[:, None] * to_front + up_from_back[:, None] * to_back,
    )


def _interface(stack: Stack, k, grid, config) -> RoughInterface:
    """A rough interface between channels."""
    if stack.known and stack.known[k] is not None:
        return stack.known[k]
    outer, inner, face, n_orders, sizes = stack.rough_arguments(k, config)
    if isinstance(face, WaveFace):
        return wave_interface(grid, outer, inner, face, n_orders)
    return rough_interface(grid, outer, inner, face, n_orders, sizes)


def _rough_element(stack: Stack, k, grid, scale, interface: RoughInterface) -> RoughElement:
    """A rough interface in the basis of fluxes, with the side of regular light put where it is."""
    propagates = (grid.squared_cosine(stack.indices[side]) > 0 for side in stack.sides(k))
    interface = interface.of_fluxes(scale, *propagates)
    total, one, regular = interface.total, interface.one, interface.regular
    entering = transpose(total.leaving)
    if stack.outer_is_front(k):
        sides = total.outer_reflection, total.inner_reflection, entering, total.leaving
        once = one.outer_reflection, one.inner_reflection, transpose(one.leaving)
        kept = regular and (regular.outer_reflection, regular.inner_reflection, regular.leaving)
    else:
        sides = total.inner_reflection, total.outer_reflection, total.leaving, entering
        once = one.inner_reflection, one.outer_reflection, one.leaving
        kept = regular and (regular.inner_reflection, regular.outer_reflection, regular.leaving)
    return RoughElement(*sides, *once, kept)
