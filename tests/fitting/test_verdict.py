"""The verdict on a fit, against the chi-square distribution."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import kstest

import jaxink
from benchmarks.simulated_data import declared_text
from jaxink.fitting import Outcome
from jaxink.fitting.uncertainty import Covariance
from jaxink.fitting.verdict import exceeds_noise, falls_short_of_noise, judge_fit
from jaxink.measurement import Noise, NoiseLevel
from jaxink.numerics.chi_square import probability_above, residual_above, residual_below
from jaxink.sample import ResidualWeight

N, PARAMETERS = 648, 3


def residual(scale, seed=5):
    return scale * np.random.default_rng(seed).standard_normal(N)


@pytest.mark.parametrize(
    ("scale", "code", "holds"),
    [(1.0, "consistent", True), (1.05, "consistent", True), (1.3, "misfit", False), (130.0, "misfit", False)]
    + [(0.8, "consistent", True), (0.1, "overstated_noise", True)],
)
def test_noise_of_another_scale_is_noticed(scale, code, holds):
    whitened = residual(scale)
    verdict = judge_fit(Outcome.CONVERGED, "chi_square", whitened, PARAMETERS)
    assert (verdict.code, verdict.standard_errors_hold) == (code, holds)
    assert verdict.reduced_chi_square == pytest.approx(np.sum(whitened**2) / (N - PARAMETERS))
    assert verdict.is_misfit == (code == "misfit")


def test_few_points_are_given_the_benefit_of_the_doubt():
    # chi-square 10 of 4: probability 0.04; 40 of 4: 4e-8 (table of the chi-square distribution).
    assert not exceeds_noise(10.0, 4)
    assert exceeds_noise(40.0, 4)
    # 0.5 of 4: probability 0.026; 0.05 of 4: 3e-4.
    assert not falls_short_of_noise(0.5, 4)
    assert falls_short_of_noise(0.05, 4)


@pytest.mark.parametrize("outcome", [o for o in Outcome if not o.is_as_asked])
def test_no_verdict_on_the_misfit_without_a_minimum(outcome):
    verdict = judge_fit(outcome, "chi_square", residual(1.0), PARAMETERS)
    assert (verdict.code, verdict.standard_errors_hold) == ("not_converged", False)


@pytest.mark.parametrize(
    ("objective", "whitened", "parameters"),
    [("relative", residual(9.0), 3), ("chi_square", None, 3), ("chi_square", np.full(3, 9.0), 3)],
    ids=["another objective", "unknown noise", "no degree of freedom"],
)
def test_what_cannot_be_judged_is_not(objective, whitened, parameters):
    assert judge_fit(Outcome.CONVERGED, objective, whitened, parameters).code == "not_judged"


def test_points_of_weight_zero_do_not_count(example_result):
    assert example_result.verdict.code == "consistent"
    is_r = ~example_result.data.is_transmission[example_result.data.used]
    spoiled = dataclasses.replace(example_result, whitened=example_result.whitened + 30.0 * is_r)
    assert spoiled.verdict.is_misfit
    ignoring = dataclasses.replace(spoiled.sample, weights=(ResidualWeight(0.0, side="R"),))
    assert dataclasses.replace(spoiled, sample=ignoring).verdict.code == "consistent"


def estimated(freedom):
    """Residuals in a noise that some of them tell, of so many degrees of freedom, in many repetitions."""
    draws = np.random.default_rng(11).standard_normal((400, N))
    return list(draws / np.sqrt(np.mean(draws[:, :freedom] ** 2, axis=1, keepdims=True)))


@pytest.mark.parametrize("freedom", [10, 16, 230])
def test_estimated_noise_makes_no_misfit_of_a_model_that_fits(freedom):
    level = NoiseLevel(0.005, freedom)
    codes = [judge_fit(Outcome.CONVERGED, "chi_square", w, 0, level=level).code for w in estimated(freedom)]
    # Less than one of 400 is expected at a probability of 0.001.
    assert codes.count("misfit") <= 2
    if freedom < 20:
        taken_as_exact = [judge_fit(Outcome.CONVERGED, "chi_square", w, 0).code for w in estimated(freedom)]
        assert taken_as_exact.count("misfit") > 80


def test_the_probability_is_that_of_fishers_distribution():
    # 95 % point of F with 10 and 20 degrees of freedom: 2.348 (tables).
    assert probability_above(10 * 2.348, 10, 20) == pytest.approx(0.05, abs=1e-4)
    # Its limit is the distribution of chi-square, whose 95 % point of 10 is 18.307.
    assert probability_above(18.307, 10, 1e9) == pytest.approx(0.05, abs=1e-4)
    assert probability_above(18.307, 10) == pytest.approx(0.05, abs=1e-4)


def test_the_probability_of_residuals_that_the_noise_is_estimated_from_is_uniform():
    """Repeats: what is left around the mean of all, over what is left around those of each direction."""
    values = np.random.default_rng(7).normal(size=(4000, 30, 2))
    within = np.sum((values - values.mean(axis=2, keepdims=True)) ** 2, axis=(1, 2)) / 30
    whole = np.sum((values - values.mean(axis=(1, 2), keepdims=True)) ** 2, axis=(1, 2)) / within
    assert kstest(residual_above(whole, 59, 30), "uniform").pvalue > 0.01
    # The two are not independent.
    assert kstest(probability_above(whole, 59, 30), "uniform").pvalue < 1e-6
    below = [residual_below(square, 59, 30) for square in whole[:10]]
    np.testing.assert_allclose(below, 1 - residual_above(whole[:10], 59, 30))


@pytest.mark.parametrize(
    ("scale", "freedom", "code", "words"),
    [
        (1.0, 230, "consistent", "within the estimated noise, 0.50(2) %"),
        (1.33, 16, "consistent", "Only the noise is in doubt"),
        (1.33, 230, "misfit", "the estimated noise, 0.50(2) %, gives about 1"),
        (0.1, 230, "overstated_noise", "The estimated noise, 0.50(2) %, is too large"),
    ],
)
def test_a_sentence_says_that_the_noise_is_estimated(scale, freedom, code, words, told):
    level = NoiseLevel(0.005, freedom)
    verdict = judge_fit(Outcome.CONVERGED, "chi_square", residual(scale), PARAMETERS, level=level)
    assert verdict.code == code
    assert "stated noise" not in verdict.sentence
    told(verdict.sentence, words)


def test_many_parameters_at_a_bound_are_counted():
    waves = range(430, 730, 20)
    names = tuple(f"ink.{key}@{w}" for key in ("scattering_per_mm", "absorption_per_mm") for w in waves)
    few, many = (
        judge_fit(Outcome.CONVERGED, "chi_square", residual(9.0), PARAMETERS, at_bound=at).sentence
        for at in (names[:2], (*names, "ink.thickness_um"))
    )
    assert "ink.scattering_per_mm@430 and ink.scattering_per_mm@450 ended at a bound" in few
    assert (
        "31 parameters (ink.scattering_per_mm at 15 wavelengths, ink.absorption_per_mm at 15 wavelengths, "
        "ink.thickness_um) ended at a bound" in many
    )


def test_standard_errors_include_the_uncertainty_of_an_estimated_noise():
    errors = Covariance(np.diag([4.0, np.inf]), np.zeros(2, bool))
    assert errors.for_noise_of(np.inf) is errors
    # 68.27 % of Student's t with 10 degrees of freedom lie within 1.0527 (tables: 1.053).
    widened = errors.for_noise_of(10).deviation
    assert widened[0] / 2 == pytest.approx(1.053, abs=1e-3)
    assert np.isinf(widened[1])


def test_a_fit_without_stated_noise_knows_how_well_it_is_known(example_result, coarse, tmp_path):
    from jaxink.data import simulated_example

    path, sample = simulated_example()
    data = jaxink.read(path).replace(sigma_per_sr=None)
    silent = dataclasses.replace(jaxink.load_sample(sample), noise=Noise())
    result = jaxink.fit(data, silent, jaxink.FitOptions(config=coarse, profile="none"))
    level = result.noise["level"]
    used = example_result.data.used
    stated = example_result.sigma_per_sr / example_result.data.bsdf_per_sr[used]
    assert level.relative == pytest.approx(
        np.sqrt(np.mean(stated**2)), rel=3 / np.sqrt(2 * level.degrees_of_freedom)
    )
    assert result.verdict.code == "consistent"
    assert "estimated noise" in result.verdict.sentence
    assert result.merit.probability > 1e-3
    loaded = jaxink.load_result(result.save(tmp_path / "kept"))
    assert loaded.noise["level"] == level
    assert loaded.verdict == result.verdict


def test_a_model_that_is_right_fits_without_any_stated_noise(shared_data, tmp_path):
    path = shared_data / "simulated" / "plain_hg.csv"
    toml = tmp_path / "plain_hg.toml"
    toml.write_text(declared_text("plain_hg"), encoding="utf-8")
    stated = jaxink.load_sample(toml)
    data = jaxink.read(path).replace(sigma_per_sr=None)
    # Far from any regular peak, Henyey-Greenstein scattering of g = 0.6 needs few moments.
    config = jaxink.SolverConfig(nodes_escaping=16, nodes_trapped=10, n_moments=40, n_orders=10)
    options = jaxink.FitOptions(config=config, profile="none")
    result = jaxink.fit(data, dataclasses.replace(stated, noise=Noise()), options)
    level = result.noise["level"]
    assert level.relative == pytest.approx(
        stated.noise.relative, rel=2 / np.sqrt(2 * level.degrees_of_freedom)
    )
    # The factor of each scan, 0.2 %, is too small for 16 reciprocal pairs to find, but allowed for.
    assert result.noise["scan_relative"] >= stated.noise.scan_relative
    assert (result.verdict.code, result.verdict.standard_errors_hold) == ("consistent", True)
    assert result.merit.probability > 0.01
    assert "in doubt" not in result.verdict.sentence
