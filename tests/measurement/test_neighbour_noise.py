"""Noise from the roughness of scans that have no pairs at all."""

import numpy as np
import pytest

from jaxink.measurement import GonioData, estimate_noise
from jaxink.measurement.neighbour_noise import roughness_of_scans

EVEN = np.arange(-80.0, 80.1, 2.5)
UNEVEN = np.cumsum(np.random.default_rng(3).uniform(1.0, 4.0, 64)) - 80.0
INCIDENCES = (10.0, 33.0, 57.0)


def scans(shape, relative, view=EVEN, seed=1):
    """In-plane scans at a few incidences; views that differ from the incidences, so there are no pairs."""
    theta_i, signed = (grid.ravel() for grid in np.meshgrid(INCIDENCES, view, indexing="ij"))
    exact = shape(theta_i, signed)
    noisy = exact * (1 + relative * np.random.default_rng(seed).standard_normal(exact.size))
    phi = np.where(signed > 0, 180.0, 0.0)
    size = noisy.size
    return GonioData(theta_i, np.abs(signed), phi, np.full(size, 550.0), np.zeros(size, bool), noisy)


def smooth(theta_i, signed):
    return 0.2 * np.cos(np.deg2rad(signed)) ** 0.3 * (1 + 0.1 * np.cos(np.deg2rad(signed - theta_i)))


def with_lobe(theta_i, signed):
    """As high as a glossy face, and as narrow: two steps."""
    return smooth(theta_i, signed) + 40 * np.exp(-0.5 * ((signed - theta_i) / 5.0) ** 2)


def rippled(period_deg, size=0.1):
    return lambda theta_i, signed: (
        smooth(theta_i, signed) * (1 + size * np.sin(2 * np.pi * signed / period_deg))
    )


@pytest.mark.parametrize("relative", [0.001, 0.005, 0.03])
@pytest.mark.parametrize("view", [EVEN, UNEVEN], ids=["even", "uneven"])
@pytest.mark.parametrize("shape", [smooth, with_lobe])
def test_the_level_is_found_within_its_error(shape, view, relative):
    ratios, freedoms = [], []
    for seed in range(12):
        estimate = estimate_noise(scans(shape, relative, view, seed))
        assert estimate.adopted == "roughness"
        ratios.append(estimate.model.relative / relative)
        freedoms.append(estimate.level.degrees_of_freedom)
    error = 1 / np.sqrt(2 * np.mean(freedoms))
    assert error < 0.15
    # Three standard errors of the mean of 12, and 2 % for curvature that is left.
    assert np.mean(ratios) == pytest.approx(1, abs=3 * error / np.sqrt(12) + 0.02)
    # The scatter is that of the stated degrees of freedom: chi-square of 11 at its 0.1 % limits.
    assert 0.4 < np.std(ratios, ddof=1) / error < 1.7


def test_outliers_are_left_out_and_counted():
    data = scans(smooth, 0.005)
    value = data.bsdf_per_sr.copy()
    value[[10, 40, 100, 160]] *= 1.2
    estimate = estimate_noise(data.replace(bsdf_per_sr=value))
    # Five differences contain each of them, some of which count as curved.
    assert 4 <= estimate.source("roughness").outliers <= 20
    assert estimate.model.relative == pytest.approx(0.005, rel=0.25)


@pytest.mark.parametrize("period_deg", [30.0, 20.0, 13.0, 10.0])
def test_ripples_are_no_noise(period_deg):
    for relative in (0.0005, 0.005):
        found = roughness_of_scans(scans(rippled(period_deg), relative))
        # Either the scan is left out, or what is said of it is the noise.
        assert all(one.relative < 1.5 * relative for one in found)


def test_coarse_scans_say_nothing():
    data = scans(with_lobe, 0.005, np.arange(-80.0, 80.1, 10.0))
    assert estimate_noise(data).model is None
    assert not roughness_of_scans(scans(smooth, 0.005, np.arange(-10.0, 10.1, 2.9)))


def test_scans_that_differ_keep_their_own_noise():
    quiet, loud = scans(smooth, 0.002), scans(smooth, 0.02)
    is_loud = quiet.theta_i_deg > 50
    mixed = quiet.replace(bsdf_per_sr=np.where(is_loud, loud.bsdf_per_sr, quiet.bsdf_per_sr))
    relative = estimate_noise(mixed).relative_of(mixed)
    assert np.all(np.abs(relative[is_loud] / 0.02 - 1) < 0.4)
    assert np.all(np.abs(relative[~is_loud] / 0.002 - 1) < 0.4)


def test_rings_are_followed_where_there_are_more_azimuths_than_polar_angles():
    phi = np.tile(np.arange(-178.0, 179.0, 4.0), 3)
    theta_o = np.repeat([20.0, 41.0, 63.0], phi.size // 3)
    exact = 0.2 + 0.1 * np.cos(np.deg2rad(phi)) * np.sin(np.deg2rad(theta_o))
    noisy = exact * (1 + 0.004 * np.random.default_rng(8).standard_normal(phi.size))
    same = np.full(phi.size, 30.0), theta_o, phi, np.full(phi.size, 550.0), np.zeros(phi.size, bool)
    (found,) = roughness_of_scans(GonioData(*same, noisy))
    assert found.relative == pytest.approx(0.004, rel=3 / np.sqrt(2 * found.degrees_of_freedom))
    assert found.degrees_of_freedom > 80


@pytest.mark.parametrize("name", ["plain_hg", "white_ink_mie", "undeclared_blur"])
def test_it_tells_the_noise_of_a_simulated_measurement(shared_data, name):
    from jaxink import read

    data = read(shared_data / "simulated" / f"{name}.csv")
    stated = np.sqrt(np.mean((data.sigma_per_sr / data.bsdf_per_sr) ** 2))
    level = estimate_noise(data.replace(sigma_per_sr=None)).level
    assert level.degrees_of_freedom > 200
    assert level.relative == pytest.approx(stated, rel=2.5 / np.sqrt(2 * level.degrees_of_freedom))
