"""The whole procedure on small simulated cases: nothing where nothing is, and the effect where one is."""

import dataclasses
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.stats import chi2

import jaxink
from jaxink.diagnosis import (
    DiagnosisOptions,
    Points,
    SearchPolicy,
    Testability,
    VerdictCode,
    diagnose,
    scan_folds,
    transfer,
)
from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.diagnosis.search.candidate_refits import polished
from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.model import FittedModel
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.diagnosis.search.refit import Refit
from jaxink.effects import Case, ReadingEffect, Scene
from jaxink.effects.constants import PlateAbsorption
from jaxink.effects.geometry import ThinPatches
from jaxink.effects.instrument import AngleOffset, Drift, Gain, StrayLight
from jaxink.effects.surfaces import RoughInk
from jaxink.fitting import predict_left_out
from jaxink.fitting.objective import weights_of
from jaxink.fitting.outcome import Outcome, Search
from jaxink.sample import Parameter, ResidualWeight, parse_sample
from tests.diagnosis.printed import SAMPLE, SIZES, TRUE, columns, drawn

CATALOGUE = (AngleOffset, StrayLight, Drift, PlateAbsorption)


class Rounding(ReadingEffect):
    """Changes no more than the last digits."""

    name, statement = "rounding", "digits are lost"
    terms = (Parameter("rounding.strength", 0.0, True, 0.0, 1.0),)

    def change(self, predicted, values, field):
        """A ripple far below the noise."""
        return predicted * (1 + 1e-13 * values["rounding.strength"] * field.scene.theta_o_deg)


OPTIONS = DiagnosisOptions(fit=jaxink.FitOptions(profile="none", config=SIZES), catalogue=CATALOGUE)


@pytest.fixture(scope="module")
def nothing():
    options = dataclasses.replace(OPTIONS, catalogue=(*CATALOGUE, Rounding))
    return diagnose(drawn((), {}, 11), parse_sample(SAMPLE), options)


@pytest.fixture(scope="module")
def pair():
    effects, strengths = (
        (AngleOffset(), StrayLight()),
        {
            "angle_offset.angle_deg": -0.5,
            "stray_light.level_per_sr": 0.015,
        },
    )
    return diagnose(drawn(effects, strengths, 12), parse_sample(SAMPLE), OPTIONS)


def test_nothing_is_found_where_nothing_is(nothing):
    assert nothing.verdict.code is VerdictCode.NO_MISFIT
    assert nothing.steps == ()
    assert nothing.before.fitted.probability > 0.01
    assert nothing.after is nothing.before
    assert {row.effect for row in nothing.candidates} == {*(e.name for e in CATALOGUE), "rounding"}


def test_rounding_is_no_direction(nothing, told):
    status = {row.effect: (row.status, row.reason) for row in nothing.candidates}
    testability, changes_nothing = status.pop("rounding")
    assert testability is Testability.NOT
    told(changes_nothing)
    assert all(reason != changes_nothing for _, reason in status.values())


def test_a_limit_says_whether_it_is_a_share_of_the_area():
    scene = Scene.of(*columns(), np.arange(columns()[0].size))
    (rough, *_) = RoughInk.forms(Case(parse_sample(SAMPLE), scene))
    (offset,) = AngleOffset.forms(Case(parse_sample(SAMPLE), scene))
    units = [Direction(e, e.settings[0], np.ones(3), 1.0).unit for e in (rough, offset)]
    assert units == ["share", "deg"]


def test_two_effects_of_the_instrument_are_found_and_measured(pair):
    assert pair.verdict.code is VerdictCode.INSTRUMENT
    assert set(pair.verdict.effects) == {"angle_offset", "stray_light"}
    found = {step.effect: step for step in pair.steps}
    for name, true in (("angle_offset", -0.5), ("stray_light", 0.015)):
        assert abs(found[name].strength - true) < 3 * found[name].standard_error
        assert found[name].members == (name,)
        assert found[name].held_out_gain.improves
    assert pair.before.fitted.reduced_chi_square > 3
    assert pair.after.fitted.probability > 0.001
    assert pair.after.held_out.chi_square < pair.before.held_out.chi_square


def test_what_is_compared_need_not_converge_but_what_is_accepted_does(pair):
    coarse = SearchPolicy(refit_jacobians=2, polish_decrement=1.0, held_out_decrement=0.1)
    options = dataclasses.replace(OPTIONS, policy=coarse)
    found = diagnose(pair.declared.data, parse_sample(SAMPLE), options)
    assert found.verdict.effects == pair.verdict.effects
    for step, same in zip(found.steps, pair.steps, strict=True):
        assert step.refit.solution.search.outcome.converged
        assert step.refit.solution.search.decrement < 1e-6 * pair.before.fitted.reduced_chi_square
        assert abs(step.strength - same.strength) < 0.01 * same.standard_error
        assert step.held_out_gain.mean == pytest.approx(same.held_out_gain.mean, rel=0.03)


@pytest.mark.parametrize(("each", "rounds"), [(0.1, 1), (0.5, 4), (0.0, 1)])
def test_a_refit_is_continued_as_long_as_that_lowers_chi_square_noticeably(each, rounds):
    searched = Mock(Search, outcome=Outcome.MAX_STEPS)
    asked = []

    def fit(values, free, max_jacobians, decrement):
        asked.append(max_jacobians)
        return Solution({}, (), 100.0 - each * len(asked), np.zeros(1), searched)

    declared = Solution({}, (), 120.0, np.zeros(1), searched)
    problem = Mock(SearchProblem, policy=SearchPolicy())
    model = Mock(FittedModel, problem=problem, solution=declared)
    effect = StrayLight()
    begun = Refit(
        effect, dataclasses.replace(declared, chi_square=100.0), Mock(CandidateObjective, fit=fit), 20.0
    )
    done = polished(model, begun)
    assert asked == [10] * rounds
    assert done.effect is effect
    assert done.delta_chi_square == pytest.approx(20 + rounds * each)
    assert polished(model, done) is done


