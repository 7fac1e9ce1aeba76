"""Noise relative to what the neighbours of a point say, by which a fit is unbiased."""

import numpy as np
import pytest

from jaxink.measurement import GonioData, Noise, noise_of
from jaxink.measurement.neighbours import values_of_neighbours

THETA_O = np.arange(-75.0, 76.0, 5.0)


def measurement(values, theta_o=THETA_O, **columns):
    n = len(theta_o)
    zero = np.zeros(n)
    phi = np.where(theta_o < 0, 180.0, 0.0)
    return GonioData(zero, np.abs(theta_o), phi, zero + 550.0, zero > 1, np.asarray(values, float), **columns)


def by_neighbours(values, relative=0.05, theta_o=THETA_O):
    return values_of_neighbours(measurement(values, theta_o), np.full(len(theta_o), relative))


@pytest.mark.parametrize("theta_o", [THETA_O, np.sort(THETA_O + 1.5 * np.sin(np.arange(THETA_O.size)))])
def test_an_exponential_parabola_is_reproduced_and_a_line_beyond_the_ends(theta_o):
    x = theta_o / 75
    line, parabola = 0.2 * np.exp(0.3 * x), 0.2 * np.exp(-0.1 * x**2)
    np.testing.assert_allclose(by_neighbours(line, theta_o=theta_o), line, rtol=1e-10)
    np.testing.assert_allclose(by_neighbours(parabola, theta_o=theta_o)[1:-1], parabola[1:-1], rtol=1e-10)


def test_a_point_is_judged_without_its_own_reading():
    values = np.full(THETA_O.size, 0.3)
    for k in range(values.size):
        changed = values.copy()
        changed[k] *= 1.1
        assert by_neighbours(changed)[k] == pytest.approx(0.3, rel=1e-12)


@pytest.mark.parametrize("factor", [1000.0, 1e-3])
def test_a_reading_far_from_its_neighbours_stands_for_itself_and_does_not_mislead_them(factor):
    values = np.full(THETA_O.size, 0.3)
    values[12] *= factor
    np.testing.assert_allclose(by_neighbours(values), values, rtol=1e-12)


def test_a_short_line_stands_for_itself_and_so_does_a_reading_below_zero():
    few = [0.3, 0.2, 0.25, 0.3]
    np.testing.assert_array_equal(by_neighbours(few, theta_o=THETA_O[:4]), few)
    dark = np.where(np.arange(THETA_O.size) == 7, -0.01, 0.3)
    np.testing.assert_allclose(by_neighbours(dark), np.abs(dark), rtol=1e-12)


def test_masked_points_are_no_neighbours():
    values = np.full(THETA_O.size, 0.3)
    values[12] = 0.33
    mask = np.where(np.arange(values.size) == 12, 1, 0)
    data = measurement(values, mask=mask)
    assert data.used.sum() == values.size - 1
    np.testing.assert_allclose(values_of_neighbours(data, np.full(data.used.sum(), 0.05)), 0.3, rtol=1e-12)


def test_a_weighted_mean_is_unbiased():
    # With sigma relative to the readings themselves, it is 2 r^2 too low.
    relative, rng = 0.1, np.random.default_rng(4)
    means = {"neighbours": [], "itself": []}
    for _ in range(400):
        readings = 0.3 * (1 + relative * rng.normal(size=THETA_O.size))
        sigma = noise_of(measurement(readings), Noise(relative=relative)).sigma_per_sr
        for name, one in (("neighbours", sigma), ("itself", relative * readings)):
            means[name].append(np.average(readings, weights=one**-2) / 0.3 - 1)
    error = relative / np.sqrt(400 * THETA_O.size)
    assert abs(np.mean(means["neighbours"])) < 3 * error
    assert np.mean(means["itself"]) == pytest.approx(-2 * relative**2, abs=6 * error)
    # And hardly less efficient than a mean without weights.
    assert np.std(means["neighbours"]) < 1.05 * relative / np.sqrt(THETA_O.size)


def test_a_floor_is_added_and_a_stated_sigma_kept():
    values = 0.2 * np.exp(0.3 * THETA_O / 75)
    sigma = noise_of(measurement(values), Noise(relative=0.02, floor_per_sr=0.03)).sigma_per_sr
    np.testing.assert_allclose(sigma, np.hypot(0.02 * values, 0.03), rtol=1e-10)
    stated = measurement(values, sigma_per_sr=0.1 * np.sqrt(values))
    np.testing.assert_array_equal(noise_of(stated, Noise(relative=0.02)).sigma_per_sr, stated.sigma_per_sr)
