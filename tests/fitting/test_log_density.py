"""The log density of a fit against SciPy's normal distribution, chi-square and finite differences."""

import dataclasses
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from jaxink.errors import InputRefusedError, PrecisionError
from jaxink.fitting import make_objective
from jaxink.fitting.log_density import LogDensity
from jaxink.measurement import Noise
from jaxink.sample import ResidualWeight
from jaxink.sample.parameters import Prior

SCATTERING, ABSORPTION = "ink.scattering_per_mm", "ink.absorption_per_mm"
SCAN_RELATIVE = 0.02


def density_of(result, data=None, **changes):
    sample = dataclasses.replace(result.sample, **changes)
    objective = make_objective(data or result.data, sample, config=result.config)
    return LogDensity.of(objective, result.values, result.covariance)


@pytest.fixture(scope="module")
def few(example_result):
    """Every ninth point, for dense covariances."""
    data = example_result.data
    return data.with_masks(user=np.arange(len(data)) % 9 > 0)


@pytest.fixture(scope="module")
def density(example_result, few):
    """With a large factor common to each scan, and a prior."""
    table = example_result.sample.parameters.replace(ABSORPTION, prior=Prior(1.2, 0.05))
    return density_of(example_result, few, parameters=table, noise=Noise(scan_relative=SCAN_RELATIVE))


@pytest.fixture(scope="module")
def fitted(example_result, density):
    return {name: example_result.values[name] for name in density.free}


@pytest.fixture(scope="module")
def elsewhere(fitted):
    return {name: 1.03 * value for name, value in fitted.items()}


def test_it_is_the_multivariate_normal_density(density, few, fitted, elsewhere):
    sigma, scan = density.objective.sigma, few.scan_index[few.used]
    for values in (fitted, elsewhere):
        predicted = np.asarray(density.objective.model.bsdf(values))
        common = SCAN_RELATIVE * predicted
        covariance = np.diag(sigma**2) + np.outer(common, common) * (scan[:, None] == scan)
        expected = multivariate_normal(predicted, covariance).logpdf(few.bsdf_per_sr[few.used])
        expected += norm(1.2, 0.05).logpdf(values[ABSORPTION])
        np.testing.assert_allclose(density(values), expected, rtol=1e-10)


def test_without_scan_factor_it_is_half_of_chi_square(example_result, few, fitted, elsewhere):
    density = density_of(example_result, few, noise=Noise(scan_relative=0.0))
    used, chi_square = few.used, []
    for values in (fitted, elsewhere):
        predicted = np.asarray(density.objective.model.bsdf(values))
        residual = (few.bsdf_per_sr[used] - predicted) / few.sigma_per_sr[used]
        chi_square.append(np.sum(residual**2))
    change = float(density(elsewhere) - density(fitted))
    assert change == pytest.approx(-0.5 * (chi_square[1] - chi_square[0]), rel=1e-10)


def test_its_chi_square_is_that_of_the_fit(example_result):
    density = example_result.log_density
    values = {name: example_result.values[name] for name in density.free}
    physical = jnp.array(list(values.values()))
    rows, _ = density.objective.residual_at(physical)
    assert float(jnp.sum(rows**2)) == pytest.approx(example_result.merit.chi_square, rel=1e-10)


def test_gradient_is_that_of_finite_differences(density, elsewhere):
    slopes = jax.jit(jax.grad(density))(elsewhere)
    compiled = jax.jit(density)
    for name, value in elsewhere.items():
        step = 1e-5 * value
        ends = [float(compiled({**elsewhere, name: value + sign * step})) for sign in (1, -1)]
        assert float(slopes[name]) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-6)


def test_whitened_density_includes_the_jacobian(density, fitted):
    at = np.array([0.4, -0.7, 0.2])

    def stacked(whitened):
        return jnp.stack(list(density.from_whitened(whitened).values()))

    _, volume = np.linalg.slogdet(jax.jacfwd(stacked)(at))
    expected = float(density(density.from_whitened(at))) + volume
    assert float(density.whitened(at)) == pytest.approx(expected, rel=1e-10)
    np.testing.assert_allclose(density.to_whitened(density.from_whitened(at)), at, atol=1e-7)
    for name, value in density.from_whitened(np.zeros(3)).items():
        assert float(value) == pytest.approx(fitted[name], rel=1e-10)


def test_whitened_posterior_is_nearly_standard_normal(example_result):
    # Scattering and asymmetry are correlated by 0.997.
    density = example_result.log_density
    slope, step = jax.jit(jax.grad(density.whitened)), 1e-3
    steps = step * np.eye(3)
    curvature = np.array([(slope(s) - slope(-s)) / (2 * step) for s in steps])
    np.testing.assert_allclose(curvature, -np.eye(3), atol=0.05)
    assert np.all(np.abs(slope(np.zeros(3))) < 0.1)


