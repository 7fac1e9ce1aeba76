"""BSDF of a stack, and its regular and hemispherical reflectance and transmittance."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.special import gammaln

from jaxink.errors import InputRefusedError
from jaxink.numerics.precision import require_float64
from jaxink.numerics.validity import is_known, known_float
from jaxink.optics import Directions, propagating_cosine
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import ChannelPlan, plan_channels
from jaxink.solver.resolution import choose_sizes
from jaxink.solver.single_scattering import scattered_once
from jaxink.solver.solve import StackResponse, solve_channels, solve_stack
from jaxink.solver.specular import regular_fields
from jaxink.solver.stack import Stack
from jaxink.solver.stack_channels import StackChannels, put_on_channels

# A BSDF is never negative. Values below minus this come from a resolution too coarse for a narrow peak.
# Those above are rounding, near grazing or of no scattering, where the derivative is that of a little light.
_ROUNDING = 1e-6
# Power below 0 or above 1 by more shows that the streams do not resolve an incidence.
_BELOW, _ABOVE = 1e-5, 1e-3
# Of a layer without an index step, lit within 0.04 deg of grazing.
_MOST_STREAMS = 160


def diffuse_bsdf(
    stack: Stack,
    directions: Directions,
    config: SolverConfig | None = None,
    plan: ChannelPlan | None = None,
) -> Float[Array, " points"]:
    """Diffuse BSDF of a stack, without the regular peaks.

    Parameters
    ----------
    stack
        Layers between two half spaces.
    directions
        Points to predict; polar angles are those in the surroundings of the respective side.
    config
        Resolution; by default that of `choose_sizes` for a relative error of 1e-4.
    plan
        Channels of the stack; by default those of `plan_channels` for its refractive indices.

    Returns
    -------
    Float[Array, " points"]
        dL_o / dE_i in 1/sr, without a cosine factor.

    Raises
    ------
    PrecisionError
        If JAX uses 32 bits.
    InputRefusedError
        If the stack is being differentiated or compiled without a config, or one of its refractive indices
        without a plan.

    References
    ----------
    Nakajima, Tanaka 1988 JQSRT 40, 51 (exact single scattering over truncated multiple scattering).
    """
    require_float64()
    plan = plan_channels(stack) if plan is None else plan
    config = choose_sizes(stack, plan=plan) if config is None else config
    # Outside a transformation, with known numbers, the solver is compiled.
    solve = _compiled_bsdf if is_known((stack, plan)) else _diffuse_bsdf
    return solve(stack, directions, config, plan)


def _diffuse_bsdf(stack, directions, config, plan):
    kappa = kappa_of(stack, directions)
    channels = put_on_channels(stack, plan, config, jnp.concatenate(kappa))
    if stack.lateral is None:
        return bsdf_of_response(stack, channels, solve_channels(stack, channels), directions, config)

    def smooth(response):
        return _interpolated(stack, channels, response, directions, config, kappa)

    lateral, way = stack.lateral, _known_way(stack, directions)
    waves = jax.vmap(lambda k: solve_channels(stack, channels, lateral.at(k)))
    responses = waves(lateral.frequencies)
    # Light scattered once takes only the known path.
    once = lateral.seen_directly(*way) * scattered_once(stack, channels, directions, kappa)
    light = jnp.sum(jax.vmap(smooth)(responses).T * lateral.coefficients(*way), axis=1) + once
    return _bsdf_of_light(stack, directions, light)


def kappa_of(stack: Stack, directions: Directions) -> tuple[Array, Array, Array]:
    """Transverse directions n sin(theta) of the incidences, and of the exits at the front and at the back."""
    sines = directions.sin_incidence, directions.sin_outgoing
    return stack.index_front * sines[0], stack.index_front * sines[1], stack.index_back * sines[1]


def bsdf_of_response(
    stack: Stack,
    channels: StackChannels,
    response: StackResponse,
    directions: Directions,
    config: SolverConfig,
) -> Float[Array, " points"]:
    """Diffuse BSDF from a solved stack on its channels, whose further directions are those of `kappa_of`."""
    kappa = kappa_of(stack, directions)
    smooth = _interpolated(stack, channels, response, directions, config, kappa)
    return _bsdf_of_light(stack, directions, smooth + scattered_once(stack, channels, directions, kappa))


def _bsdf_of_light(stack, directions, light):
    index_out = jnp.where(directions.is_transmission, stack.index_back, stack.index_front)
    bsdf = index_out**2 * light
    return jnp.where(bsdf < -_ROUNDING, 0.0, raised_to_zero(bsdf))


def raised_to_zero(value):
    """The value, or 0 if it is negative by rounding, with the derivative of the value."""
    return value + jax.lax.stop_gradient(jnp.maximum(-value, 0.0))


_compiled_bsdf = eqx.filter_jit(_diffuse_bsdf)


def _interpolated(stack, channels, response, directions, config, kappa):
    """Basic radiance per irradiance of the smooth light, interpolated from the channels."""
    transmitted = directions.is_transmission
    grid, everywhere = channels.grid, jnp.concatenate(kappa)
    kappa_in, kappa_front, kappa_back = kappa
    parts = np.cumsum([kappa_in.shape[0], kappa_front.shape[0]])
    rows = grid.interpolation(everywhere)
    from_front, from_back = (jnp.split(rows * share[:, None], parts) for share in channels.escape_beyond)
    # Roughness defines no degree; its orders are chosen for grazing light.
    degree = max(config.n_moments, 4 * config.n_orders if stack.rough else 0)
    shares = jnp.split(_share_of_orders(config.n_orders, degree, everywhere), parts, axis=1)
    into = kappa_in, from_front[0], shares[0]
    to_front, to_back = (kappa_front, from_front[1], shares[1]), (kappa_back, from_back[2], shares[2])
    pairs = [
        _at_pairs(response.reflection, grid.kappa, to_front, into),
        _at_pairs(response.transmission, grid.kappa, to_back, into),
    ]
    # Contiguous rows of pairs and one cosine series for both sides, as these dominate the time.
    way_out = directions.outgoing + jnp.where(transmitted, kappa_front.shape[0], 0)
    series = _cosine_series(config.n_orders, directions.azimuth_rad)
    smooth = jnp.sum(series * jnp.concatenate(pairs, axis=1)[:, way_out, directions.incidence], axis=0)
    if grid.exposed:
        cosines = [jnp.sqrt(1 - (k / grid.block_index[0]) ** 2) for k in (kappa_front, kappa_in)]
        reflected = smooth / (cosines[0][directions.outgoing] + cosines[1][directions.incidence])
        smooth = jnp.where(transmitted, smooth, reflected)
    smooth = smooth / (2 * jnp.pi)
    if stack.backing is None:
        return smooth
    # The total transmittance gives the light that reaches the backing and, by reciprocity, the light from it
    # that is seen. Its regular part is exact, the rest smooth over the escape share.
    regular = jnp.split(channels.fields_beyond.transmission, parts)
    through_in, through_out = (regular[k] + from_front[k] @ response.transmitted_power for k in (0, 1))
    seen = through_out[directions.outgoing] * through_in[directions.incidence]
    sent = response.backing_gain / (jnp.pi * stack.index_back**2)
    return smooth + jnp.where(transmitted, 0.0, sent * seen)


def _at_pairs(kernel, grid_kappa, out, into):
    """Interpolate a kernel of the channels to pairs of directions.

    Order m of the kernel varies as sin^m towards the normal: odd orders are smooth in the cosine only after
    division by one sine. Near the normal, orders that the layers do not send there are suppressed, as their
    interpolation errors are large compared with dim grazing radiance.
    """
    (kappa_out, to_out, share_out), (kappa_in, to_in, share_in) = out, into
    orders = jnp.arange(kernel.shape[0])
    odd = (orders % 2 == 1)[:, None]
    at_nodes = jnp.where(odd, 1 / grid_kappa, 1.0)
    at_out, at_in = jnp.where(odd, kappa_out, 1.0) * share_out, jnp.where(odd, kappa_in, 1.0) * share_in
    smooth = at_nodes[:, :, None] * kernel * at_nodes[:, None, :]
    pairs = jnp.einsum("jo,moi,ki->mjk", to_out, smooth, to_in)
    return at_out[:, :, None] * pairs * at_in[:, None, :]


def _cosine_series(n_orders, azimuth_rad):
    """Factor of each azimuthal order at the points."""
    orders = jnp.arange(n_orders)[:, None]
    return jnp.where(orders == 0, 1.0, 2.0) * jnp.cos(orders * azimuth_rad)


# Orders are suppressed in directions where their relative bound falls below this.
_NEGLIGIBLE = 1e-10


def _share_of_orders(n_orders, degree, kappa):
    """Factor of each azimuthal order: 1 where a phase function of that degree contributes, 0 at the normal.

    Associated Legendre functions behave as Bessel functions, J_m(degree theta), which (x/2)^m / m! bounds.
    """
    orders = np.arange(n_orders)[:, None]
    bound = orders * jnp.log(jnp.maximum(degree / 2 * kappa, 1e-30)) - gammaln(orders + 1)
    # The sine of order 1 is treated separately, and its slope at the normal does not vanish.
    return jnp.where(orders < 2, 1.0, jnp.exp(jnp.minimum(bound - np.log(_NEGLIGIBLE), 0.0)))


def _known_way(stack, directions):
    """Lateral displacement from the detector's axis, along and across, and the cosine of incidence."""
    indices = jnp.stack([layer.refractive_index for layer in stack.layers])[:, None]
    first = min(stack.scattering)
    ends = [*stack.scattering, *(k if k <= first else k - 1 for k in stack.rough)]
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


