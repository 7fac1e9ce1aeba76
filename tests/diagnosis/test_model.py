"""A model is fitted once and never changes; the refits of its candidates are kept in one place."""

import dataclasses
from unittest.mock import Mock

import numpy as np
import pytest

import jaxink
from jaxink.diagnosis import DiagnosisOptions
from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.diagnosis.search.checkpoint import Checkpoint
from jaxink.diagnosis.search.deadline import Deadline
from jaxink.diagnosis.search.model import fit_model
from jaxink.diagnosis.search.problem import problem_of
from jaxink.diagnosis.search.refit import Refit, Refits
from jaxink.effects import ReadingEffect
from jaxink.effects.instrument import Nonlinearity, StrayLight
from jaxink.fitting.outcome import Search
from jaxink.numerics.failures import Failures
from jaxink.numerics.precision import computing
from jaxink.sample import Parameter, parse_sample
from tests.diagnosis.printed import SAMPLE, SIZES, drawn


class NotFinite(ReadingEffect):
    """Makes every prediction infinite, also at zero strength."""

    name, statement = "not_finite", "a number is divided by zero"
    terms = (Parameter("not_finite.strength", 0.0, True, 0.0, 1.0),)

    def change(self, predicted, values, field):
        return predicted + (1 + values["not_finite.strength"]) / 0.0


@pytest.fixture(scope="module")
def problem():
    sample, fit_options = parse_sample(SAMPLE), jaxink.FitOptions(profile="none", config=SIZES)
    options = DiagnosisOptions(fit=fit_options, catalogue=(NotFinite,))
    fitted = jaxink.fit(drawn((StrayLight(),), {"stray_light.level_per_sr": 0.015}, 41), sample, fit_options)
    how = lambda *_: None, Deadline(), Failures(), Checkpoint()  # noqa: E731
    return problem_of(fitted, sample, options, *how), fitted.values


@pytest.fixture(scope="module")
def declared(problem):
    with computing():
        return fit_model(problem[0], (), problem[1])


def test_a_candidate_that_spoils_the_fit_is_left_out_and_noted(problem, declared):
    assert declared.listed.forms == ()
    assert {failure.name for failure in problem[0].failures.found} == {"not_finite"}
    assert declared.problem is problem[0]
    assert np.all(np.isfinite(declared.jacobian))


def test_a_model_is_the_minimum_of_the_sample_with_its_effects(problem, declared):
    with computing():
        larger = fit_model(problem[0], (StrayLight(),), declared.solution.values)
    assert larger.free == (*declared.free, "stray_light.level_per_sr")
    assert larger.reduced_chi_square < 1.3 < declared.reduced_chi_square
    # At a minimum the residual is orthogonal to the derivatives.
    scaled = larger.jacobian / np.linalg.norm(larger.jacobian, axis=0)
    assert np.abs(scaled.T @ larger.residual).max() < 1e-2
    with pytest.raises(dataclasses.FrozenInstanceError):
        larger.solution = declared.solution


def test_a_model_with_the_objective_of_another_one_has_no_candidates(problem, declared):
    with computing():
        same = fit_model(problem[0], (), declared.solution.values, declared.objective)
    assert same.objective is declared.objective
    assert same.problem.catalogue == ()
    assert same.solution.chi_square == pytest.approx(declared.solution.chi_square, rel=1e-9)


def refit(effect, delta_chi_square):
    solution = Solution({}, (), 100.0 - delta_chi_square, np.zeros(1), Mock(Search))
    return Refit(effect, solution, Mock(CandidateObjective), delta_chi_square)


def test_of_the_forms_of_an_effect_the_best_after_its_penalty_counts():
    refits = Refits(500)
    one, other = Nonlinearity(1.0), Nonlinearity(2.0)
    for made in (refit(one, 30.0), refit(other, 40.0), refit(StrayLight(), 35.0)):
        refits.keep(made)
    assert {name: best.effect for name, best in refits.best.items()} == {
        "nonlinearity": other,
        "stray_light": StrayLight(),
    }
    # A refit that went on takes the place of the earlier one.
    refits.keep(refit(one, 50.0))
    assert refits.best["nonlinearity"].effect == one
    assert refits.of(one).delta_chi_square == 50.0
    assert refits.of(Nonlinearity(3.0)) is None
