"""Wave optics of one interface: published limits, reciprocity, energy, and the passage to facets."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0

from jaxink.surfaces.lobes import reflected_lobe, transmitted_lobe
from jaxink.surfaces.spectrum import GaussianSpectrum, KCorrelation, tabulated_spectrum
from jaxink.surfaces.wave_optics import perturbation_factor, scattered_bsdf
from jaxink.surfaces.wave_power import balance, scattered_power, validity
from jaxink.surfaces.wave_surface import WaveSurface, phase_per_height, regular_power
from tests.surfaces.densities import gaussian_slopes

SMOOTH = WaveSurface(KCorrelation(0.002**2, 3.0, 3.5), 1.0, 1.5, 550.0)
POLAR = np.deg2rad([8.0, 35.0, 62.0, 80.0])
PAIRS = tuple(axis.ravel() for axis in np.cos(np.meshgrid(POLAR, POLAR)))
AZIMUTHS = np.broadcast_to(np.deg2rad([0.0, 50.0, 140.0, 180.0]), (16, 4))


def rough(variance, length_um=5.0, front=1.0, back=1.5, amplitude="perturbation"):
    return WaveSurface(GaussianSpectrum(variance, length_um), front, back, 550.0, amplitude)


@pytest.mark.parametrize("index", [1.5, 1 / 1.5])
def test_reflection_is_that_of_rayleigh_and_rice(index):
    """The polarisation factors as Rice and Stover write them, for a surface seen from vacuum."""
    surface = WaveSurface(SMOOTH.spectrum, 1.0, index, 550.0)
    out, into = (c[:, None] for c in PAIRS)
    eps = index**2
    si, so = np.sqrt(1 - into**2), np.sqrt(1 - out**2)
    ri, ro = np.sqrt(eps - si**2 + 0j), np.sqrt(eps - so**2 + 0j)
    cos, sin = np.cos(AZIMUTHS), np.sin(AZIMUTHS)
    ss = (eps - 1) * cos / ((into + ri) * (out + ro))
    sp = (eps - 1) * ro * sin / ((into + ri) * (eps * out + ro))
    ps = (eps - 1) * ri * sin / ((eps * into + ri) * (out + ro))
    pp = (eps - 1) * (ri * ro * cos - eps * si * so) / ((eps * into + ri) * (eps * out + ro))
    q = sum(np.abs(part) ** 2 for part in (ss, sp, ps, pp)) / 2
    expected = 16 * np.pi**2 / 0.55**4 * into * out * q
    found = perturbation_factor(surface, jnp.asarray(out), jnp.asarray(into), AZIMUTHS, False)
    np.testing.assert_allclose(found, expected, rtol=1e-10)


def test_perturbation_is_scalar_theory_near_the_normal():
    cosine = jnp.array([np.cos(1e-3)])
    for front, back in ((1.0, 1.5), (1.5, 1.0), (1.33, 1.6)):
        for side in (False, True):
            surface = WaveSurface(SMOOTH.spectrum, front, back, 550.0)
            a = phase_per_height(surface, cosine, cosine, side)
            reflectance = ((front - back) / (front + back)) ** 2
            power, n_o = (1 - reflectance, back) if side else (reflectance, front)
            expected = power * a**2 * n_o**2 / 0.55**2
            found = perturbation_factor(surface, cosine, cosine, jnp.zeros(1), side)
            np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_slightly_rough_surface_needs_one_order():
    first_order = WaveSurface(SMOOTH.spectrum, 1.0, 1.5, 550.0, several_orders=False)
    for side in (False, True):
        all_orders = scattered_bsdf(SMOOTH, *PAIRS, AZIMUTHS, side)
        expected = scattered_bsdf(first_order, *PAIRS, AZIMUTHS, side)
        # (A sigma)^2 is 2e-3 in reflection.
        np.testing.assert_allclose(all_orders, expected, rtol=5e-3)


def test_scattering_is_the_transform_of_krywonos():
    surface = WaveSurface(GaussianSpectrum(0.06**2, 2.0), 1.0, 1.5, 550.0, "fresnel")
    out, into = np.cos(np.deg2rad([20.0])), np.cos(np.deg2rad([10.0]))
    g = (2 * np.pi / 0.55 * (out + into)[0] * 0.06) ** 2
    frequency = (np.sin(np.deg2rad(20)) + np.sin(np.deg2rad(10))) / 0.55

    def integrand(r):
        return (np.exp(-g * (1 - np.exp(-((r / 2.0) ** 2)))) - np.exp(-g)) * j0(2 * np.pi * frequency * r) * r

    transform = 2 * np.pi * quad(integrand, 0, 12, limit=500)[0]
    expected = 0.04 * transform / 0.55**2
    found = scattered_bsdf(surface, out, into, np.array([[np.pi]]), False)[0, 0]
    # Fresnel reflectance is 0.040 to a percent here.
    assert g > 1
    assert float(found) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("amplitude", ["perturbation", "fresnel"])
def test_reciprocity(amplitude):
    surface = WaveSurface(KCorrelation(0.1**2, 5.0, 3.5), 1.0, 1.5, 550.0, amplitude)
    out, into = PAIRS
    there = scattered_bsdf(surface, out, into, AZIMUTHS, False)
    np.testing.assert_allclose(there, scattered_bsdf(surface, into, out, AZIMUTHS, False), rtol=1e-10)
    there = scattered_bsdf(surface, out, into, AZIMUTHS, True) / 1.5**2
    back = scattered_bsdf(surface.reversed, into, out, AZIMUTHS, True)
    np.testing.assert_allclose(there, back, rtol=1e-8)
    assert np.max(there) > 1e-3


def test_scattering_is_continuous_at_the_specular_direction():
    frequency = np.geomspace(1e-3, 20, 60)
    table = tabulated_spectrum(frequency, GaussianSpectrum(0.1**2, 5.0).density_um4(frequency) + 1e-12)
    for spectrum in (table, KCorrelation(0.1**2, 5.0, 3.5)):
        surface, cosine = WaveSurface(spectrum, 1.0, 1.5, 550.0), jnp.full(2, 0.8)
        at, beside = scattered_bsdf(surface, cosine, cosine, jnp.array([[0.0], [1e-4]]), False)
        np.testing.assert_allclose(at, beside, rtol=1e-4)


@pytest.mark.parametrize(("front", "back"), [(1.0, 1.5), (1.5, 1.0)])
def test_energy_of_a_smooth_surface(front, back):
    for variance, most in ((0.003**2, 5e-6), (0.03**2, 3e-4), (0.1**2, 2e-3)):
        total = balance(rough(variance, front=front, back=back), jnp.cos(jnp.deg2rad(30.0))).total
        assert abs(float(total) - 1) < most


def test_scattered_power_is_what_the_regular_light_loses():
    surface, cosine = rough(0.02**2), jnp.cos(jnp.deg2rad(5.0))
    found = balance(surface, cosine)
    for regular, scattered, side in (
        (found.regular_reflected, found.scattered_reflected, False),
        (found.regular_transmitted, found.scattered_transmitted, True),
    ):
        smooth = regular_power(rough(0.0), cosine[None], side)[0]
        assert float(scattered) == pytest.approx(float(smooth - regular), rel=0.02)
        assert float(scattered) > 1e-3


def test_total_is_that_of_the_bsdf():
    surface, into = rough(0.05**2, 1.0), np.cos(np.deg2rad(40.0))
    nodes, weights = np.polynomial.legendre.leggauss(60)
    cosine, weights = (nodes + 1) / 2, weights / 2
    phi = (np.arange(64) + 0.5) * np.pi / 64
    at = scattered_bsdf(surface, cosine, np.full(60, into), np.broadcast_to(phi, (60, 64)), True)
    total = 2 * np.pi * np.sum(np.mean(np.asarray(at), axis=1) * cosine * weights)
    assert float(scattered_power(surface, into, True)) == pytest.approx(total, rel=2e-3)


def test_no_roughness_leaves_fresnel_only():
    surface, cosine = rough(0.0), jnp.cos(jnp.deg2rad(jnp.array([0.0, 56.309932474])))
    assert np.all(scattered_bsdf(surface, *PAIRS, AZIMUTHS, False) == 0)
    np.testing.assert_allclose(regular_power(surface, cosine, False)[0], 0.04, rtol=1e-12)
    # At Brewster's angle only s is reflected: (n^2 - 1)^2 / (n^2 + 1)^2 / 2.
    np.testing.assert_allclose(regular_power(surface, cosine, False)[1], (1.25 / 3.25) ** 2 / 2, rtol=1e-8)
    np.testing.assert_allclose(
        regular_power(surface, cosine, True), 1 - regular_power(surface, cosine, False)
    )


def test_scattering_is_linear_in_the_height_variance_at_zero():
    out, into, phi = PAIRS[0][:1], PAIRS[1][1:2], AZIMUTHS[:1, 1:2]

    def at(variance):
        surface = WaveSurface(KCorrelation(variance, 3.0, 3.5), 1.0, 1.5, 550.0)
        return scattered_bsdf(surface, out, into, phi, True)[0, 0]

    slope = float(jax.grad(at)(0.0))
    assert slope > 0
    assert float(at(1e-10)) / 1e-10 == pytest.approx(slope, rel=1e-5)


def test_gradient_in_a_rough_surface():
    out, into, phi = PAIRS[0][:1], PAIRS[1][1:2], AZIMUTHS[:1, 1:2]

    def at(length):
        return scattered_bsdf(rough(0.15**2, length), out, into, phi, False)[0, 0]

    difference = float(at(3.0 + 1e-4) - at(3.0 - 1e-4)) / 2e-4
    assert float(jax.grad(at)(3.0)) == pytest.approx(difference, rel=1e-4)


def test_wavelength_law_of_a_white_spectrum():
    # Correlated over much less than a wavelength: the PSD is flat, and the BSDF goes as lambda^-4.
    spectrum = GaussianSpectrum(1e-6, 0.005)
    for side in (False, True):
        blue, red = (
            scattered_bsdf(WaveSurface(spectrum, 1.0, 1.5, w), *PAIRS, AZIMUTHS, side) for w in (400.0, 800.0)
        )
        np.testing.assert_allclose(np.asarray(blue / red), 16.0, rtol=0.01)


def test_wavelength_law_of_a_falling_spectrum():
    # Beyond the bend PSD ~ f^-C: BRDF ~ lambda^(C - 4).
    spectrum = KCorrelation(1e-7, 100.0, 3.0)
    out, into = np.cos(np.deg2rad([50.0])), np.cos(np.deg2rad([10.0]))
    blue, red = (
        scattered_bsdf(WaveSurface(spectrum, 1.0, 1.5, w), out, into, np.zeros((1, 1)), False)[0, 0]
        for w in (400.0, 800.0)
    )
    assert float(blue / red) == pytest.approx(2.0, rel=5e-3)


def half_width_deg(values, angles_deg):
    """Width at half maximum of a lobe that has one peak."""
    values = np.asarray(values)
    top = np.argmax(values)
    high = np.interp(values[top] / 2, values[top:][::-1], angles_deg[top:][::-1])
    low = np.interp(values[top] / 2, values[: top + 1], angles_deg[: top + 1])
    return high - low


@pytest.mark.parametrize("amplitude", ["perturbation", "fresnel"])
@pytest.mark.parametrize("side", [False, True])
@pytest.mark.parametrize("front", [1.0, 1.5])
def test_very_rough_surface_is_one_of_facets(side, amplitude, front):
    back = 2.5 - front
    surface = rough(1.0, 15.0, front, back, amplitude)
    density = gaussian_slopes(surface.spectrum.slope_variance)
    theta = np.linspace(-50, 50, 801)
    cosine, into = np.cos(np.deg2rad(theta)), np.full(801, np.cos(np.deg2rad(15.0)))
    # Forward of the normal the azimuth of propagation is 0, behind it 180 degrees.
    phi = np.where(theta > 0, 0.0, np.pi)
    waves = np.asarray(scattered_bsdf(surface, cosine, into, phi[:, None], side))[:, 0]
    lobe = transmitted_lobe if side else reflected_lobe
    indices, directions = (jnp.asarray(n) for n in (front, back)), (cosine, into, phi)
    facets = np.asarray(lobe(tuple(indices), *map(jnp.asarray, directions), density)) / cosine / into
    facets = facets * back**2 if side else facets
    assert half_width_deg(waves, theta) == pytest.approx(half_width_deg(facets, theta), rel=0.1)
    assert waves.max() == pytest.approx(facets.max(), rel=0.1)
    assert theta[np.argmax(waves)] == pytest.approx(theta[np.argmax(facets)], abs=2.0)


def test_validity_says_what_it_names():
    found = validity(rough(0.1**2), np.cos(np.deg2rad(30.0)))
    k = 2 * np.pi / 0.55
    assert found["a_sigma_reflection"] == pytest.approx(2 * k * 0.1 * np.cos(np.deg2rad(30)))
    refracted = np.sqrt(1 - (0.5 / 1.5) ** 2)
    expected = k * 0.1 * (1.5 * refracted - np.cos(np.deg2rad(30)))
    assert found["a_sigma_transmission"] == pytest.approx(expected)
    assert found["highest_frequency_per_um"] == pytest.approx((1.5 + 0.5) / 0.55)
    assert found["slope"] == pytest.approx(np.sqrt(2) * 0.1 / 5)
    assert found["uncovered"] == 0
    assert abs(found["power_error"]) < 1e-3


def test_fine_heights_scatter_nowhere_and_are_told():
    fine = WaveSurface(GaussianSpectrum(0.02**2, 0.05), 1.0, 1.5, 550.0)
    found = validity(fine, 0.9)
    assert found["height_variance_beyond"] == pytest.approx(np.exp(-((np.pi * 0.05 * 3.52) ** 2)), rel=0.02)
    assert found["power_error"] < -0.01


def test_unknown_amplitude_is_refused(refused):
    with refused("perturbation"):
        rough(0.1, amplitude="kirchhoff")
