"""Light scattered once and twice, polarised and scalar: what a scalar solver leaves out, to second order."""

from typing import NamedTuple, cast

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.optics import (
    Directions,
    ScatteringLayer,
    ScatteringMatrix,
    polarised_reflectance,
    propagating_cosine,
)
from jaxink.solver.single_scattering import mean_attenuation, single_scattering_kernels
from jaxink.solver.specular import attenuation
from jaxink.solver.stack import Stack

# Nodes of the direction between both events. The forward peaks cancel in the difference of both theories,
# which these nodes give to 3 % for white pigments of several sizes, and to 13 % for equal spheres.
N_COSINES, N_AZIMUTHS = 6, 10
# Spread of three exponents, times the thickness, below which their divided difference is the limit for
# equal ones.
_EQUAL = 1e-4


def polarised_excess(
    stack: Stack, matrices: dict[int, ScatteringMatrix], directions: Directions
) -> Float[Array, " points"]:
    """BSDF of polarised light minus that of the scalar theory, from light scattered once and twice.

    Light is followed on its direct way into a layer and on its direct way out, through smooth interfaces that
    polarise it. Light that an interface reflects on its way is neglected, and so are higher orders.

    Parameters
    ----------
    stack
        Layers between two half spaces.
    matrices
        Scattering matrix of each scattering layer, by its position.
    directions
        The points.

    Returns
    -------
    Float[Array, " points"]
        In 1/sr, for light and a detector without preferred polarisation.
    """
    excess = jnp.zeros(directions.incidence.shape)
    for k, matrix in matrices.items():
        vector, scalar = two_orders(stack, k, matrix, directions)
        excess = excess + jnp.sum(vector - scalar, axis=0)
    return excess


def two_orders(
    stack: Stack,
    k: int,
    matrix: ScatteringMatrix,
    directions: Directions,
    n_cosines: int = N_COSINES,
    n_azimuths: int = N_AZIMUTHS,
) -> tuple[Float[Array, "2 points"], Float[Array, "2 points"]]:
    """Light scattered once and twice in layer ``k``, see `polarised_excess`.

    Parameters
    ----------
    n_cosines, n_azimuths
        Nodes in each hemisphere, and in half a turn, of the direction between both events.

    Returns
    -------
    vector, scalar
        BSDF of either order in 1/sr, with and without polarisation.
    """
    ways, into, out = _ways(stack, k, directions)
    layer, side = cast(ScatteringLayer, stack.layers[k]), directions.is_transmission
    strength = layer.single_scattering_albedo / (4 * jnp.pi)
    light_in, light_out = ways.at(into), ways.at(out)
    once = _scattered_once(matrix, light_in, light_out, directions, layer.optical_thickness)
    azimuths = _azimuthal_series(matrix, ways, n_cosines, n_azimuths)
    # By reciprocity, light that goes out is found on its way reversed, where U has the other sign. From the
    # back that way is also mirrored, which restores the sign and exchanges the hemispheres back.
    of_in, of_out = azimuths[:, into], azimuths[:, out]
    turned = jnp.roll(of_out, n_cosines, axis=2) * np.array([1.0, 1.0, -1.0, 1.0])[:, None, None, None]
    of_out = jnp.where(side[:, None, None], of_out, turned)
    depths = _depth_integrals(light_in.cosine, light_out.cosine, side, layer.optical_thickness, n_cosines)
    harmonics = jnp.cos(directions.azimuth_rad[:, None] * np.arange(n_azimuths))
    twice = jnp.einsum("pk,pm,spkm,spkm->sp", depths, harmonics, of_in, of_out)
    index_out = jnp.where(side, stack.index_back, stack.index_front)
    orders = (
        jnp.stack([strength * once, strength**2 * twice], axis=1) * (index_out / layer.refractive_index) ** 2
    )
    return jnp.sum(orders[:3], axis=0), orders[3]


class _Ways(NamedTuple):
    """Direct ways between a layer and its surroundings.

    Parameters
    ----------
    cosine, sine
        Of the angle in the layer; 1 and 0 if no light propagates there. The sine is kept because it is smooth
        at normal incidence, where the root of 1 - cosine^2 has no derivative.
    unpolarised, polarised
        Half sum and half difference of the transmittances for light polarised parallel and perpendicular to
        the plane of incidence.
    """

    cosine: Float[Array, " directions"]
    sine: Float[Array, " directions"]
    unpolarised: Float[Array, " directions"]
    polarised: Float[Array, " directions"]

    def at(self, positions) -> "_Ways":
        return _Ways(*(part[positions] for part in self))


def _ways(stack: Stack, k: int, directions: Directions):
    """All ways, and the positions of each point's way in and way out among them."""
    n_in, n_out = directions.sin_incidence.size, directions.sin_outgoing.size
    sines = stack.index_front * directions.sin_incidence, stack.index_front * directions.sin_outgoing
    kappa = jnp.concatenate([*sines, stack.index_back * directions.sin_outgoing])
    indices = jnp.stack([jnp.asarray(index, float) for index in stack.indices])[:, None]
    cosines = propagating_cosine(1 - (kappa / indices) ** 2)
    reflected = polarised_reflectance(indices[:-1], indices[1:], cosines[:-1], cosines[1:])
    thickness = jnp.stack([jnp.asarray(layer.optical_thickness, float) for layer in stack.layers])
    kept = attenuation(thickness[:, None], cosines[1:-1])
    is_front = np.arange(n_in + 2 * n_out) < n_in + n_out

    def through(reflectance):
        in_front = jnp.prod(1 - reflectance[: k + 1], axis=0) * jnp.prod(kept[:k], axis=0)
        behind = jnp.prod(1 - reflectance[k + 1 :], axis=0) * jnp.prod(kept[k + 1 :], axis=0)
        return jnp.where(is_front, in_front, behind)

    parallel, perpendicular = (through(part) for part in reflected)
    propagates = cosines[k + 1] > 0
    cosine = jnp.where(propagates, cosines[k + 1], 1.0)
    sine = jnp.where(propagates, kappa / indices[k + 1], 0.0)
    ways = _Ways(cosine, sine, (parallel + perpendicular) / 2, (parallel - perpendicular) / 2)
    out = directions.outgoing + jnp.where(directions.is_transmission, n_in + n_out, n_in)
    return ways, directions.incidence, out


