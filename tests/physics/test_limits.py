"""Limits that are known without a solver."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.optics.directions import Directions
from jaxink.optics.layers import OPAQUE_OPTICAL_THICKNESS
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power, regular_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import plan_channels
from jaxink.solver.stack import Stack
from tests.physics.probe import Light, film, ink, matched, pair_angles, printed, two_inks


@pytest.mark.parametrize("share", [0.0, 0.15, 0.5])
def test_two_layers_of_one_ink_are_one_layer(share):
    whole = Light(film(ink(optical_thickness=2.0)))
    parts = Light(two_inks(ink(optical_thickness=2 * share), ink(optical_thickness=2 * (1 - share))))
    np.testing.assert_allclose(parts.reflected_pairs, whole.reflected_pairs, rtol=1e-10)
    np.testing.assert_allclose(parts.transmitted_pairs, whole.transmitted_pairs, rtol=1e-10)


def test_plate_of_the_ink_index_is_invisible():
    with_plate, without = Light(printed(ink(1.5), 1.5)), Light(film(ink(1.5)))
    np.testing.assert_allclose(with_plate.reflected_pairs, without.reflected_pairs, rtol=1e-10)
    np.testing.assert_allclose(with_plate.transmitted_pairs, without.transmitted_pairs, rtol=1e-10)


def test_plate_of_the_index_of_air_is_invisible():
    with_plate, without = Light(printed(ink(1.5), 1.0)), Light(film(ink(1.5)))
    np.testing.assert_allclose(with_plate.transmitted_pairs, without.transmitted_pairs, rtol=1e-10)


def test_absorbing_layer_behind_is_not_seen_once_the_ink_is_opaque():
    opaque = ink(1.5, OPAQUE_OPTICAL_THICKNESS, 0.9)
    clear, dark = (Light(printed(opaque, 1.5, plate, behind=True)) for plate in (0.0, 3.0))
    np.testing.assert_allclose(clear.bsdf, dark.bsdf, atol=1e-15)


def test_thick_layer_with_absorption_is_opaque():
    thick, opaque = (Light(film(ink(1.5, tau, 0.9))) for tau in (60.0, OPAQUE_OPTICAL_THICKNESS))
    np.testing.assert_allclose(thick.reflected_pairs, opaque.reflected_pairs, rtol=1e-10)


def plate_by_fresnel(refractive_index, sin_incidence):
    """Unpolarised reflectance and transmittance of a plate without absorption, summed incoherently."""
    mu = np.sqrt(1 - sin_incidence**2)
    inside = np.sqrt(1 - (sin_incidence / refractive_index) ** 2)
    r_s = ((mu - refractive_index * inside) / (mu + refractive_index * inside)) ** 2
    r_p = ((refractive_index * mu - inside) / (refractive_index * mu + inside)) ** 2
    # Each polarisation would keep its own sum; jaxink carries unpolarised light through.
    r = (r_s + r_p) / 2
    return 2 * r / (1 + r), (1 - r) / (1 + r)


@pytest.mark.parametrize("refractive_index", [1.0, 1.2, 1.5, 2.5])
def test_layer_of_no_thickness_is_a_fresnel_plate(refractive_index):
    sines = np.sin(np.deg2rad([0.0, 30.0, 56.3, 85.0]))
    found = regular_power(film(ink(refractive_index, 0.0)), jnp.asarray(sines))
    np.testing.assert_allclose(found, plate_by_fresnel(refractive_index, sines), rtol=1e-12, atol=1e-15)
    light = Light(film(ink(refractive_index, 0.0)))
    np.testing.assert_allclose([light.reflected_pairs, light.transmitted_pairs], 0.0, atol=1e-11)


def test_regular_light_through_layers_that_absorb():
    # Beer's law along the refracted ray; two clear media of one index make no inner reflection.
    stack = printed(ink(1.5, 0.4, 0.3), 1.5, plate_thickness=0.7)
    sines = np.sin(np.deg2rad([0.0, 40.0]))
    r = plate_by_fresnel(1.5, sines)[0]
    r = r / (2 - r)  # of one face
    decay = np.exp(-1.1 / np.sqrt(1 - (sines / 1.5) ** 2))
    reflected, transmitted = regular_power(stack, jnp.asarray(sines))
    gain = 1 / (1 - (r * decay) ** 2)
    np.testing.assert_allclose(transmitted, (1 - r) ** 2 * decay * gain, rtol=1e-12)
    np.testing.assert_allclose(reflected, r + (1 - r) ** 2 * r * decay**2 * gain, rtol=1e-12)


@pytest.mark.parametrize("asymmetry", [-0.6, 0.0, 0.8])
def test_thin_layer_scatters_once(asymmetry):
    optical_thickness, albedo = 1e-6, 0.7
    light = Light(matched(optical_thickness, albedo, asymmetry))
    a, b, azimuth = pair_angles()
    for pairs, way in ((light.reflected_pairs, -1), (light.transmitted_pairs, 1)):
        scattering_cosine = way * np.cos(a) * np.cos(b) + np.sin(a) * np.sin(b) * np.cos(azimuth)
        g = asymmetry
        phase = (1 - g**2) / (1 + g**2 - 2 * g * scattering_cosine) ** 1.5
        expected = albedo * phase / (4 * np.pi) * optical_thickness / (np.cos(a) * np.cos(b))
        # What is scattered twice is smaller by the optical thickness and its logarithm.
        np.testing.assert_allclose(pairs[0], expected, rtol=1e-4)


def diffusely_lit(stack, config):
    """Reflectance and transmittance for Lambertian illumination from the front."""
    grid = plan_channels(stack).grid(stack, config)
    powers = hemispherical_power(stack, grid.kappa, config)
    return [float(2 * jnp.sum(grid.etendue_weight * power)) for power in powers]


@pytest.mark.parametrize("optical_thickness", [20.0, 200.0, 2000.0])
def test_thick_layer_without_absorption_approaches_the_two_flux_law(optical_thickness):
    # Two fluxes: T = 1 / (1 + S d), S d = 3/4 tau. Exactly 1 / T = 3/4 (tau + 2 q), Hopf's q = 0.710446.
    reflected, transmitted = diffusely_lit(matched(optical_thickness, 1.0, 0.0), SolverConfig(24, 6, 4, 1))
    np.testing.assert_allclose(1 / transmitted, 0.75 * (optical_thickness + 2 * 0.710446), rtol=2e-7)
    np.testing.assert_allclose(reflected, 1 - transmitted, rtol=1e-10)


@pytest.mark.parametrize("asymmetry", [0.0, 0.7])
def test_thick_layer_with_little_absorption_approaches_the_two_flux_law(asymmetry):
    # 1 - R = 4 sqrt((1 - albedo) / (3 (1 - g))) to first order, so that the rest falls as 1 - albedo.
    rest = []
    for loss in (1e-4, 1e-6):
        optics = ink(1.0, OPAQUE_OPTICAL_THICKNESS, 1 - loss, asymmetry)
        stack = Stack((optics,), 1.0, 1.0)
        reflected, _ = diffusely_lit(stack, SolverConfig(24, 6, 40, 1))
        rest.append(1 - reflected - 4 * np.sqrt(loss / (3 * (1 - asymmetry))))
    assert abs(rest[0]) < 10 * 1e-4 / (1 - asymmetry)
    np.testing.assert_allclose(rest[0] / rest[1], 100, rtol=0.05)


# Sizes for narrow peaks, one compiled program for each kind of stack.
@pytest.mark.parametrize(
    ("make", "config", "plan"),
    [
        (lambda x: matched(x[2], x[0], x[1]), SolverConfig(58, 6, 74, 50), None),
        (
            lambda x: film(ink(x[3], x[2], x[0], x[1])),
            SolverConfig(28, 26, 88, 34),
            plan_channels(film(ink()), free=[1]),
        ),
    ],
    ids=["matched", "film"],
)
def test_positive_everywhere(make, config, plan):
    random = np.random.default_rng(0)
    n = 60
    albedo = np.concatenate([np.ones(10), np.zeros(10), 1 - 10 ** random.uniform(-6, 0, n - 20)])
    asymmetry = random.uniform(-0.95, 0.95, n)
    thickness, index = 10 ** random.uniform(-6, 4, n), random.uniform(1.0, 2.5, n)
    there = np.meshgrid([0.0, 20, 45, 70], [2.0, 25, 50, 75, 88], [0.0, 60, 120, 180], [0, 1], indexing="ij")
    theta_i, theta_o, phi, side = (axis.ravel() for axis in there)
    directions = Directions.from_degrees(theta_i, theta_o, phi, side > 0)
    optics = jnp.asarray(np.column_stack([albedo, asymmetry, thickness, index]))

    def one(x):
        return diffuse_bsdf(make(x), directions, config, plan)

    bsdf = jax.jit(lambda o: jax.lax.map(one, o))(optics)
    # Where nothing scatters, zero has an absolute rounding, larger the more grazing the nodes are.
    negative = np.argwhere(bsdf < -1e-9 * bsdf.max(axis=1, keepdims=True) - 1e-9 * (albedo == 0)[:, None])
    assert negative.size == 0, optics[negative[:3, 0]]