def regular_power(
    stack: Stack, sin_incidence: Float[ArrayLike, " incidences"]
) -> tuple[Float[Array, " incidences"], Float[Array, " incidences"]]:
    """Regular reflectance (specular) and regular transmittance (undeviated).

    Parameters
    ----------
    stack
        Layers between two half spaces.
    sin_incidence
        Sines of the angles of incidence in front, shape ``(incidences,)``.

    Returns
    -------
    reflectance, transmittance
        Share of the incident power, attenuated by the true optical thickness.
    """
    require_float64()
    sin_incidence = known_float(sin_incidence)
    solve = _compiled_regular if is_known((stack, sin_incidence)) else _regular_power
    return solve(stack, sin_incidence)


def _regular_power(stack, sin_incidence):
    kappa = stack.index_front * sin_incidence
    indices = jnp.stack(stack.indices)
    thickness = jnp.stack([layer.optical_thickness for layer in stack.layers])
    squared = 1 - (kappa / indices[:, None]) ** 2
    fields = regular_fields(indices, squared, thickness, stack.kept_regular(squared))
    return fields.reflection, fields.transmission


_compiled_regular = eqx.filter_jit(_regular_power)


def hemispherical_power(
    stack: Stack,
    sin_incidence: Float[ArrayLike, " incidences"],
    config: SolverConfig | None = None,
    plan: ChannelPlan | None = None,
) -> tuple[Float[Array, " incidences"], Float[Array, " incidences"]]:
    """Directional-hemispherical reflectance and transmittance, regular light included.

    Parameters
    ----------
    stack
        Layers between two half spaces.
    sin_incidence
        Sines of the angles of incidence in front, shape ``(incidences,)``.
    config, plan
        See `diffuse_bsdf`. By default there are more streams for incidence near grazing on a layer without an
        index step.

    Returns
    -------
    reflectance, transmittance
        Shares of the incident power. Without absorption they sum to 1, to rounding at the channels of the
        solver and to its accuracy between them. A backing adds to the reflectance only; the transmittance
        is that without it.

    Raises
    ------
    PrecisionError, InputRefusedError
        See `diffuse_bsdf`; also if the powers are negative or exceed 1, as of an unresolved incidence.
    """
    require_float64()
    plan = plan_channels(stack) if plan is None else plan
    config = _power_sizes(stack, sin_incidence, plan) if config is None else config
    if is_known((stack, sin_incidence, plan)):
        powers = _compiled_power(stack, sin_incidence, config, plan)
        _require_shares(stack, sin_incidence, np.asarray(powers), config)
    else:
        powers = _hemispherical_power(stack, sin_incidence, config, plan)
    reflectance, transmittance = map(raised_to_zero, powers)
    return reflectance, transmittance


