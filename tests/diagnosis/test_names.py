"""Names that are right: weak effects in noise, hardly testable ones, several effects or one, and mistakes."""

import dataclasses
from unittest.mock import Mock

import numpy as np
import pytest

import jaxink
from jaxink.diagnosis import DiagnosisOptions, SearchPolicy, Testability, VerdictCode, diagnose
from jaxink.diagnosis.findings.assembly import beside_mistakes, explains_all
from jaxink.diagnosis.findings.summary import Figures
from jaxink.diagnosis.findings.verdict import Verdict
from jaxink.diagnosis.search import loop
from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.diagnosis.search.checkpoint import Checkpoint
from jaxink.diagnosis.search.cross_validation import CrossValidation
from jaxink.diagnosis.search.deadline import Deadline
from jaxink.diagnosis.search.loop import search_effects
from jaxink.diagnosis.search.model import FittedModel, fit_model
from jaxink.diagnosis.search.problem import problem_of
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.revision import rival_minima, single_cause
from jaxink.diagnosis.search.screen import Screen
from jaxink.diagnosis.search.step import Step
from jaxink.diagnosis.statistics.predictive_density import HeldOutGain
from jaxink.effects.geometry import ThinPatches
from jaxink.effects.instrument import AngleOffset, Gain, Nonlinearity, StrayLight
from jaxink.fitting.mistake import Mistake
from jaxink.fitting.outcome import Outcome, Search
from jaxink.numerics.failures import Failures
from jaxink.numerics.precision import computing
from jaxink.sample import parse_sample
from tests.diagnosis.printed import SAMPLE, SIZES, drawn

FIT = jaxink.FitOptions(profile="none", config=SIZES)


def options(*catalogue, **others):
    return DiagnosisOptions(fit=FIT, catalogue=catalogue, **others)


def test_a_weak_effect_in_a_residual_of_noise_needs_more_evidence():
    measured = drawn((StrayLight(),), {"stray_light.level_per_sr": 9e-4}, 31)
    strict = diagnose(measured, parse_sample(SAMPLE), options(StrayLight, AngleOffset))
    mild = SearchPolicy(quiet_level=0.05)
    lenient = diagnose(measured, parse_sample(SAMPLE), options(StrayLight, AngleOffset, policy=mild))
    row = next(row for row in strict.candidates if row.effect == "stray_light")
    assert 0.001 < row.p_adjusted < 0.05
    assert strict.verdict.code is VerdictCode.NO_MISFIT
    assert lenient.verdict.effects == ("stray_light",)


@pytest.mark.parametrize(("p_value", "names"), [(0.01, ()), (5e-4, ("stray_light",))])
def test_a_weak_effect_is_named_only_where_the_verdict_calls_the_residual_ordered(
    p_value, names, monkeypatch
):
    plain = FittedModel.structure

    def told(model):
        return dataclasses.replace(plain(model), p_value=1.0 if model.accepted else p_value)

    monkeypatch.setattr(FittedModel, "structure", told)
    measured = drawn((StrayLight(),), {"stray_light.level_per_sr": 9e-4}, 31)
    found = diagnose(measured, parse_sample(SAMPLE), options(StrayLight, AngleOffset))
    assert tuple(step.effect for step in found.steps) == names


def test_the_corrected_model_is_fitted_from_the_minima_of_the_declared_one():
    """A minimum counts if the search has converged in it."""
    ends = {100.0: (7.0, Outcome.CONVERGED), 200.0: (5.0, Outcome.CONVERGED), 300.0: (4.0, Outcome.MAX_STEPS)}

    def fitted(values, free, max_jacobians):
        chi_square, outcome = ends[values["radius"]]
        assert (values["strength"], free) == (0.5, ("radius", "strength"))
        return Mock(spec=Solution, chi_square=chi_square, search=Mock(outcome=outcome), values=values)

    here = Mock(values={"radius": 150.0, "strength": 0.5}, free=("radius", "strength"))
    problem = Mock(rivals=tuple({"radius": radius} for radius in ends), policy=SearchPolicy())
    model = Mock(spec=FittedModel, problem=problem, solution=here, objective=Mock(fit=fitted), accepted=())
    found = rival_minima(model)
    assert [one.chi_square for one in found] == [5.0, 7.0]


def test_a_lower_minimum_is_taken_with_its_numbers_and_the_other_one_is_kept(monkeypatch):
    measured = drawn((AngleOffset(),), {"angle_offset.angle_deg": 0.6}, 32)
    plain = diagnose(measured, parse_sample(SAMPLE), options(AngleOffset))
    monkeypatch.setattr(loop, "rival_minima", lambda model: (model.solution,))
    # Every minimum counts as lower, the same one, too.
    found = diagnose(
        measured, parse_sample(SAMPLE), options(AngleOffset, policy=SearchPolicy(lower_minimum=-1.0))
    )
    (step,), (before,) = found.steps, plain.steps
    assert step.strength == found.corrected["angle_offset.angle_deg"].value
    assert step.strength == pytest.approx(before.strength, rel=1e-4)
    assert step.standard_error == pytest.approx(before.standard_error, rel=1e-3)
    assert found.corrected.minima.starts == 1