def _stokes(matrix: ScatteringMatrix, light: _Ways, cosine, sine, azimuth):
    """I, Q and U of light scattered from the azimuth 0, and I of the scalar theory.

    Q is positive in the plane through the normal, cosines in the hemisphere into which the light goes.
    """
    sine_in = light.sine
    straight, across = jnp.cos(azimuth), jnp.sin(azimuth)
    turn = jnp.clip(light.cosine * cosine + sine_in * sine * straight, -1, 1)
    f11, f12, f33 = matrix.elements(turn)
    # Components of the direction in the scattering plane, along and across each plane through the normal.
    cos_in, sin_in = _double_angle(light.cosine * sine * straight - sine_in * cosine, sine * across)
    cos_out, sin_out = _double_angle(light.cosine * sine - sine_in * cosine * straight, sine_in * across)
    q, u = light.polarised * cos_in, -light.polarised * sin_in
    intensity = f11 * light.unpolarised + f12 * q
    q, u = f12 * light.unpolarised + f11 * q, f33 * u
    return jnp.stack(
        [intensity, q * cos_out - u * sin_out, q * sin_out + u * cos_out, f11 * light.unpolarised]
    )


def _double_angle(x, y):
    """Cosine and sine of twice the angle of (x, y); straight on and straight back, any plane will do."""
    squared = x**2 + y**2
    known = squared > 1e-24
    squared = jnp.where(known, squared, 1.0)
    return jnp.where(known, (x**2 - y**2) / squared, 1.0), jnp.where(known, 2 * x * y / squared, 0.0)


def _scattered_once(matrix, light_in: _Ways, light_out: _Ways, directions: Directions, thickness):
    """Contributions of I, Q and U to the light seen, and that of the scalar theory, for unit strength."""
    side = directions.is_transmission
    cosine = light_out.cosine * jnp.where(side, 1, -1)
    stokes = _stokes(matrix, light_in, cosine, light_out.sine, directions.azimuth_rad)
    reflected, transmitted = single_scattering_kernels(light_out.cosine, light_in.cosine, thickness)
    seen = jnp.stack(
        [light_out.unpolarised, light_out.polarised, jnp.zeros_like(cosine), light_out.unpolarised]
    )
    return jnp.where(side, transmitted, reflected) * seen * stokes


def _azimuthal_series(matrix, ways: _Ways, n_cosines: int, n_azimuths: int):
    """Series in the azimuth of `_stokes` at the nodes, those of the same hemisphere first.

    Cosines, and sines for U, normalised such that an integral over the azimuth is a sum of products.
    """
    azimuth = (np.arange(n_azimuths) + 0.5) * np.pi / n_azimuths
    orders = np.arange(n_azimuths)
    norm = np.sqrt(np.where(orders == 0, 2 * np.pi, np.pi)) * np.where(orders == 0, 1, 2) / n_azimuths
    even, odd = (function(np.outer(azimuth, orders)) * norm for function in (np.cos, np.sin))
    cosines = gauss_legendre_unit(n_cosines)[0]
    cosine = np.concatenate([cosines, -cosines])
    ways = _Ways(*(part[:, None, None] for part in ways))
    sine = np.sqrt(1 - cosine**2)
    stokes = _stokes(matrix, ways, cosine[:, None], sine[:, None], azimuth)
    return jnp.einsum("sdkj,sjm->sdkm", stokes, np.stack([even, even, odd, even]))


def _depth_integrals(cosine_in, cosine_out, is_transmission, thickness, n_cosines: int):
    """Integrals over the depths of both events, at each node of the direction between them.

    Each is a second divided difference of the exponential function.
    """
    cosines, weights = gauss_legendre_unit(n_cosines)
    into, out, side = 1 / cosine_in[:, None], 1 / cosine_out[:, None], is_transmission[:, None]
    between = 1 / cosines
    ahead = jnp.where(side, between, between + out)
    back = jnp.where(side, into + between + out, into + between)
    first, second = jnp.where(side, into, 0.0), jnp.where(side, out, into + out)
    found = [_second_difference(first, second, third, thickness) for third in (ahead, back)]
    return jnp.concatenate(found, axis=1) * into * out * np.tile(weights * between, 2)


def _second_difference(a, b, c, thickness):
    """Second divided difference of exp(-x thickness) between three attenuations, all 0 or more."""
    lower, upper = jnp.minimum(a, b), jnp.maximum(a, b)
    least, most = jnp.minimum(lower, c), jnp.maximum(upper, c)
    middle = jnp.maximum(lower, jnp.minimum(upper, c))

    def first_difference(low, high):
        return thickness * jnp.exp(-low * thickness) * mean_attenuation((high - low) * thickness)

    spread = most - least
    is_equal = spread * thickness < _EQUAL
    apart = first_difference(least, middle) - first_difference(middle, most)
    equal = thickness**2 / 2 * jnp.exp(-(a + b + c) / 3 * thickness)
    return jnp.where(is_equal, equal, apart / jnp.where(is_equal, 1.0, spread))
