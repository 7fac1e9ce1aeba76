"""Height maps: synthetic Gaussian surfaces of known spectrum give back their slopes and spectrum."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.surfaces.height_map import HeightMap, TabulatedSlopes
from jaxink.surfaces.spectrum import GaussianSpectrum, KCorrelation, isotropic_from_profile
from tests.surfaces.densities import gaussian_slopes


def synthetic(spectrum, n, pitch_um, seed):
    """Gaussian surface with a spectrum, periodic."""
    frequency = np.hypot(*np.meshgrid(np.fft.fftfreq(n, pitch_um), np.fft.fftfreq(n, pitch_um)))
    noise = np.fft.fft2(np.random.default_rng(seed).standard_normal((n, n)))
    return np.fft.ifft2(noise * np.sqrt(np.asarray(spectrum.density_um4(frequency))) / pitch_um).real


SMOOTH = GaussianSpectrum(0.04, 6.0)


@pytest.fixture(scope="module")
def smooth():
    return HeightMap(synthetic(SMOOTH, 512, 0.5, 1), 0.5)


def test_tilt_and_mean_do_not_count(smooth):
    y, x = np.indices(smooth.heights_um.shape)
    tilted = HeightMap(smooth.heights_um + 3.0 + 0.1 * x - 0.02 * y, 0.5)
    np.testing.assert_allclose(tilted.heights_um, smooth.heights_um, atol=1e-10)


def test_slope_variance_of_a_gaussian_surface(smooth):
    found = smooth.slope_statistics()
    # 42^2 correlation areas: about 3 percent; the differences see 1 percent less.
    assert found.variance == pytest.approx(float(SMOOTH.slope_variance), rel=0.08)
    assert found.bandwidth_per_um == 0.5
    assert found.anisotropy < 1.2
    assert found.variance_twice_as_coarse < found.variance


def test_slopes_of_a_gaussian_surface_are_those_of_beckmann(smooth):
    density, variance = smooth.slope_density(), smooth.slope_statistics().variance
    expected = gaussian_slopes(variance)
    slopes = np.sqrt(variance) * np.array([0.2, 0.7, 1.0, 1.5, 2.0, 2.5])
    # Only 42^2 independent areas: steep facets come few at a time.
    np.testing.assert_allclose(density.density(slopes), expected.density(slopes), rtol=0.12)


def test_tabulated_slopes_are_normalised_and_keep_the_variance(smooth):
    density = smooth.slope_density()
    slope = np.linspace(0, float(density.largest_slope), 20001)
    radial = np.asarray(density.radial(jnp.asarray(slope)))
    assert 2 * np.pi * np.trapezoid(radial, slope) == pytest.approx(1, abs=2e-4)
    second = 2 * np.pi * np.trapezoid(radial * slope**2, slope) / 2
    # The steepest 1e-4 of the facets are not in the table.
    assert second == pytest.approx(smooth.slope_statistics().variance, rel=0.01)


def test_slopes_scale_with_the_heights(smooth):
    density = smooth.slope_density()
    doubled = TabulatedSlopes(2.0, density.slopes, density.log_density)
    slopes = jnp.array([0.01, 0.05, 0.1])
    np.testing.assert_allclose(doubled.density(2 * slopes), density.density(slopes) / 4, rtol=1e-12)
    measured = HeightMap(2 * smooth.heights_um, 0.5).slope_density()
    np.testing.assert_allclose(measured.density(2 * slopes), density.density(slopes) / 4, rtol=1e-9)


def test_height_scale_is_differentiable(smooth):
    nodes = smooth.slope_density()

    @jax.jit
    def at(scale):
        return TabulatedSlopes(scale, nodes.slopes, nodes.log_density).density(jnp.array(0.06))

    step = 1e-5
    assert float(jax.jit(jax.grad(at))(1.0)) == pytest.approx(
        float(at(1 + step) - at(1 - step)) / (2 * step), rel=1e-5
    )


def test_coarse_pitch_is_warned_of(smooth, told):
    coarse = HeightMap(smooth.heights_um[::8, ::8], 4.0)
    with warnings.catch_warnings(record=True, action="always", category=UserWarning) as caught:
        coarse.slope_statistics()
    (warning,) = caught
    told(str(warning.message), "pitch")


@pytest.mark.parametrize("spectrum", [SMOOTH, KCorrelation(0.04, 20.0, 3.5)])
def test_spectrum_of_a_synthetic_surface(spectrum):
    heights = HeightMap(synthetic(spectrum, 512, 0.5, 2), 0.5)
    found = heights.power_spectrum()
    frequency = np.array([0.03, 0.05, 0.08, 0.12])
    # Rings of 12 % width hold hundreds of frequencies.
    expected = np.asarray(spectrum.density_um4(frequency))
    np.testing.assert_allclose(found.density_um4(jnp.asarray(frequency)), expected, rtol=0.15)
    assert float(found.height_variance_um2) == pytest.approx(heights.height_variance_um2, rel=0.1)


def test_parseval_of_the_periodogram():
    # A surface whose structure is much smaller than the map loses nothing by the window.
    heights = HeightMap(synthetic(GaussianSpectrum(0.04, 1.5), 512, 0.5, 3), (0.5, 0.5))
    _, density = heights._periodogram()
    power = np.sum(density) / (512 * 0.5) ** 2
    assert power == pytest.approx(heights.height_variance_um2, rel=0.01)


def test_axes_may_have_different_pitches():
    fine = synthetic(GaussianSpectrum(0.04, 6.0), 512, 0.5, 4)
    found = HeightMap(fine[::2], (1.0, 0.5))
    assert found.slope_statistics().anisotropy < 1.2
    frequency = jnp.array([0.04, 0.08])
    expected = HeightMap(fine, 0.5).power_spectrum().density_um4(frequency)
    np.testing.assert_allclose(found.power_spectrum().density_um4(frequency), expected, rtol=0.1)


def test_unit_of_length_does_not_matter(smooth):
    millimetres = HeightMap(smooth.heights_um / 1000, 0.5 / 1000)
    slopes = jnp.array([0.02, 0.08])
    density = smooth.slope_density().density(slopes)
    np.testing.assert_allclose(millimetres.slope_density().density(slopes), density, rtol=1e-9)
    frequency = jnp.array([0.03, 0.1])
    found = millimetres.power_spectrum().density_um4(1000 * frequency) * 1000.0**4
    np.testing.assert_allclose(found, smooth.power_spectrum().density_um4(frequency), rtol=1e-9)


def test_profile_relation_inverts_the_projection():
    # Exponent 4 in the plane is 3 along a line: PSD_1 = A B^-1 (pi / 2) (1 + (B f)^2)^(-3/2).
    surface = KCorrelation.of_amplitude(2.0, 10.0, 4.0)
    frequency = np.geomspace(1e-3, 2.0, 80)
    profile = 2.0 / 10.0 * np.pi / 2 * (1 + (10 * frequency) ** 2) ** -1.5
    nodes, density = isotropic_from_profile(frequency, profile)
    np.testing.assert_allclose(density, surface.density_um4(nodes), rtol=0.01)


def test_spectrum_of_a_long_profile():
    surface, n, pitch_um = KCorrelation.of_amplitude(2.0, 10.0, 4.0), 2**18, 0.5
    frequency = np.fft.fftfreq(n, pitch_um)
    profile = 2.0 / 10.0 * np.pi / 2 * (1 + (10 * frequency) ** 2) ** -1.5
    noise = np.fft.fft(np.random.default_rng(5).standard_normal(n))
    heights = np.fft.ifft(noise * np.sqrt(profile / pitch_um)).real
    found = HeightMap(heights, pitch_um).power_spectrum()
    at = jnp.array([0.02, 0.05, 0.1, 0.2, 0.4])
    # 80 000 lengths B; the lowest frequencies have the fewest samples.
    np.testing.assert_allclose(found.density_um4(at), surface.density_um4(at), rtol=0.15)


def test_bad_maps_are_refused(smooth, refused):
    with refused("(3, 3)"):
        HeightMap(np.zeros((3, 3)), 1.0)
    holed = np.array(smooth.heights_um)
    holed[4, 7] = np.nan
    with refused("(4, 7)"):
        HeightMap(holed, 1.0)
    with refused("pitch_um"):
        HeightMap(smooth.heights_um, 0.0)
    with refused():
        HeightMap(smooth.heights_um[0], 0.5).slope_density()
