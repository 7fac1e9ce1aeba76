"""The whole way on a simulated measurement: fit by gradient and simplex, save, load, predict again."""

import dataclasses
import json

import jax
import numpy as np
import pytest

import jaxink
from jaxink.fitting import FitOptions
from jaxink.fitting.result import FittedParameter

# Truth of the embedded simulated measurement.
TRUTH = {
    "ink.scattering_per_mm": 95.0,
    "ink.absorption_per_mm": 1.1,
    "ink.asymmetry_parameter": 0.6,
}
REDUCED_OPTICAL_THICKNESS = 95.0 * 0.4 * 0.08


@pytest.fixture(scope="module")
def fitted(inputs):
    return jaxink.fit(*inputs)


def quantity(result, name):
    return next(d for d in result.derived if d.quantity == name)


def test_truth_is_found_within_three_standard_errors(fitted):
    assert fitted.converged
    assert 0.001 < fitted.merit.probability < 0.999
    for name, true in TRUTH.items():
        found = fitted[name]
        assert abs(found.value - true) < 3 * found.standard_error, name
    reduced = quantity(fitted, "reduced_optical_thickness")
    assert abs(reduced.value - REDUCED_OPTICAL_THICKNESS) < 3 * reduced.standard_error


def test_gradient_needs_few_jacobians_from_the_middle_of_the_ranges(fitted):
    (search,) = (search for search in fitted.searches if search.method == "gradient")
    assert search.start["ink.scattering_per_mm"] == pytest.approx(500.5)
    assert search.jacobians <= 12


def test_simplex_ends_in_the_same_minimum_on_the_same_objective(inputs, fitted):
    simplex = jaxink.fit(*inputs, FitOptions(method="simplex"))
    assert simplex.searches[0].loss_start == pytest.approx(fitted.searches[0].loss_start, rel=1e-12)
    assert simplex.merit.chi_square == pytest.approx(fitted.merit.chi_square, abs=0.05)
    assert simplex.merit.chi_square >= fitted.merit.chi_square - 1e-6
    for name in TRUTH:
        error = fitted[name].standard_error
        assert abs(simplex[name].value - fitted[name].value) < 0.2 * error
    assert simplex["ink.scattering_per_mm"].standard_error is None


def test_profile_agrees_with_the_standard_error_where_the_minimum_is_quadratic(fitted):
    found: FittedParameter = fitted["ink.scattering_per_mm"]
    low, high = found.interval
    assert high - low == pytest.approx(2 * found.standard_error, rel=0.05)


def test_saved_result_is_the_same_and_predicts_the_same(fitted, tmp_path):
    path = fitted.save(tmp_path / "out")
    loaded = jaxink.load_result(path)
    assert loaded.merit == fitted.merit
    assert loaded.parameters == fitted.parameters
    assert loaded.sample == fitted.sample
    assert loaded.scans == fitted.scans
    assert np.array_equal(loaded.predicted_per_sr, fitted.predicted_per_sr)
    assert loaded.predict()[loaded.data.used] == pytest.approx(fitted.predicted_per_sr, rel=1e-9)
    assert json.loads(path.read_text())["schema_version"] == 1
    assert sorted(p.name for p in path.parent.iterdir()) == [
        "parameters.csv",
        "result.json",
        "result.nc",
        "sample.toml",
    ]


def test_the_session_keeps_its_precision(inputs):
    with jax.enable_x64(False):
        result = jaxink.predict(inputs[1], inputs[0])
        assert result.dtype == np.float64
        assert not jax.config.jax_enable_x64


def test_prediction_at_chosen_directions(inputs, refused):
    data, sample = inputs
    rows = data.select(side="T")
    columns = rows.theta_i_deg, rows.theta_o_deg, rows.phi_deg
    found = jaxink.predict_at(sample, *columns, side="T")
    np.testing.assert_allclose(found.bsdf_per_sr, jaxink.predict(sample, rows), rtol=1e-9)
    # Signed angles in the plane of incidence, and arguments that broadcast.
    signed = np.array([-40.0, 0.0, 40.0])
    pairs = jaxink.predict_at(sample, np.array([[0.0], [30.0]]), signed)
    assert pairs.theta_i_deg.tolist() == [0, 0, 0, 30, 30, 30]
    assert pairs.theta_o_deg.tolist() == [40, 0, 40] * 2
    assert pairs.phi_deg.tolist() == [0, 180, 180] * 2
    assert not pairs.is_transmission.any()
    assert pairs.bsdf_per_sr[0] == pytest.approx(pairs.bsdf_per_sr[2], rel=1e-6)
    with refused("side"):
        jaxink.predict_at(sample, 0.0, signed, side="reflection")
    with refused("wavelength_nm"):
        jaxink.predict_at(dataclasses.replace(sample, wavelengths_nm=(500.0, 550.0)), 0.0, signed)


def test_a_parameter_that_the_data_do_not_know_is_called_so(inputs):
    data, sample = inputs
    # Two coefficients that act as a sum only.
    table = sample.parameters.replace("plate.absorption_per_mm", free=True, value=1e-9, maximum=1e-6)
    result = jaxink.fit(data, dataclasses.replace(sample, parameters=table))
    found = result["plate.absorption_per_mm"]
    assert found.flag in ("not determined", "at lower bound", "at upper bound")
    low, high = found.interval
    assert (low, high) == pytest.approx((0.0, 1e-6), abs=1e-12)


def test_unknown_noise_is_refused_for_chi_square(inputs, refused):
    data, sample = inputs
    in_plane_half = data.select(theta_i_deg=30.0, side="R").replace(sigma_per_sr=None)
    # Of every eighth view, the scan is not dense enough to tell its noise.
    in_plane_half = in_plane_half.replace(mask=np.where(np.arange(len(in_plane_half)) % 8 > 0, 32, 0))
    silent = dataclasses.replace(sample, noise=jaxink.sample.Noise())
    with refused("noise"):
        jaxink.fit(in_plane_half, silent)