def test_what_is_hardly_testable_is_refitted_where_nothing_else_explains_the_data():
    measured = drawn((AngleOffset(),), {"angle_offset.angle_deg": 0.6}, 32)
    found = diagnose(measured, parse_sample(SAMPLE), options(Gain))
    (row,) = found.candidates
    assert row.status is Testability.HARDLY
    assert row.refit_delta_chi_square is not None


def test_several_effects_give_way_to_one_that_explains_as_much():
    measured = drawn(
        (ThinPatches("ink"),), {"thin_patches.share": 0.2, "thin_patches.thickness_ratio": 0.1}, 33
    )
    how, sample = options(AngleOffset, StrayLight, ThinPatches), parse_sample(SAMPLE)
    fitted = jaxink.fit(measured, sample, FIT)
    with computing():
        problem = problem_of(fitted, sample, how, lambda *_: None, Deadline(None), Failures(), Checkpoint())
        found = search_effects(problem, fitted, how)
        forms = (AngleOffset(), StrayLight())
        pair = fit_model(problem, forms, found.first.solution.values)
        gain = HeldOutGain(np.array([1.0, 2.0]))
        refit = Refit(forms[1], pair.solution, pair.objective, 1.0)
        steps = tuple(
            Step(form.name, form, (form.name,), 1.0, 1.0, gain, 0.1, 0.01, "", {}, {}, refit)
            for form in forms
        )
        first = fit_model(problem, (), fitted.values)
        alone = single_cause(Screen.of(first), pair, steps, CrossValidation(problem))
        assert alone is not None
        assert alone.step.effect == "thin_patches"
        assert abs(alone.step.strength - 0.2) < 3 * alone.step.standard_error
        # One of the two alone is no substitute for both.
        other = diagnose(
            drawn(forms, {"angle_offset.angle_deg": -0.5, "stray_light.level_per_sr": 0.015}, 12), sample, how
        )
    assert set(other.verdict.effects) == {"angle_offset", "stray_light"}


def test_a_nonlinearity_must_explain_more_than_another_effect():
    found, objective = Solution({}, (), 100.0, np.zeros(1), Mock(Search)), Mock(CandidateObjective)
    many, few = (Refit(effect, found, objective, 30.0) for effect in (Nonlinearity(1.0), StrayLight()))
    assert few.penalised(500) == pytest.approx(many.penalised(500) + Nonlinearity.handicap)
    # The data do not tell them apart all the same.
    assert few.is_like(many, 500, 4.0)


def figures(reduced):
    return Figures(0.1, 0.1, 0.1, 600 * reduced, 600, reduced, 0.5)


NO_REFIT = Mistake("more", "More light leaves than arrives", "normalise the values", None, None, True)
EXACT = Mistake("times_pi", "The values read like pi x BSDF", "divide by pi", 1.02, 1e5, True)


@pytest.fixture(scope="module")
def misfit():
    return jaxink.fit(drawn((AngleOffset(),), {"angle_offset.angle_deg": 2.0}, 34), parse_sample(SAMPLE), FIT)


@pytest.mark.parametrize(
    ("mistake", "code", "reduced", "expected"),
    [
        (NO_REFIT, VerdictCode.EXPLAINED, 1.01, VerdictCode.EXPLAINED),
        (NO_REFIT, VerdictCode.PARTLY_EXPLAINED, 3.0, VerdictCode.INPUT_MISTAKE),
        (EXACT, VerdictCode.EXPLAINED, 1.01, VerdictCode.INPUT_MISTAKE),
        (
            dataclasses.replace(EXACT, reduced_chi_square=2.5),
            VerdictCode.EXPLAINED,
            1.01,
            VerdictCode.EXPLAINED,
        ),
        (dataclasses.replace(EXACT, is_named=False), VerdictCode.EXPLAINED, 1.01, VerdictCode.EXPLAINED),
    ],
)
def test_a_mistake_stands_beside_effects(misfit, mistake, code, reduced, expected, told):
    declared = dataclasses.replace(misfit, mistakes=(mistake,))
    verdict, policy = Verdict(code, ("backing",), "Explained by a backing."), SearchPolicy()
    found = beside_mistakes(verdict, declared, figures(reduced), policy)
    assert found.code is expected
    assert explains_all((mistake,), policy) == (mistake is EXACT)
    if mistake.is_named:
        told(found.sentence, mistake.statement)
