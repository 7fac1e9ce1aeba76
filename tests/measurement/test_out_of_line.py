"""Slips of the pen are found by the neighbours of a reading; peaks, shadows and noise are not."""

import numpy as np
import pytest

import jaxink
from jaxink.measurement import GonioData, readings_out_of_line

THETA_O = np.arange(-70.0, 71.0, 4.0)


def scan(values, theta_i=0.0, passes=False):
    n = THETA_O.size
    same = np.full(n, theta_i), np.abs(THETA_O), np.where(THETA_O < 0, 180.0, 0.0), np.full(n, 550.0)
    return GonioData(*same, np.full(n, passes), np.asarray(values, float))


@pytest.mark.parametrize("factor", [10.0, 0.1, 1000.0])
@pytest.mark.parametrize("place", [3, 10, 25])
def test_a_decimal_point_in_the_wrong_place(factor, place):
    values = 0.1 + 0.05 * np.cos(np.deg2rad(THETA_O))
    slipped = values.copy()
    slipped[place] *= factor
    [found] = readings_out_of_line(scan(slipped))
    assert found.point == place
    assert found.expected_per_sr == pytest.approx(values[place], rel=0.02)


@pytest.mark.parametrize("width_deg", [0.5, 2.0, 5.0, 20.0])
def test_a_peak_around_the_regular_direction_is_none(width_deg):
    away = np.where(THETA_O < 0, np.abs(THETA_O) - 30.0, np.abs(THETA_O) + 30.0)
    values = 0.1 + 200 * np.exp(-0.5 * (away / width_deg) ** 2)
    assert readings_out_of_line(scan(np.minimum(values, 150.0), theta_i=30.0)) == ()


def test_neither_noise_nor_the_shadow_nor_zeros_are_slips():
    rng = np.random.default_rng(8)
    assert readings_out_of_line(scan(0.2 * np.exp(0.3 * rng.normal(size=THETA_O.size)))) == ()
    shadow = np.where(np.abs(THETA_O) < 4, 0.001, 0.2)
    assert readings_out_of_line(scan(shadow)) == ()
    assert readings_out_of_line(scan(np.where(THETA_O == 42, 0.0, 0.2))) == ()


def test_simulated_measurements_have_none(shared_data):
    files = sorted((shared_data / "simulated").glob("*.csv"))
    assert files
    for file in files:
        assert readings_out_of_line(jaxink.read(file)) == (), file.name