def test_no_more_parameters_are_freed_than_allowed(pair):
    limited = dataclasses.replace(OPTIONS, max_parameters=len(TRUE) + 1)
    found = diagnose(pair.declared.data, parse_sample(SAMPLE), limited)
    assert len(found.steps) == 1
    assert found.verdict.code is VerdictCode.PARTLY_EXPLAINED
    assert len(found.parameters_after) == len(TRUE) + 1


def test_parameters_come_back_to_the_truth(pair):
    for name, true in TRUE.items():
        before, _ = pair.parameters_before[name]
        after, error = pair.parameters_after[name]
        assert abs(after - true) < 3 * error
        assert abs(before - true) > abs(after - true)


def test_an_effect_outside_the_catalogue_leaves_structure():
    measured = drawn(
        (ThinPatches("ink"),), {"thin_patches.share": 0.3, "thin_patches.thickness_ratio": 0.1}, 13
    )
    found = diagnose(measured, parse_sample(SAMPLE), dataclasses.replace(OPTIONS, max_effects=1))
    assert found.verdict.code.structure_remains
    assert found.structure_after.p_value < 0.01


def test_report_is_plain_and_complete(pair, tmp_path):
    import json

    text = pair.save(tmp_path).read_text()
    report = json.loads(text)
    assert report == pair.to_dict()
    assert report["verdict"]["effects"] == list(pair.verdict.effects)
    for when in ("before", "after"):
        for figures in (report[when], report[when]["held_out"]):
            assert {"rmsd_absolute", "rmsd_relative", "relative_rms", "reduced_chi_square"} <= set(figures)
    asked = {
        "effect",
        "z",
        "p_raw",
        "p_adjusted",
        "degenerate_fraction",
        "detection_limit",
        "strength",
        "class",
    }
    assert all(asked | {"refit_delta_chi_square"} <= set(row) for row in report["candidates"])


@pytest.fixture(scope="module")
def weighted(pair):
    """A description without two effects; reflection and one incidence count less, nothing is added."""
    sample = dataclasses.replace(
        parse_sample(SAMPLE), weights=(ResidualWeight(0.1, side="R"), ResidualWeight(0.3, 50.0, "T"))
    )
    return diagnose(pair.declared.data, sample, dataclasses.replace(OPTIONS, max_effects=0))


def test_weights_are_those_of_the_fit(weighted, pair):
    found = {name: value for name, (value, _) in weighted.parameters_before.items()}
    fitted = {name: weighted.declared[name].value for name in found}
    assert found == pytest.approx(fitted, rel=1e-5)
    error = pair.declared["ink.scattering_per_mm"].standard_error
    assert abs(fitted["ink.scattering_per_mm"] - pair.declared["ink.scattering_per_mm"].value) > 3 * error
    count = weights_of(weighted.declared.data, weighted.declared.sample)
    assert weighted.before.fitted.chi_square == pytest.approx(np.sum(count * weighted.declared.whitened**2))


def test_weights_count_where_scans_are_held_out(weighted):
    points = Points.of(weighted.declared.data)
    folds = scan_folds(points.scan)
    by_fits = predict_left_out(weighted.declared, folds)
    unseen = np.sum(np.where(folds, by_fits, 0.0), axis=0)
    assert weighted.before.held_out_per_sr == pytest.approx(unseen, rel=1e-4)


def test_weights_count_where_a_model_goes_on(weighted):
    there = drawn((StrayLight(),), {"stray_light.level_per_sr": 0.015}, 15)
    refitted = transfer(weighted, there, is_refitted=True)
    fitted = jaxink.fit(there, weighted.declared.sample, OPTIONS.fit)
    for name in TRUE:
        assert refitted.values[name] == pytest.approx(fitted[name].value, rel=1e-4)
    assert np.sum(refitted.whitened**2) == pytest.approx(fitted.merit.chi_square, rel=1e-4)


def test_points_of_weight_0_are_not_judged(nothing):
    spoilt = nothing.declared.data
    values = np.where(spoilt.is_transmission, spoilt.bsdf_per_sr, 1.3 * spoilt.bsdf_per_sr)
    sample = dataclasses.replace(parse_sample(SAMPLE), weights=(ResidualWeight(0.0, side="R"),))
    found = diagnose(spoilt.replace(bsdf_per_sr=values), sample, OPTIONS)
    assert found.verdict.code is VerdictCode.NO_MISFIT
    assert np.array_equal(found.declared.data.used, spoilt.is_transmission)


def test_two_effects_of_one_name_are_refused(refused):
    with refused("gain"):
        DiagnosisOptions(catalogue=(Gain, Gain))


def test_a_model_goes_on_to_another_measurement(pair):
    there = drawn(
        (AngleOffset(), StrayLight()),
        {"angle_offset.angle_deg": -0.5, "stray_light.level_per_sr": 0.015},
        14,
    )
    predicted = transfer(pair, there, is_refitted=False)
    assert chi2.sf(np.sum(predicted.whitened**2), len(there)) > 1e-3
    refitted = transfer(pair, there, is_refitted=True)
    assert np.sum(refitted.whitened**2) < np.sum(predicted.whitened**2)
    for name, true in TRUE.items():
        assert abs(refitted.values[name] - true) < 3.5 * refitted.standard_errors[name]
