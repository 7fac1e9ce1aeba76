"""BSDF of a stack at given directions, and its regular reflectance and transmittance."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.special import gammaln

from jaxink.numerics.precision import require_float64
from jaxink.numerics.validity import is_known
from jaxink.optics.directions import Directions, scattering_cosines
from jaxink.optics.fresnel import propagating_cosine
from jaxink.optics.layers import ScatteringLayer
from jaxink.solver.resolution import choose_sizes
from jaxink.solver.solve import single_scattering_kernels, solve_stack
from jaxink.solver.specular import regular_fields
from jaxink.solver.stack import SolverConfig, Stack
from jaxink.surfaces.facets import FacetRule, projected_area
from jaxink.surfaces.lobes import reflected_lobe, transmitted_lobe
from jaxink.surfaces.wave_face import WaveFace, broadened_for, wave_lobes

# A BSDF is never negative. Less than this is the fault of a discretisation too coarse for a narrow peak;
# what lies above is rounding, as at thickness 0, where the slope is that of what a thin layer scatters.
_ROUNDING = 1e-12


def diffuse_bsdf(
    stack: Stack, directions: Directions, config: SolverConfig | None = None
) -> Float[Array, " points"]:
    """Diffuse BSDF of a stack, without the regular peaks.

    Parameters
    ----------
    stack
        Layers between two half spaces.
    directions
        Points to predict; polar angles in the surroundings of the side concerned.
    config
        Sizes of the discretisation; None: `choose_sizes` for a relative error of 1e-4.

    Returns
    -------
    Float[Array, " points"]
        dL_o / dE_i in 1/sr, cosine not included, shape ``(points,)``.

    Raises
    ------
    PrecisionError
        While JAX is in 32 bits.
    InputRefusedError
        Without a config, while the stack is being differentiated or compiled.

    References
    ----------
    Nakajima, Tanaka 1988 JQSRT 40, 51 (exact single scattering over truncated multiple scattering).
    """
    require_float64()
    config = choose_sizes(stack) if config is None else config
    # Called with numbers, outside a transformation, it compiles itself.
    solve = _compiled_bsdf if is_known(stack) else _diffuse_bsdf
    return solve(stack, directions, config)


def _diffuse_bsdf(stack, directions, config):
    if stack.lateral is None:
        smooth, once = _smooth_and_once(stack, directions, config)
    else:
        smooth, once = _seen_in_the_field(stack, directions, config)
    index_out = jnp.where(directions.is_transmission, stack.index_back, stack.index_front)
    bsdf = index_out**2 * (smooth + once)
    return jnp.where(bsdf < -_ROUNDING, 0.0, bsdf + jax.lax.stop_gradient(jnp.maximum(-bsdf, 0.0)))


def _seen_in_the_field(stack, directions, config):
    """The same two parts, of light that comes out where the detector sees it."""
    lateral = stack.lateral

    def smooth_at(frequency):
        return _smooth_and_once(stack, directions, config, frequency)[0]

    way = _known_way(stack, directions)
    smooth = jnp.sum(jax.vmap(smooth_at)(lateral.frequencies).T * lateral.coefficients(*way), axis=1)
    # Light scattered once goes the known way only.
    _, once = _smooth_and_once(stack, directions, config)
    return smooth, lateral.seen_directly(*way) * once


def _known_way(stack, directions):
    """Way sideways in and out, from the axis of the detector on its side, and cosine of incidence."""
    indices = jnp.stack([layer.refractive_index for layer in stack.layers])[:, None]
    ends = [*stack.scattering, *(k if k <= stack.scattering[0] else k - 1 for k in stack.rough)]
    before, after = np.arange(len(stack.layers)) < min(ends), np.arange(len(stack.layers)) > max(ends)

    def ways(kappa):
        way = stack.lateral.displacements(propagating_cosine(1 - (kappa / indices) ** 2))
        return before @ way, after @ way

    side = directions.is_transmission
    kappa_in = stack.index_front * directions.sin_incidence[directions.incidence]
    index_out = jnp.where(side, stack.index_back, stack.index_front)
    kappa_out = index_out * directions.sin_outgoing[directions.outgoing]
    (front_in, back_in), (front_out, back_out) = ways(kappa_in), ways(kappa_out)
    way_in, way_out = jnp.where(side, -back_in, front_in), jnp.where(side, back_out, front_out)
    along = way_in + way_out * jnp.cos(directions.azimuth_rad)
    cosine = jnp.sqrt(1 - directions.sin_incidence[directions.incidence] ** 2)
    return along, way_out * jnp.sin(directions.azimuth_rad), cosine


def _smooth_and_once(stack, directions, config, frequency=None):
    """Basic radiance per irradiance: what is interpolated, and what is known exactly."""
    transmitted = directions.is_transmission
    kappa_in = stack.index_front * directions.sin_incidence
    kappa_front = stack.index_front * directions.sin_outgoing
    kappa_back = stack.index_back * directions.sin_outgoing
    kappa = jnp.concatenate([kappa_in, kappa_front, kappa_back])
    response = solve_stack(stack, config, kappa, frequency)

    parts = [kappa_in.shape[0], kappa_in.shape[0] + kappa_front.shape[0]]
    rows = response.grid.interpolation(kappa)
    from_front = jnp.split(rows * response.passage_front[:, None], parts)
    from_back = jnp.split(rows * response.passage_back[:, None], parts)
    grid_kappa = response.grid.kappa
    # Roughness has no degree of its own; its orders are chosen for light at grazing angles.
    degree = max(config.n_moments, 4 * config.n_orders if stack.rough else 0)
    shares = jnp.split(_share_of_orders(config.n_orders, degree, kappa), parts, axis=1)
    into = kappa_in, from_front[0], shares[0]
    to_front, to_back = (kappa_front, from_front[1], shares[1]), (kappa_back, from_back[2], shares[2])
    reflected = _at_points(response.reflection, grid_kappa, to_front, into, directions)
    through = _at_points(response.transmission, grid_kappa, to_back, into, directions)
    if stack.exposed:
        sums = [
            jnp.sqrt(1 - (kappa / response.grid.block_index[0]) ** 2) for kappa in (kappa_front, kappa_in)
        ]
        reflected = reflected / (sums[0][directions.outgoing] + sums[1][directions.incidence])
    rest = jnp.where(transmitted, through, reflected) / (2 * jnp.pi)

    fields_in = jax.tree.map(lambda x: x[..., directions.incidence], response.fields)
    to_outgoing = directions.outgoing + jnp.where(transmitted, parts[1], parts[0])
    fields_out = jax.tree.map(lambda x: x[..., to_outgoing], response.fields)
    once = jnp.zeros(())
    for k, (layer, optics) in enumerate(zip(stack.layers, response.truncated, strict=True)):
        if isinstance(layer, ScatteringLayer):
            once = once + _scattered_once(k, layer, optics, fields_in, fields_out, directions)
    for k in stack.rough:
        if isinstance(stack.faces[k], WaveFace):
            factors = rows @ jnp.stack(response.lobe_factors[k], axis=1)
            once = once + _met_waves(stack, k, kappa, factors, to_outgoing, fields_in, fields_out, directions)
        else:
            once = once + _met_one_facet(stack, k, kappa, to_outgoing, fields_in, fields_out, directions)
    if stack.backing is not None:
        # Light that comes to the backing, and by reciprocity light from it that is seen, is what the stack
        # transmits in all: regular light is exact, the rest smooth over its passage.
        through_out, through_in = (
            jnp.split(response.fields.transmission, parts)[k] + rows @ response.transmitted_power
            for k, rows in ((1, from_front[1]), (0, from_front[0]))
        )
        seen = through_out[directions.outgoing] * through_in[directions.incidence]
        sent = response.backing_gain / (jnp.pi * stack.index_back**2)
        rest = rest + jnp.where(transmitted, 0.0, sent * seen)
    return rest, once


_compiled_bsdf = eqx.filter_jit(_diffuse_bsdf)


def _at_points(kernel, grid_kappa, out, into, directions):
    """Interpolate a kernel of the channels to the points and sum its cosine series in azimuth.

    Order m of the kernel varies as sin^m towards the normal, so that odd orders are smooth in the cosine
    only after one sine has been divided out. Orders that the layers do not send towards the normal are kept
    from it: what interpolation leaves of them there is large beside dim grazing radiance.
    """
    (kappa_out, to_out, share_out), (kappa_in, to_in, share_in) = out, into
    orders = jnp.arange(kernel.shape[0])
    odd = (orders % 2 == 1)[:, None]
    at_nodes = jnp.where(odd, 1 / grid_kappa, 1.0)
    at_out, at_in = jnp.where(odd, kappa_out, 1.0) * share_out, jnp.where(odd, kappa_in, 1.0) * share_in
    smooth = at_nodes[:, :, None] * kernel * at_nodes[:, None, :]
    pairs = jnp.einsum("jo,moi,ki->mjk", to_out, smooth, to_in)
    pairs = at_out[:, :, None] * pairs * at_in[:, None, :]
    series = jnp.where(orders == 0, 1.0, 2.0)[:, None] * jnp.cos(orders[:, None] * directions.azimuth_rad)
    return jnp.sum(series * pairs[:, directions.outgoing, directions.incidence], axis=0)


# An order is left out where its bound, relative to what it is elsewhere, falls below this.
_NEGLIGIBLE = 1e-10


def _share_of_orders(n_orders, degree, kappa):
    """Factor of each azimuthal order: 1 where a phase function of that degree reaches, 0 at the normal.

    Associated Legendre functions behave as Bessel functions, J_m(degree theta), which (x/2)^m / m! bounds.
    """
    orders = np.arange(n_orders)[:, None]
    bound = orders * jnp.log(jnp.maximum(degree / 2 * kappa, 1e-30)) - gammaln(orders + 1)
    # Order 1 has its sine apart, and a slope at the normal.
    return jnp.where(orders < 2, 1.0, jnp.exp(jnp.minimum(bound - np.log(_NEGLIGIBLE), 0.0)))


def _scattered_once(k, layer, optics, fields_in, fields_out, directions):
    """Basic radiance per irradiance of light scattered once in layer ``k``, exact phase function."""
    cosine_in = fields_in.cosines[k]
    cosine_out = fields_out.cosines[k]
    ahead_cosine, back_cosine = scattering_cosines(cosine_out, cosine_in, directions.azimuth_rad)
    reflected, transmitted = single_scattering_kernels(cosine_out, cosine_in, optics.optical_thickness)
    # Albedo over the truncated extinction, but with the whole phase function.
    albedo = layer.single_scattering_albedo / (1 - layer.single_scattering_albedo * optics.forward_fraction)
    strength = albedo / (4 * jnp.pi * layer.refractive_index**2)
    ahead = strength * layer.phase_function.value(ahead_cosine) * transmitted
    back = strength * layer.phase_function.value(back_cosine) * reflected
    down = fields_in.down_from_front[k]
    up = fields_in.up_from_front[k]
    side = directions.is_transmission
    out_up = jnp.where(side, fields_out.down_from_back[k], fields_out.down_from_front[k])
    out_down = jnp.where(side, fields_out.up_from_back[k], fields_out.up_from_front[k])
    return out_up * (back * down + ahead * up) + out_down * (ahead * down + back * up)


def _met_one_facet(stack, k, kappa, to_outgoing, fields_in, fields_out, directions):
    """Basic radiance per irradiance of light that met one facet of interface ``k`` and is regular else."""
    density, front, back = stack.faces[k], stack.indices[k], stack.indices[k + 1]

    def cosines_and_areas(index):
        cosine = propagating_cosine(1 - (kappa / index) ** 2)
        safe = jnp.where(cosine > 0, cosine, 1.0)
        sine = jnp.sqrt(jnp.maximum(1 - safe**2, 1e-12))
        return safe, jnp.where(cosine > 0, 1 / projected_area(safe, sine, density, FacetRule()), 0.0)

    cosine_front, per_area_front = cosines_and_areas(front)
    cosine_back, per_area_back = cosines_and_areas(back)
    side, azimuth = directions.is_transmission, directions.azimuth_rad
    into, out = directions.incidence, to_outgoing
    reflected = reflected_lobe((front, back), cosine_front[out], cosine_front[into], azimuth, density)
    through = transmitted_lobe((front, back), cosine_back[out], cosine_front[into], azimuth, density)
    reflected = reflected * per_area_front[out] * fields_out.arriving_from_front[k] / front**2
    through = through * per_area_back[out] * fields_out.arriving_from_back[k]
    return jnp.where(side, through, reflected) * per_area_front[into] * fields_in.arriving_from_front[k]


def _met_waves(stack, k, kappa, factors, to_outgoing, fields_in, fields_out, directions):
    """The same for an interface by wave optics, which also leaves regular light on its other side."""
    face, indices = stack.faces[k], stack.indices[k : k + 2]
    table = broadened_for(face, *indices)
    into, out = directions.incidence, to_outgoing
    cosines = [propagating_cosine(1 - (kappa / index) ** 2) for index in indices]
    safe = [jnp.where(cosine > 0, cosine, 1e-9) for cosine in cosines]
    outer_is_front = stack.outer_is_front(k)
    # The factor of a direction on the front and on the back side.
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


def regular_power(
    stack: Stack, sin_incidence: Float[ArrayLike, " incidences"]
) -> tuple[Float[Array, " incidences"], Float[Array, " incidences"]]:
    """Regular (specular) reflectance and regular (undeviated) transmittance.

    Parameters
    ----------
    stack
        Layers between two half spaces.
    sin_incidence
        Sines of the incidences in front, shape ``(incidences,)``.

    Returns
    -------
    reflectance, transmittance
        Share of the incident power, attenuated by the true optical thickness.
    """
    require_float64()
    kappa = stack.index_front * sin_incidence
    indices = jnp.stack(stack.indices)
    thickness = jnp.stack([layer.optical_thickness for layer in stack.layers])
    squared = 1 - (kappa / indices[:, None]) ** 2
    fields = regular_fields(indices, squared, thickness, stack.kept_regular(squared))
    return fields.reflection, fields.transmission


def hemispherical_power(
    stack: Stack, sin_incidence: Float[ArrayLike, " incidences"], config: SolverConfig | None = None
) -> tuple[Float[Array, " incidences"], Float[Array, " incidences"]]:
    """Directional-hemispherical reflectance and transmittance, regular light included.

    Parameters
    ----------
    stack
        Layers between two half spaces.
    sin_incidence
        Sines of the incidences in front, shape ``(incidences,)``.
    config
        Sizes of the discretisation, as for `diffuse_bsdf`.

    Returns
    -------
    reflectance, transmittance
        Share of the incident power. Without absorption they sum to 1: to rounding at the channels of the
        solver, to its accuracy between them. A backing adds to the reflectance only: transmitted is what
        comes to the far side without it.

    Raises
    ------
    PrecisionError
        While JAX is in 32 bits.
    """
    require_float64()
    config = choose_sizes(stack) if config is None else config
    solve = _compiled_power if is_known((stack, sin_incidence)) else _hemispherical_power
    return solve(stack, sin_incidence, config)


def _hemispherical_power(stack, sin_incidence, config):
    kappa = stack.index_front * sin_incidence
    response = solve_stack(stack, config, kappa)
    fields = response.fields
    rows = response.grid.interpolation(kappa) * response.passage_front[:, None]
    reflectance = fields.reflection + rows @ response.reflected_power
    transmittance = fields.transmission + rows @ response.transmitted_power
    returned = response.backing_gain * response.returned_power
    return reflectance + transmittance * returned, transmittance


_compiled_power = eqx.filter_jit(_hemispherical_power)
