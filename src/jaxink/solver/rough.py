"""Rough interfaces of a stack between its channels, and light that meets one of them once."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.numerics.linear_algebra import transpose
from jaxink.numerics.own_derivatives import by_own_inputs, differentiable_once
from jaxink.optics import ChannelGrid, fresnel_reflectance, propagating_cosine
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.specular import RegularFields, RegularPaths
from jaxink.solver.stack import Stack
from jaxink.solver.star_product import Diagonal, RoughElement
from jaxink.surfaces import (
    BroadenedSpectrum,
    FacetRule,
    RoughInterface,
    RoughSizes,
    SlopeDensity,
    WaveFace,
    WaveInterface,
    WaveLobes,
    mean_transmittance,
    projected_area,
    reflected_lobe,
    rough_interface,
    transmitted_lobe,
    wave_interface,
    wave_lobes,
)


class FacetsOnChannels(eqx.Module):
    """A rough interface that consists of facets, on the channels of its stack."""

    element: RoughElement
    density: SlopeDensity


class WavesOnChannels(eqx.Module):
    """A rough interface in wave optics, on the channels of its stack."""

    element: RoughElement
    face: WaveFace
    lobes: WaveLobes


def rough_on_channels(
    stack: Stack,
    plan: ChannelPlan,
    config: SolverConfig,
    grid: ChannelGrid,
    scale: Float[Array, " channels"],
) -> dict[int, FacetsOnChannels | WavesOnChannels]:
    """Rough interfaces by position, taken from the plan if they have been computed before.

    ``scale`` is the square root of the etendue weights of the channels, ``grid``, above 0.
    """

    def on_channels(k: int, face: SlopeDensity | WaveFace) -> FacetsOnChannels | WavesOnChannels:
        if isinstance(face, WaveFace):
            waves = _waves_between_channels(stack, k, face, plan, config)
            return WavesOnChannels(_rough_element(stack, k, grid, scale, waves), face, waves.lobes)
        facets = (
            plan.interfaces[k]
            if k in plan.interfaces
            else _facets_between_channels(stack, k, face, plan, config)
        )
        return FacetsOnChannels(_rough_element(stack, k, grid, scale, facets), face)

    return {k: on_channels(k, face) for k, face in stack.rough.items()}


def _waves_between_channels(
    stack: Stack, k: int, face: WaveFace, plan: ChannelPlan, config: SolverConfig
) -> WaveInterface:
    """The interface ``k`` in wave optics."""
    n_outer, sides = plan.n_outer(stack, k, config), stack.sides(k)

    def of(indices, face):
        grid = plan.grid_of(indices, stack.scattering, config)
        return wave_interface(grid, *(indices[side] for side in sides), face, config.n_orders, n_outer)

    # The indices and the face are few of the numbers of a stack, and the most expensive ones. Much depends on
    # one of the two alone.
    return by_own_inputs(of, tuple(stack.indices), face)


def _facets_between_channels(
    stack: Stack, k: int, density: SlopeDensity, plan: ChannelPlan, config: SolverConfig
) -> RoughInterface:
    """The interface ``k`` that consists of facets."""
    sizes, sides = RoughSizes(n_outer=plan.n_outer(stack, k, config)), stack.sides(k)

    def of(both):
        indices, density = both
        grid, (outer, inner) = plan.grid_of(indices, stack.scattering, config), sides
        return rough_interface(grid, (indices[outer], indices[inner]), density, config.n_orders, sizes)

    # Facets whose light begins or ceases to meet a second one as an index changes are steps of the sum.
    indices = differentiable_once(
        tuple(stack.indices),
        f"second derivatives by a refractive index are not available: face {k} of the stack consists of "
        "facets, whose sum is not smooth in an index. Hold the indices fixed.",
    )
    # They and the density are few of the numbers of a stack, and the most expensive ones.
    return by_own_inputs(of, (indices, density))


def _rough_element(
    stack: Stack,
    k: int,
    grid: ChannelGrid,
    scale: Float[Array, " channels"],
    interface: RoughInterface,
) -> RoughElement:
    """The rough interface ``k`` in the basis of fluxes, with its outer side at the front or at the back."""
    propagates = (grid.squared_cosine(stack.indices[side]) > 0 for side in stack.sides(k))
    interface = interface.of_fluxes(scale, *propagates)
    total, one = interface.total, interface.one
    entering = transpose(total.leaving)
    if stack.outer_is_front(k):
        sides = total.outer_reflection, total.inner_reflection, entering, total.leaving
        once = one.outer_reflection, one.inner_reflection, transpose(one.leaving)
    else:
        sides = total.inner_reflection, total.outer_reflection, total.leaving, entering
        once = one.inner_reflection, one.outer_reflection, one.leaving
    return RoughElement(*sides, *once, _regular_seen_from_front(interface, stack.outer_is_front(k)))


def _regular_seen_from_front(interface: RoughInterface, outer_is_front: bool) -> Diagonal | None:
    """Regular light of an interface; None if there is none."""
    if not isinstance(interface, WaveInterface):
        return None
    outer, inner = interface.regular.outer_reflection, interface.regular.inner_reflection
    return (*((outer, inner) if outer_is_front else (inner, outer)), interface.regular.leaving)


def escape_shares(stack: Stack, fields: RegularFields, squared_cosine) -> tuple[Array, Array]:
    """Share of light that passes between the first scatterer and the front, and the last and the back.

    Scattered light leaves in proportion to it. The share is hard to interpolate at rough faces and near
    grazing, where it has poles due to light that thin layers reflect back and forth many times. It is 0 if
    the light is evanescent between them, or exactly grazing.
    """
    first, last = min(stack.scattering), max(stack.scattering)
    front = fields.down_from_front[first] + fields.up_from_front[last]
    back = fields.down_from_back[first] + fields.up_from_back[last]
    faces = stack.rough
    if faces and min(faces) <= first:
        k = min(faces)
        share = _crossing_share(stack, faces[k], squared_cosine, k, k + 1)
        front = fields.arriving_from_front[k] * share
    if faces and max(faces) > last:
        k = max(faces)
        share = _crossing_share(stack, faces[k], squared_cosine, k + 1, k)
        back = fields.arriving_from_back[k] * share
    return front, back


def _crossing_share(stack: Stack, face: SlopeDensity | WaveFace, squared_cosine, here: int, there: int):
    """Approximate share of light that crosses a rough interface."""
    cosine = propagating_cosine(squared_cosine[here])
    sine = jnp.sqrt(jnp.maximum(1 - cosine**2, 1e-12))
    indices = stack.indices[here], stack.indices[there]
    if isinstance(face, WaveFace):
        beyond = propagating_cosine(squared_cosine[there])
        return 1 - fresnel_reflectance(*indices, cosine, beyond)
    return mean_transmittance(cosine, sine, *indices, face)


def met_between_channels(element: RoughElement, fields: RegularFields, k: int) -> tuple[Array, Array]:
    """Reflected and transmitted light that meets the interface ``k`` once and is otherwise regular.

    Between the channels, in the basis of fluxes.
    """
    down, up_from_back = fields.arriving_from_front[k], fields.arriving_from_back[k]
    if element.regular is None:
        # No regular light returns from beyond.
        return down[:, None] * element.one_above * down, up_from_back[:, None] * element.one_down * down
    up, down_from_back = fields.returning_from_front[k], fields.returning_from_back[k]
    to_front = element.one_above * down + transpose(element.one_down) * up
    to_back = element.one_down * down + element.one_below * up
    return (
        down[:, None] * to_front + up[:, None] * to_back,
        down_from_back[:, None] * to_front + up_from_back[:, None] * to_back,
    )


def met_facet(stack: Stack, k: int, density: SlopeDensity, paths: RegularPaths) -> Float[Array, " points"]:
    """Basic radiance per irradiance of otherwise regular light that meets one facet of interface ``k``."""
    directions, kappa, out, fields_in, fields_out = paths
    front, back = stack.indices[k], stack.indices[k + 1]

    def cosines_and_areas(index):
        cosine = propagating_cosine(1 - (kappa / index) ** 2)
        safe = jnp.where(cosine > 0, cosine, 1.0)
        sine = jnp.sqrt(jnp.maximum(1 - safe**2, 1e-12))
        return safe, jnp.where(cosine > 0, 1 / projected_area(safe, sine, density, FacetRule()), 0.0)

    cosine_front, per_area_front = cosines_and_areas(front)
    cosine_back, per_area_back = cosines_and_areas(back)
    side, azimuth = directions.is_transmission, directions.azimuth_rad
    into = directions.incidence
    reflected = reflected_lobe((front, back), cosine_front[out], cosine_front[into], azimuth, density)
    through = transmitted_lobe((front, back), cosine_back[out], cosine_front[into], azimuth, density)
    reflected = reflected * per_area_front[out] * fields_out.arriving_from_front[k] / front**2
    through = through * per_area_back[out] * fields_out.arriving_from_back[k]
    return jnp.where(side, through, reflected) * per_area_front[into] * fields_in.arriving_from_front[k]


def met_waves(
    stack: Stack,
    k: int,
    face: WaveFace,
    paths: RegularPaths,
    factors: Float[Array, "directions 2"],
    table: BroadenedSpectrum,
) -> Float[Array, " points"]:
    """As `met_facet` by wave optics, where regular light also arrives from the other side.

    ``factors`` are the `WaveLobes.factors` of the paths, and ``table`` is their table.
    """
    directions, kappa, out, fields_in, fields_out = paths
    indices = stack.indices[k : k + 2]
    into = directions.incidence
    cosines = [propagating_cosine(1 - (kappa / index) ** 2) for index in indices]
    safe = [jnp.where(cosine > 0, cosine, 1e-9) for cosine in cosines]
    outer_is_front = stack.outer_is_front(k)
    # Factor of a direction at the front and at the back.
    sides = (0, 1) if outer_is_front else (1, 0)
    at_side = [factors[:, side] for side in sides]
    leaving = [safe[side][out] for side in (0, 1)]

    def lobes(side):
        there = 1 - side
        index, ends = (indices[side], indices[there]), (leaving[side], leaving[there])
        back, through = wave_lobes(face, table, index, ends, safe[side][into], directions.azimuth_rad)
        if side == sides[1]:
            back = back * at_side[side][out] * at_side[side][into]
        return back, through * at_side[there][out] * at_side[side][into]

    (front_back, front_through), (back_back, back_through) = lobes(0), lobes(1)
    down, up = fields_in.arriving_from_front[k], fields_in.returning_from_front[k]
    side = directions.is_transmission
    out_front = jnp.where(side, fields_out.returning_from_back[k], fields_out.arriving_from_front[k])
    out_back = jnp.where(side, fields_out.arriving_from_back[k], fields_out.returning_from_front[k])
    to_front = front_back * down + back_through * up
    to_back = front_through * down + back_back * up
    return out_front * to_front + out_back * to_back
