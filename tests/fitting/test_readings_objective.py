"""Fits to readings: residuals, noise, and an ink that they determine."""

import dataclasses

import numpy as np
import pytest

from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.objective import PredictingModel
from jaxink.fitting.objective_of_readings import noise_of_readings, readings_objective
from jaxink.measurement import Noise, Readings
from jaxink.model.readings import ReadingsModel
from jaxink.sample import parse_sample
from jaxink.solver.config import SolverConfig
from tests.samples import PRINTED_INK, edited

SMALL = SolverConfig(8, 6, 16, 1)
NAN = np.nan
# Reflectance over a black, which is no backing at all.
ROWS = (("R_total", 8.0), ("T_total", 8.0), ("T_collimated", 0.0))


def readings(value=0.5, sigma=None, wavelengths=(550.0,), rows=ROWS):
    quantity, angle = (np.tile(column, len(wavelengths)) for column in zip(*rows, strict=True))
    n = len(quantity)
    nowhere = np.full(n, NAN)
    return Readings(
        quantity,
        angle.astype(float),
        nowhere,
        nowhere,
        np.repeat(wavelengths, len(rows)),
        np.broadcast_to(value, n).astype(float),
        None if sigma is None else np.broadcast_to(sigma, n).astype(float),
        source="ink.csv",
    )


def quiet(*changes):
    """The print without noise of scans."""
    return parse_sample(edited(PRINTED_INK, ("scan_relative = 0.002\n", "", *changes)))


@pytest.fixture(scope="module")
def simulated():
    """Readings of the print at the values of its table, without noise."""
    sample = quiet()
    values = np.asarray(ReadingsModel(sample, readings(), SMALL).bsdf())
    return readings(values, 1e-3)


def test_residuals_are_in_units_of_the_noise(simulated):
    shifted = dataclasses.replace(simulated, value=simulated.value + [1e-3, -2e-3, 0])
    objective = readings_objective(shifted, quiet(), config=SMALL)
    assert isinstance(objective.model, PredictingModel)
    assert objective.free == tuple(
        f"ink.{x}" for x in ("scattering_per_mm", "absorption_per_mm", "asymmetry_parameter")
    )
    start = objective.scale.to_unit(np.array([60.0, 1.0, 0.5]))
    point = CompiledObjective(objective).linearised(start)
    np.testing.assert_allclose(point.residual, [1, -2, 0], atol=1e-8)
    np.testing.assert_allclose(point.predicted, simulated.value, rtol=1e-12)
    # Regular light knows the extinction alone.
    assert point.jacobian.shape == (3, 3)
    assert np.linalg.cond(point.jacobian) < 1e4
    assert point.jacobian[2, 2] == 0


@pytest.mark.parametrize("start", [(0.2, 0.8, 0.3), (0.9, 0.2, 0.9)])
def test_albedo_extinction_and_asymmetry_are_recovered(simulated, start):
    objective = readings_objective(simulated, quiet(), config=SMALL)
    found = GradientSearch(objective).run(np.array(start))
    scattering, absorption, asymmetry = objective.numbers(found.unit).values()
    assert scattering + absorption == pytest.approx(61, rel=1e-6)
    assert scattering / (scattering + absorption) == pytest.approx(60 / 61, rel=1e-6)
    assert asymmetry == pytest.approx(0.5, abs=1e-5)


def test_readings_of_one_quantity_share_the_factor_of_their_scan(simulated):
    sample = parse_sample(PRINTED_INK)
    both = readings(np.tile(simulated.value, 2), 1e-3, (550.0, 600.0))
    sample = dataclasses.replace(sample, wavelengths_nm=())
    objective = readings_objective(both, sample, config=SMALL)
    assert (objective.scan_relative, objective.n_scans) == (0.002, 3)
    np.testing.assert_array_equal(objective.scan[:3], objective.scan[3:])
    predicted = np.asarray(objective.model.bsdf())
    residual = np.asarray(objective.in_noise(predicted, np.full(6, 1e-3)))
    covariance = 1e-6 * np.eye(6) + 4e-6 * np.outer(predicted, predicted) * (
        objective.scan[:, None] == objective.scan
    )
    expected = np.full(6, 1e-3) @ np.linalg.solve(covariance, np.full(6, 1e-3))
    assert residual @ residual == pytest.approx(expected, rel=1e-10)
    assert readings_objective(simulated, quiet(), config=SMALL).scan_relative == 0


def test_readings_at_other_wavelengths_are_left_out(simulated, refused):
    both = readings(np.tile(simulated.value, 2), 1e-3, (550.0, 600.0))
    objective = readings_objective(both, quiet(), config=SMALL)
    assert objective.model.wavelengths_nm == (550.0,)
    assert len(objective.measured) == 3
    with refused("ink.csv", "550"):
        readings_objective(readings(wavelengths=(600.0,)), quiet(), config=SMALL)


def test_weights_are_those_of_incidence_and_side(simulated):
    text = edited(
        PRINTED_INK,
        ("[noise]", '[[weights]]\nside = "T"\nweight = 4\n[[weights]]\ntheta_i_deg = 8\nweight = 9\n[noise]'),
    )
    objective = readings_objective(simulated, parse_sample(text), config=SMALL)
    np.testing.assert_allclose(objective.weight, [3, 6, 2])


def test_noise_is_that_of_the_file_or_of_the_sample():
    sigma = np.array([0.01, 0.02, 0.03])
    given = readings(0.5, sigma)
    np.testing.assert_array_equal(noise_of_readings(given, Noise()).sigma_per_sr, sigma)
    assert noise_of_readings(given, Noise()).scan_relative == 0
    assert noise_of_readings(given, Noise(scan_relative=0.01)).scan_relative == 0.01
    declared = noise_of_readings(given, Noise(0.01, 0.002, use_file_sigma=False))
    np.testing.assert_allclose(declared.sigma_per_sr, np.hypot(0.005, 0.002))
    np.testing.assert_allclose(noise_of_readings(readings(), Noise(floor_per_sr=0.01)).sigma_per_sr, 0.01)


class TestRefusals:
    def test_unknown_noise(self, refused):
        sample = quiet("relative = 0.005\nfloor_per_sr = 1e-4\n", "")
        with refused("ink.csv", "sigma", "noise.relative"):
            readings_objective(readings(), sample, config=SMALL)

    def test_noise_of_nothing(self, refused):
        with refused("ink.csv", "row 3", "floor_per_sr"):
            noise_of_readings(readings([0.5, 0.0, 0.1]), Noise(0.01))

    def test_no_free_parameter(self, refused):
        text = PRINTED_INK.replace("free = true", "free = false")
        with refused("free"):
            readings_objective(readings(), parse_sample(text), config=SMALL)

    def test_an_unknown_objective(self, refused):
        with refused("chi_square"):
            readings_objective(readings(), quiet(), kind="chi", config=SMALL)

    def test_an_objective_that_needs_positive_values(self, refused):
        with refused("relative", "1 readings"):
            readings_objective(readings([0.5, 0.0, 0.1], 0.01), quiet(), kind="relative", config=SMALL)