def _power_sizes(stack, sin_incidence, plan) -> SolverConfig:
    """Sizes of `choose_sizes`, and the streams that an exposed layer needs near grazing."""
    config = choose_sizes(stack, plan=plan)
    if not (plan.exposed and is_known(sin_incidence)):
        return config
    # The radiance varies over cosines of that size; the most grazing of n streams has 1.45 / n^2.
    cosine = np.sqrt(np.maximum(1 - np.asarray(sin_incidence, float) ** 2, 0.0))
    streams = 4 / np.sqrt(np.maximum(np.min(cosine, initial=1.0), 1e-9))
    streams = 2 * int(np.ceil(min(streams, _MOST_STREAMS) / 2))
    return dataclasses.replace(config, nodes_escaping=max(config.nodes_escaping, streams))


def _require_shares(stack, sin_incidence, powers, config) -> None:
    """Reject powers that are negative or exceed the incident one."""
    reflectance, transmittance = powers
    total = reflectance + (transmittance if stack.backing is None else 0.0)
    wrong = (np.minimum(reflectance, transmittance) < -_BELOW) | (total > 1 + _ABOVE)
    wrong |= ~np.isfinite(total)
    if np.any(wrong):
        k = int(np.argmax(wrong))
        angle = np.rad2deg(np.arcsin(np.clip(np.asarray(sin_incidence)[k], 0, 1)))
        raise InputRefusedError(
            f"{config.nodes_escaping} streams do not resolve light incident at {angle:.6g} deg: they give a "
            f"reflectance of {reflectance[k]:.6g} and a transmittance of {transmittance[k]:.6g}. "
            "Give smaller angles of incidence, or a config with more nodes_escaping."
        )


def _hemispherical_power(stack, sin_incidence, config, plan):
    kappa = stack.index_front * sin_incidence
    return power_of_response(*solve_stack(stack, plan, config, kappa), kappa)


def power_of_response(
    channels: StackChannels, response: StackResponse, kappa: Float[Array, " incidences"]
) -> tuple[Float[Array, " incidences"], Float[Array, " incidences"]]:
    """Hemispherical reflectance and transmittance from a solved stack on its channels.

    Parameters
    ----------
    channels, response
        See `solve_stack`.
    kappa
        n sin(theta) of the incidences, the further directions of the channels.
    """
    fields = channels.fields_beyond
    rows = channels.grid.interpolation(kappa) * channels.escape_beyond[0][:, None]
    reflectance = fields.reflection + rows @ response.reflected_power
    transmittance = fields.transmission + rows @ response.transmitted_power
    returned = response.backing_gain * response.returned_power
    return reflectance + transmittance * returned, transmittance


_compiled_power = eqx.filter_jit(_hemispherical_power)
