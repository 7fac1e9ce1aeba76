"""The residual vector against dense algebra and written-out definitions."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.errors import InputRefusedError
from jaxink.fitting import make_objective, prepare_data
from jaxink.fitting.figures_of_merit import factor_of_points
from jaxink.fitting.objective import whiten_scans
from jaxink.measurement import GonioData, noise_of
from jaxink.sample import Noise, Prior, ResidualWeight, parse_sample
from jaxink.solver.config import SolverConfig
from tests.samples import edited

SMALL = SolverConfig(8, 6, 16, 2)
SAMPLE = """
schema_version = 1
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 50
scattering_per_mm = { free = true, min = 1, max = 1000, value = 60 }
absorption_per_mm = 0.5
asymmetry_parameter = { free = true, min = -0.9, max = 0.95, value = 0.5 }
[noise]
relative = 0.01
floor_per_sr = 1e-3
scan_relative = 0.02
"""


@pytest.fixture(scope="module")
def sample():
    return parse_sample(SAMPLE)


@pytest.fixture(scope="module")
def data():
    theta_o = np.tile([10.0, 30.0, 50.0, 70.0], 4)
    theta_i = np.repeat([0.0, 40.0, 0.0, 40.0], 4)
    side = np.repeat([False, False, True, True], 4)
    values = np.random.default_rng(3).uniform(0.05, 0.2, 16)
    return GonioData(theta_i, theta_o, np.zeros(16), np.full(16, 550.0), side, values)


def dense_chi_square(objective, predicted, scan_relative):
    """r^T C^-1 r with the covariance written out."""
    residual = objective.measured - predicted
    same_scan = objective.scan[:, None] == objective.scan[None, :]
    covariance = np.diag(objective.sigma**2)
    covariance = covariance + scan_relative**2 * np.outer(predicted, predicted) * same_scan
    return residual @ np.linalg.solve(covariance, residual)


def test_whitening_gives_the_quadratic_form_of_the_full_covariance():
    rng = np.random.default_rng(0)
    scan = np.array([0, 0, 0, 1, 1, 2])
    residual, common = rng.normal(size=6), rng.normal(size=6)
    common[scan == 2] = 0.0
    covariance = np.eye(6) + np.outer(common, common) * (scan[:, None] == scan)
    whitened = np.asarray(whiten_scans(jnp.asarray(residual), jnp.asarray(common), scan, 3))
    assert whitened @ whitened == pytest.approx(residual @ np.linalg.solve(covariance, residual), rel=1e-12)


def test_chi_square_is_that_of_the_declared_covariance(data, sample):
    objective = make_objective(data, sample, config=SMALL)
    residual, predicted = objective.residual(jnp.array([0.5, 0.5]))
    expected = dense_chi_square(objective, np.asarray(predicted), 0.02)
    assert float(residual @ residual) == pytest.approx(expected, rel=1e-10)
    # A diagonal covariance would say something else.
    diagonal = np.sum((objective.measured - np.asarray(predicted)) ** 2 / objective.sigma**2)
    assert expected < 0.9 * diagonal


@pytest.mark.parametrize(
    ("kind", "definition"),
    [
        ("absolute", lambda m, s: m - s),
        ("relative", lambda m, s: (m - s) / (0.5 * (m + s))),
        ("logarithmic", lambda m, s: (np.log(m) - np.log(s)) / (0.5 * (np.log(m) + np.log(s)))),
    ],
)
def test_rmsd_objectives_follow_their_definition(data, sample, kind, definition):
    objective = make_objective(data, sample, kind, SMALL)
    residual, predicted = objective.residual(jnp.array([0.4, 0.6]))
    expected = np.sqrt(np.mean(definition(objective.measured, np.asarray(predicted)) ** 2))
    assert float(jnp.sqrt(residual @ residual)) == pytest.approx(expected, rel=1e-12)


def test_weights_count_a_scan_so_many_times(data, sample):
    plain = make_objective(data, sample, config=SMALL)
    weighted = make_objective(
        data, dataclasses.replace(sample, weights=(ResidualWeight(9.0, 40.0, "T"),)), config=SMALL
    )
    unit = jnp.array([0.5, 0.5])
    ratio = np.asarray(weighted.residual(unit)[0] / plain.residual(unit)[0])
    chosen = (data.theta_i_deg == 40) & data.is_transmission
    assert ratio == pytest.approx(np.where(chosen, 3.0, 1.0))


@pytest.mark.parametrize(
    ("weight", "chosen"),
    [
        (
            ResidualWeight(4.0, theta_o_deg=(30.0, 50.0)),
            lambda d: (d.theta_o_deg >= 30) & (d.theta_o_deg <= 50),
        ),
        (ResidualWeight(4.0, wavelength_nm=(600.0, 700.0)), lambda d: d.wavelength_nm > 600),
    ],
    ids=["view", "wavelength"],
)
def test_weights_of_points_multiply_their_squares(data, sample, weight, chosen):
    assert squares_of(data, sample, weight) == pytest.approx(np.where(chosen(data), 4.0, 1.0))


def test_a_column_of_weights_multiplies_the_squares_of_its_points(data, sample):
    counts = np.arange(16) % 3
    found = squares_of(
        data.replace(extra={"count": counts}), sample, ResidualWeight(4.0, side="T", column="count")
    )
    assert found == pytest.approx(np.where(data.is_transmission, 4.0 * counts, 1.0))


def squares_of(data, sample, weight):
    """Squared residuals over those without the weight."""
    samples = (dataclasses.replace(sample, weights=weights) for weights in ((), (weight,)))
    plain, weighted = (
        np.asarray(make_objective(data, s, "relative", SMALL).residual(jnp.array([0.5, 0.5]))[0])
        for s in samples
    )
    return (weighted / plain) ** 2


@pytest.mark.parametrize(
    ("weight", "kind"),
    [
        (ResidualWeight(2.0, theta_o_deg=(0.0, 30.0)), "chi_square"),
        (ResidualWeight(1.0, column="counts"), "relative"),
        (ResidualWeight(1.0, column="count"), "relative"),
    ],
    ids=["within scans", "no column", "negative"],
)
def test_weights_that_cannot_be_are_refused(data, sample, weight, kind, told):
    counted = data.replace(extra={"count": np.arange(16) - 4}, source="print.csv")
    with pytest.raises(InputRefusedError) as refused:
        make_objective(counted, dataclasses.replace(sample, weights=(weight,)), kind, SMALL)
    told(str(refused.value))


def test_prior_adds_one_row_in_standard_deviations(data, sample):
    table = sample.parameters.replace("ink.asymmetry_parameter", prior=Prior(0.7, 0.05))
    objective = make_objective(data, dataclasses.replace(sample, parameters=table), config=SMALL)
    unit = objective.scale.to_unit(np.array([60.0, 0.5]))
    residual, _ = objective.residual(jnp.asarray(unit))
    assert residual.shape == (17,)
    assert float(residual[-1]) == pytest.approx((0.7 - 0.5) / 0.05)


def test_smoothness_adds_the_change_between_neighbouring_wavelengths_as_a_random_walk(data):
    spread = "per_wavelength = true, value = [50, 60, 90], smoothness = { change = 4, over_nm = 25 }"
    changes = "schema_version = 1", "schema_version = 1\nwavelength_nm = [500, 550, 650]"
    changes += "max = 1000, value = 60", f"max = 1000, {spread}"
    sample = parse_sample(edited(SAMPLE, changes))
    objective = make_objective(data, sample, config=SMALL)
    unit = objective.scale.to_unit(np.array([p.value for p in sample.parameters.free]))
    rows = np.asarray(objective.residual(jnp.asarray(unit))[0])[len(objective.measured) :]
    assert rows == pytest.approx([(50 - 60) / (4 * np.sqrt(2)), (60 - 90) / (4 * np.sqrt(4))])


def test_noise_goes_by_file_then_declaration_then_pairs(data, sample):
    given = data.replace(sigma_per_sr=np.full(16, 0.004))
    assert noise_of(given, sample.noise).sigma_per_sr == pytest.approx(0.004)
    ignoring = dataclasses.replace(sample, noise=dataclasses.replace(sample.noise, use_file_sigma=False))
    declared = np.hypot(0.01 * data.bsdf_per_sr, 1e-3)
    assert noise_of(given, ignoring.noise).sigma_per_sr == pytest.approx(declared)
    silent = dataclasses.replace(sample, noise=Noise())
    assert not noise_of(data, silent.noise).known


def test_nothing_to_fit_is_refused(data, sample, refused):
    fixed = sample.parameters.replace("ink.scattering_per_mm", free=False)
    fixed = fixed.replace("ink.asymmetry_parameter", free=False)
    with refused("free"):
        make_objective(data, dataclasses.replace(sample, parameters=fixed))
    with refused("chi_square"):
        make_objective(data, sample, "least")
    with refused("600"):
        prepare_data(data, dataclasses.replace(sample, wavelengths_nm=(600.0,)))


def test_intensities_are_residuals_times_a_factor(data, sample):
    unit = jnp.array([0.4, 0.6])
    plain, _ = make_objective(data, sample, "absolute", SMALL).residual(unit)
    cosine = np.cos(np.deg2rad(data.theta_o_deg))
    for kind in ("intensity", "photometric"):
        # At one wavelength, the eye changes nothing.
        found, _ = make_objective(data, sample, kind, SMALL).residual(unit)
        np.testing.assert_allclose(found, plain * cosine, rtol=1e-12)


def test_photometric_residuals_follow_the_eye(data):
    red = data.replace(wavelength_nm=np.where(np.arange(16) < 8, 555.0, 650.0))
    factor = factor_of_points("photometric", red) / np.cos(np.deg2rad(red.theta_o_deg))
    # V(650 nm) = 0.107, and D65 has 80.0 there, 102.9 at 555 nm.
    assert factor[8] / factor[0] == pytest.approx(0.107 * 80.0268 / 102.023, rel=0.01)
    assert (factor[0] + factor[8]) / 2 == pytest.approx(1)


def test_no_eye_sees_infrared(data, told):
    with pytest.raises(InputRefusedError) as refused:
        factor_of_points("photometric", data.replace(wavelength_nm=np.full(16, 1000.0)))
    told(str(refused.value), "intensity")
