"""A time limit ends a diagnosis anywhere, and never makes it claim what was not looked at."""

import dataclasses
import functools
import json

import numpy as np
import pytest

import jaxink
from jaxink.diagnosis import OptionalTask, VerdictCode, diagnose, load_diagnosis
from jaxink.diagnosis.search.deadline import Deadline
from jaxink.effects.instrument import AngleOffset, StrayLight
from jaxink.errors import InputRefusedError
from jaxink.report import write_report
from jaxink.sample import parse_sample
from tests.diagnosis.test_loop import OPTIONS, SAMPLE, drawn

PAIR = (AngleOffset(), StrayLight()), {"angle_offset.angle_deg": -0.5, "stray_light.level_per_sr": 0.015}


class Ticks:
    """A clock that advances one second each time it is read."""

    def __init__(self):
        self.reads = 0

    def __call__(self):
        self.reads += 1
        return float(self.reads)


def ending_after(data, seconds, clock=None):
    """A diagnosis that ends after so many looks at its clock."""
    deadline = functools.partial(Deadline, clock=clock or Ticks())
    options = dataclasses.replace(OPTIONS, time_limit_s=float(seconds))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jaxink.diagnosis.procedure.Deadline", deadline)
        return diagnose(data, parse_sample(SAMPLE), options)


def complete_and_looks(data):
    """A diagnosis whose limit is not reached, and how often it looks at its clock."""
    clock = Ticks()
    return ending_after(data, 1e6, clock), clock.reads


@pytest.fixture(scope="module")
def complete():
    return complete_and_looks(drawn(*PAIR, 12))


@pytest.fixture(scope="module")
def complete_without_misfit():
    return complete_and_looks(drawn((), {}, 11))


def test_a_limit_that_is_not_reached_changes_nothing(complete):
    found, _ = complete
    assert found.verdict.code is VerdictCode.INSTRUMENT
    assert found.time_limit.not_done == ()
    assert found.to_dict()["time_limit"]["limit_s"] == 1e6
    assert found.time_limit.elapsed_s > 1


@pytest.mark.parametrize("share", [0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9])
def test_wherever_it_ends_the_verdict_claims_no_more_than_was_done(complete, share):
    whole, looks = complete
    found = ending_after(whole.declared.data, 1 + share * looks)
    not_done = {omission.task for omission in found.time_limit.not_done}
    assert not_done
    # The declared fit is always there.
    assert found.declared.converged
    assert found.declared.values == pytest.approx(whole.declared.values)
    assert found.verdict.code is VerdictCode.UNFINISHED
    assert not found.verdict.code.fits_noise
    assert found.structure_remains == (found.after.fitted.probability < 1e-3)
    # What is stated is true: the effects of both runs are accepted by the same tests.
    assert {step.effect for step in found.steps} <= {step.effect for step in whole.steps}
    assert "time limit" in found.verdict.sentence


@pytest.mark.parametrize("share", [0.0, 0.2, 0.4, 0.6])
def test_without_misfit_an_early_end_says_so_only_after_all_tests(complete_without_misfit, share):
    whole, looks = complete_without_misfit
    assert whole.verdict.code is VerdictCode.NO_MISFIT
    found = ending_after(whole.declared.data, 1 + share * looks)
    assert found.time_limit.not_done
    assert not found.structure_remains
    screened = {row.effect for row in found.candidates} == {row.effect for row in whole.candidates}
    code = VerdictCode.NO_MISFIT if screened else VerdictCode.UNFINISHED
    assert found.verdict.code is code


def test_at_once_only_the_fit_is_done(complete, tmp_path, told):
    found = ending_after(complete[0].declared.data, 1.0)
    left_out = {omission.task: omission.names for omission in found.time_limit.not_done}
    assert set(left_out) == {OptionalTask.INPUT_CHECK, OptionalTask.SCREEN, OptionalTask.HELD_OUT}
    assert set(left_out[OptionalTask.SCREEN]) == {row.effect for row in complete[0].candidates}
    assert found.candidates == ()
    assert found.before.held_out is None
    told(found.verdict.sentence)
    for omission in found.time_limit.not_done:
        told(omission.described())
    write_report(found, tmp_path, with_figures=False)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert all(omission.described() in page for omission in found.time_limit.not_done)
    report = json.loads((tmp_path / "report.json").read_text())
    assert [row["task"] for row in report["time_limit"]["not_done"]] == [*left_out]
    assert report["before"]["held_out"] is None
    assert load_diagnosis(tmp_path).verdict.code is VerdictCode.UNFINISHED
    assert jaxink.load_result(tmp_path / "declared").converged


def test_unverified_detection_limits_are_named(complete_without_misfit, told):
    """They come last in a diagnosis that finds nothing; the verdict does not rest on them."""
    whole, looks = complete_without_misfit
    found = ending_after(whole.declared.data, looks - 3)
    (left_out,) = found.time_limit.not_done
    assert left_out.task is OptionalTask.LIMIT
    assert set(left_out.names) < {row.effect for row in found.candidates}
    assert found.verdict.code is VerdictCode.NO_MISFIT
    told(found.verdict.sentence)


def test_a_limit_is_a_positive_number(told):
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(InputRefusedError) as problem:
            jaxink.DiagnosisOptions(time_limit_s=wrong)
        told(str(problem.value))
