"""Light that instruments collect from a stack over hemispheres and in single directions, of one solution."""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from jaxink.numerics.precision import require_float64
from jaxink.numerics.validity import is_known
from jaxink.optics import Directions
from jaxink.solver.bsdf import bsdf_of_response, kappa_of, power_of_response, raised_to_zero
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.solve import StackResponse, solve_channels
from jaxink.solver.stack import Stack
from jaxink.solver.stack_channels import StackChannels, put_on_channels


class CollectedLight(NamedTuple):
    """What a stack sends into hemispheres and directions.

    Parameters
    ----------
    bsdf
        Diffuse BSDF of the pairs of directions, 1/sr.
    reflectance, transmittance
        Directional-hemispherical, regular light included, as in `hemispherical_power`.
    seen_through
        Radiance behind, regular light included, over that of uniformly diffuse light in front.
    front, front_alone, back
        Reflectance for uniformly diffuse light: of the front with the backing and without it, and of the
        back without it.
    """

    bsdf: Float[Array, " points"]
    reflectance: Float[Array, " incidences"]
    transmittance: Float[Array, " incidences"]
    seen_through: Float[Array, " views"]
    front: Float[Array, ""]
    front_alone: Float[Array, ""]
    back: Float[Array, ""]


def collected_light(
    stack: Stack,
    directions: Directions,
    sin_incidence: Float[ArrayLike, " incidences"],
    sin_view: Float[ArrayLike, " views"],
    config: SolverConfig,
    plan: ChannelPlan,
) -> CollectedLight:
    """Light collected in any number of geometries, of one solution of a stack.

    Parameters
    ----------
    stack
        Layers between two half spaces. A lateral field is ignored: all light counts, wherever it leaves.
    directions
        Pairs of directions for the BSDF.
    sin_incidence
        Sines of the angles of incidence in front, of light whose hemispherical totals are collected.
    sin_view
        Sines of the angles behind at which the light of a uniformly diffuse source in front is seen.
    config, plan
        See `diffuse_bsdf`; the plan is that of a stack with a backing.

    References
    ----------
    Helmholtz reciprocity: basic radiance L / n^2 is the same both ways, so that what is seen behind of
    uniformly diffuse light is (n_back / n_front)^2 times what the stack transmits from there to the front.
    """
    require_float64()
    collect = _compiled_light if is_known((stack, sin_incidence, sin_view, plan)) else _collected_light
    return collect(stack, directions, sin_incidence, sin_view, config, plan)


def _collected_light(stack, directions, sin_incidence, sin_view, config, plan) -> CollectedLight:
    # From a backing follows what is reflected to the back, even if it reflects nothing.
    backing = jnp.zeros(()) if stack.backing is None else stack.backing
    stack = dataclasses.replace(stack, backing=backing, lateral=None)
    pairs = jnp.concatenate(kappa_of(stack, directions))
    kappa_in, kappa_view = stack.index_front * sin_incidence, stack.index_back * sin_view
    channels = put_on_channels(stack, plan, config, jnp.concatenate([pairs, kappa_in, kappa_view]))
    response = solve_channels(stack, channels)
    ends = pairs.shape[0], pairs.shape[0] + kappa_in.shape[0]
    at_pairs, incident, viewed = (
        channels.at_directions(part) for part in (slice(ends[0]), slice(*ends), slice(ends[1], None))
    )
    powers = power_of_response(incident, response, kappa_in)
    rows = channels.grid.interpolation(kappa_view) * viewed.escape_beyond[1][:, None]
    turned = viewed.fields_beyond.transmission + rows @ response.transmitted_from_back
    reflectance, transmittance, turned = map(raised_to_zero, (*powers, turned))
    return CollectedLight(
        bsdf_of_response(stack, at_pairs, response, directions, config),
        reflectance,
        transmittance,
        (stack.index_back / stack.index_front) ** 2 * turned,
        *_diffuse_reflectances(stack, channels, response),
    )


_compiled_light = eqx.filter_jit(_collected_light)


def _diffuse_reflectances(stack: Stack, channels: StackChannels, response: StackResponse):
    """The last three of `CollectedLight`."""
    to_front, fields = channels.escape[0], channels.fields
    reflected = fields.reflection + to_front * response.reflected_power
    transmitted = fields.transmission + to_front * response.transmitted_power
    # Of etendue n^2 / 2; what no channel carries is totally reflected.
    in_front = channels.grid.squared_cosine(stack.index_front) > 0
    share = jnp.where(in_front, channels.grid.etendue_weight, 0.0) * 2 / stack.index_front**2
    alone = 1 - share @ (1 - reflected)
    returned = share @ transmitted * response.backing_gain * response.returned_power
    return alone + returned, alone, jnp.asarray(response.reflectance_from_back)
