"""Exact single scattering: light scattered once, and regular before and after."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxink.optics import Directions, ScatteringLayer, TruncatedOptics, scattering_cosines
from jaxink.solver.phase_matrices import PhaseMatrices
from jaxink.solver.rough import WavesOnChannels, met_facet, met_waves
from jaxink.solver.specular import RegularFields, RegularPaths
from jaxink.solver.stack import Stack
from jaxink.solver.stack_channels import StackChannels

# Below it series are accurate to rounding.
_NEAR = 1e-3


@jax.jit
def single_scattering_kernels(cosine_out, cosine_in, optical_thickness):
    """Depth integrals of single scattering in a layer.

    Parameters
    ----------
    cosine_out, cosine_in
        Cosines inside the layer, broadcast together; the integrals vanish if either is 0.
    optical_thickness
        Optical thickness of the layer.

    Returns
    -------
    reflected, transmitted
        4 pi times the layer's BRDF and BTDF, for unit albedo and unit phase function.
    """
    inside = (cosine_out > 0) & (cosine_in > 0)
    out, into = jnp.where(inside, cosine_out, 1.0), jnp.where(inside, cosine_in, 1.0)
    a, b = 1 / out, 1 / into
    reflected = -jnp.expm1(-optical_thickness * (a + b)) / (out + into)
    transmitted = a * b * mean_of_both(optical_thickness * a, optical_thickness * b) * optical_thickness
    return jnp.where(inside, reflected, 0.0), jnp.where(inside, transmitted, 0.0)


def mean_attenuation(optical_depth):
    """Mean of exp(-t) for t from 0 to an optical depth of 0 or more."""
    near = optical_depth < _NEAR
    safe = jnp.where(near, 1.0, optical_depth)
    series = 1 - optical_depth / 2 * (
        1 - optical_depth / 3 * (1 - optical_depth / 4 * (1 - optical_depth / 5))
    )
    return jnp.where(near, series, -jnp.expm1(-safe) / safe)


def mean_of_both(first, second):
    """Mean of exp(-t) for t between two optical depths, smooth where they are equal."""
    half = (second - first) / 2
    near = jnp.abs(half) < _NEAR
    square = half**2
    series = jnp.exp(-(first + second) / 2) * (1 + square / 6 * (1 + square / 20))
    apart = jnp.where(near, 1.0, 2 * jnp.abs(half))
    return jnp.where(near, series, jnp.exp(-jnp.minimum(first, second)) * mean_attenuation(apart))


def scattered_between_channels(
    layer: ScatteringLayer, optics: TruncatedOptics, phase: PhaseMatrices, fields: RegularFields, k: int
) -> tuple[Float[Array, "orders channels channels"], Float[Array, "orders channels channels"]]:
    """Reflected and transmitted light scattered once in layer ``k``, for each azimuthal order.

    Basic radiance per irradiance, without the factor 1/(2 pi) and the cosine series.
    """
    n2 = layer.refractive_index**2
    cosine = fields.cosines[k]
    reflected, transmitted = single_scattering_kernels(
        cosine[:, None], cosine[None, :], optics.optical_thickness
    )
    back = phase.backward * reflected * optics.single_scattering_albedo / (2 * n2)
    ahead = phase.forward * transmitted * optics.single_scattering_albedo / (2 * n2)
    down, up = fields.down_from_front[k], fields.up_from_front[k]

    def seen(out_up, out_down):
        return out_up[:, None] * (back * down + ahead * up) + out_down[:, None] * (ahead * down + back * up)

    return seen(down, up), seen(fields.down_from_back[k], fields.up_from_back[k])


def scattered_once(
    stack: Stack, channels: StackChannels, directions: Directions, kappa: tuple[Array, Array, Array]
) -> Float[Array, " points"]:
    """Basic radiance per irradiance of light scattered once, in a layer or by a rough interface.

    ``kappa`` holds n sin(theta) of the incidences and of the exits at the front and at the back, the
    directions of ``channels.fields_beyond``.
    """
    n_in, n_front, _ = (part.shape[0] for part in kappa)
    way_out = directions.outgoing + jnp.where(directions.is_transmission, n_in + n_front, n_in)
    fields_in, fields_out = (
        jax.tree.map(lambda x, there=there: x[..., there], channels.fields_beyond)
        for there in (directions.incidence, way_out)
    )
    paths = RegularPaths(directions, jnp.concatenate(kappa), jnp.asarray(way_out), fields_in, fields_out)
    once = jnp.zeros(())
    for k, layer in channels.scattering.items():
        once = once + _scattered_in_layer(layer.layer, layer.truncated, paths, k)
    for k, face in channels.rough.items():
        if isinstance(face, WavesOnChannels):
            factors = channels.grid.interpolation(paths.kappa) @ jnp.stack(face.lobes.factors, axis=1)
            once = once + met_waves(stack, k, face.face, paths, factors, face.lobes.table)
        else:
            once = once + met_facet(stack, k, face.density, paths)
    return once


def _scattered_in_layer(layer: ScatteringLayer, optics: TruncatedOptics, paths: RegularPaths, k: int):
    """Single scattering in layer ``k`` with its exact phase function."""
    directions, _, _, fields_in, fields_out = paths
    cosine_in = fields_in.cosines[k]
    cosine_out = fields_out.cosines[k]
    ahead_cosine, back_cosine = scattering_cosines(cosine_out, cosine_in, directions.azimuth_rad)
    reflected, transmitted = single_scattering_kernels(cosine_out, cosine_in, optics.optical_thickness)
    # Scattering over the truncated extinction, but with the full phase function.
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
