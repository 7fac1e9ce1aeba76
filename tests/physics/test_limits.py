"""Limits that are known without a solver."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.bsdf import regular_power
from jaxink.optics import OPAQUE_OPTICAL_THICKNESS
from physics.probe import Light, film, ink, matched, pair_angles, printed, two_inks


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


def test_positive_everywhere():
    random = np.random.default_rng(0)
    for _ in range(40):
        asymmetry, refractive_index = random.uniform(-0.6, 0.8), random.uniform(1.0, 2.5)
        optics = 10 ** random.uniform(-3, 3), 1 - 10 ** random.uniform(-4, 0), asymmetry
        for stack in (matched(*optics), film(ink(refractive_index, *optics))):
            bsdf = Light(stack).bsdf
            assert np.all(bsdf >= -1e-12 * bsdf.max()), (refractive_index, optics)