def test_a_weight_of_zero_leaves_a_scan_out(example_result, few, fitted, elsewhere):
    ignored = density_of(example_result, few, weights=(ResidualWeight(0.0, 30.0),))
    without = density_of(example_result, few.with_masks(user=few.theta_i_deg == 30.0))
    for values in (fitted, elsewhere):
        assert float(ignored(values)) == pytest.approx(float(without(values)), rel=1e-10)


def test_a_parameter_at_its_bound_has_finite_coordinates(example_result):
    from jaxink.fitting.fitted_parameters import FittedCovariance

    held = FittedCovariance((SCATTERING,), np.array([[4.0]]))
    values = {**example_result.values, ABSORPTION: 0.0}
    density = LogDensity.of(example_result.log_density.objective, values, held)
    assert np.isfinite(float(density.whitened(np.array([0.5, -0.5, 0.5]))))


def test_outside_the_range_the_density_is_zero(density, fitted):
    low, high = density.bounds["ink.asymmetry_parameter"]
    assert (low, high) == (-0.9, 0.95)
    assert float(density({**fitted, "ink.asymmetry_parameter": 0.96})) == -np.inf


@pytest.mark.parametrize(
    ("change", "named"), [({"ink.haze": 1.0}, "ink.haze"), ({ABSORPTION: None}, ABSORPTION)]
)
def test_values_that_are_not_those_of_the_free_parameters_are_rejected(density, fitted, change, named):
    values = {name: value for name, value in {**fitted, **change}.items() if value is not None}
    with pytest.raises(InputRefusedError, match=named):
        density(values)


def test_in_32_bits_it_says_what_to_do(density, fitted):
    with jax.enable_x64(False), pytest.raises(PrecisionError):
        density(fitted)


def test_without_noise_there_is_no_density(example_result):
    unknown = dataclasses.replace(example_result, noise={**example_result.noise, "known": False})
    with pytest.raises(InputRefusedError, match=example_result.data.source):
        _ = unknown.log_density


def test_its_second_derivatives_are_those_of_its_gradient(density, fitted):
    centre = jnp.zeros(len(fitted))
    gradient, hessian = jax.jit(jax.grad(density.whitened)), jax.jit(jax.hessian(density.whitened))
    h = 1e-3
    differences = [
        (gradient(centre + h * step) - gradient(centre - h * step)) / (2 * h) for step in np.eye(centre.size)
    ]
    found = np.asarray(hessian(centre))
    np.testing.assert_allclose(found, differences, atol=1e-5 * np.abs(found).max())


def test_fixed_parameters_at_the_values_of_the_fit_are_ignored(example_result, fitted):
    density = example_result.log_density
    assert set(example_result.values) > set(fitted)
    assert float(density(example_result.values)) == float(density(fitted))


def test_another_value_of_a_fixed_parameter_is_refused(example_result, told):
    density, values = example_result.log_density, example_result.values
    with pytest.raises(InputRefusedError) as refused:
        density({**values, "plate.thickness_mm": 2.0})
    told(str(refused.value), "plate.thickness_mm", "fixed", "2")
    # Its derivative would be zero, although the BSDF changes with it.
    with pytest.raises(InputRefusedError) as refused:
        jax.grad(density)(values)
    told(str(refused.value), "fixed", "traces", SCATTERING)


# In a process without the tests' own check of types, which would be first.
_OF_AN_ARRAY = """
import jax
jax.config.update("jax_enable_x64", True)
import numpy as np
import jaxink
from jaxink.data import simulated_example
from jaxink.fitting import make_objective
from jaxink.fitting.fitted_parameters import FittedCovariance
from jaxink.fitting.log_density import LogDensity

config = jaxink.SolverConfig(nodes_escaping=6, nodes_trapped=4, n_moments=12, n_orders=3)
file, sample = simulated_example()
data, sample = jaxink.read(file), jaxink.load_sample(sample)
objective = make_objective(data, sample, config=config)
covariance = FittedCovariance((), np.zeros((0, 0)))
density = LogDensity.of(objective, {name: p.value for name, p in sample.parameters.items()}, covariance)
for function in (density, jaxink.forward_model(sample, data, config).bsdf):
    try:
        function(np.ones(3))
    except jaxink.InputRefusedError as problem:
        print(problem)
"""


def test_an_array_in_place_of_named_values_is_refused(told):
    words = [sys.executable, "-c", _OF_AN_ARRAY]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True)
    sentences = done.stdout.splitlines()
    assert len(sentences) == 2, done.stdout
    for sentence in sentences:
        told(sentence, "ndarray", f"{{'{SCATTERING}': ")
