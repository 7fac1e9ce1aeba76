"""The verdict on a fit, against the chi-square distribution."""

import dataclasses

import numpy as np
import pytest

from jaxink.fitting import Outcome
from jaxink.fitting.verdict import exceeds_noise, falls_short_of_noise, judge_fit

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
    ignoring = dataclasses.replace(spoiled.sample, weights=((None, "R", 0.0),))
    assert dataclasses.replace(spoiled, sample=ignoring).verdict.code == "consistent"
