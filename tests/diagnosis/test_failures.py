"""Whatever fails in a part of a diagnosis costs that part, and is told; it never costs the diagnosis."""

import dataclasses
import json
import logging

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.cli.diagnosis_tables import show_diagnosis
from jaxink.cli.fit_tables import console
from jaxink.diagnosis import VerdictCode, diagnose, load_diagnosis
from jaxink.diagnosis.search.candidate_objective import CandidateObjective
from jaxink.effects import AreaWithOtherSample, FinerDiscretisation, ReadingEffect
from jaxink.effects.instrument import Drift, StrayLight
from jaxink.report import write_report
from jaxink.sample import Parameter, parse_sample
from tests.diagnosis.test_loop import OPTIONS, SAMPLE, drawn


class Now:
    """The task of the diagnosis at present, in which an effect fails, and how."""

    task, fails_in, step, reads_nan = "", "", 0, False


def follow(what, step, misfit):
    Now.task, Now.step = what, step


def _read(value):
    one = np.float32(1)
    if not Now.fails_in or not f"{Now.task} {Now.step}".startswith(Now.fails_in):
        return one
    if Now.reads_nan:
        return one * np.float32(np.nan)
    raise OSError("the table of the lens is gone")


@jax.custom_jvp
def read(value):
    """The value, read again by Python whenever a compiled program runs."""
    shape = jax.ShapeDtypeStruct((), np.float32)
    return value * jax.pure_callback(_read, shape, jnp.float32(value), vmap_method="sequential")


@read.defjvp
def _(primals, tangents):
    return read(*primals), tangents[0]


class Own(ReadingEffect):
    """More light at grazing angles, unless it fails."""

    name, statement = "own", "something of one's own"
    terms = (Parameter("own.strength", 0.0, True, 0.0, 1.0),)

    def change(self, predicted, values, field):
        gain = read(jnp.asarray(values["own.strength"], float))
        return predicted * (1 + gain * (field.scene.theta_o_deg / 90) ** 4)


def parameter(name):
    return Parameter(f"{name}.strength", 0.0, True, 0.0, 1.0)


class WithoutForms(Own):
    name, terms = "no_forms", (parameter("no_forms"),)

    @classmethod
    def forms(cls, case):
        raise KeyError("lens")


class NotTraceable(Own):
    name, terms = "not_traceable", (parameter("not_traceable"),)

    def change(self, predicted, values, field):
        return predicted if values["not_traceable.strength"] > 0 else predicted * 1.0


class NotFinite(Own):
    name, terms = "not_finite", (parameter("not_finite"),)

    def change(self, predicted, values, field):
        return predicted + values["not_finite.strength"] / 0.0


class WithoutSlope(Own):
    name, terms = "no_slope", (parameter("no_slope"),)

    def change(self, predicted, values, field):
        return predicted * (1 + jnp.sqrt(values["no_slope.strength"]))


class NotFiniteWhereScreened(Own):
    name = "not_screened"
    terms = (parameter("not_screened"), Parameter("not_screened.width", 1.0, True, 0.0, 2.0))
    settings = ({"not_screened.width": 0.0},)

    def change(self, predicted, values, field):
        return predicted * (1 + values["not_screened.strength"] / values["not_screened.width"])


class AreaOfNothing(AreaWithOtherSample):
    name, statement = "area", "a share of the area is missing"
    terms = (parameter("area"),)

    def other(self, sample):
        raise MemoryError


class NoResolution(FinerDiscretisation):
    name, statement = "resolution", "the resolution is unknown"
    terms = (parameter("resolution"),)

    def refined(self, config):
        return dataclasses.replace(config, n_streams=None)


REASONS = {
    WithoutForms: "KeyError: 'lens'",
    NotTraceable: "TracerBoolConversionError",
    NotFinite: "not finite",
    WithoutSlope: "not finite",
    NotFiniteWhereScreened: "not finite",
    AreaOfNothing: "MemoryError",
    NoResolution: "n_streams",
}


@pytest.fixture(scope="module")
def lit():
    return drawn((StrayLight(),), {"stray_light.level_per_sr": 0.015}, 12)


@pytest.fixture(autouse=True)
def sound():
    Now.fails_in, Now.reads_nan = "", False
    yield
    Now.fails_in, Now.reads_nan = "", False


@pytest.fixture(scope="module")
def complete(lit):
    """Diagnosis in which nothing fails."""
    return diagnosed(lit, Own)


def diagnosed(data, *effects):
    options = dataclasses.replace(OPTIONS, catalogue=(StrayLight, *effects, Drift))
    return diagnose(data, parse_sample(SAMPLE), options, follow)


def require_right_name(found):
    assert found.verdict.code is VerdictCode.INSTRUMENT
    assert found.verdict.effects == ("stray_light",)
    (step,) = found.steps
    assert abs(step.strength - 0.015) < 4 * step.standard_error
    assert {row.effect for row in found.candidates} >= {"stray_light", "drift"}


def test_effects_that_fail_before_their_refits_are_left_out_and_named(lit, caplog):
    with caplog.at_level(logging.DEBUG, "jaxink"):
        found = diagnosed(lit, *REASONS)
    require_right_name(found)
    failures = {failure.name: failure for failure in found.failures}
    assert len(failures) == len(found.failures)
    assert failures.keys() == {effect.name for effect in REASONS}
    for effect, reason in REASONS.items():
        failure = failures[effect.name]
        assert effect.name in failure.part
        assert reason in failure.reason
        assert any(record.exc_info and effect.name in record.getMessage() for record in caplog.records)
    # The verdict has the first ones in words and counts the others.
    told = [failure for failure in found.failures if failure.sentence in found.verdict.sentence]
    assert found.failures[: len(told)] == tuple(told)
    assert f"{len(REASONS) - len(told)} more parts failed" in found.verdict.sentence


@pytest.mark.parametrize("reads_nan", [False, True])
def test_an_effect_that_fails_in_its_refit_is_left_out_and_told_everywhere(
    lit, reads_nan, tmp_path, capsys, told
):
    Now.fails_in, Now.reads_nan = "refit with own", reads_nan
    found = diagnosed(lit, Own)
    require_right_name(found)
    (failure,) = found.failures
    told(failure.sentence, "own")
    assert ("not finite" if reads_nan else "the table of the lens is gone") in failure.reason
    (row,) = (row for row in found.candidates if row.effect == "own")
    assert row.refit_delta_chi_square is None
    assert row.p_adjusted < OPTIONS.level
    write_report(found, tmp_path, with_figures=False)
    show_diagnosis(console(), found)
    page = (tmp_path / "report.html").read_text(encoding="utf-8").replace("&#x27;", "'")
    assert failure.sentence in page
    assert capsys.readouterr().out.count(failure.sentence) == 2
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["failures"] == [failure._asdict()]
    assert load_diagnosis(tmp_path, (Own,)).verdict == found.verdict


@pytest.mark.parametrize("reads_nan", [False, True])
def test_a_fold_that_fails_costs_that_fold(lit, complete, reads_nan):
    assert complete.failures == ()
    Now.fails_in, Now.reads_nan = "held out with stray_light 2", reads_nan
    found = diagnosed(lit, Own)
    require_right_name(found)
    (failure,) = found.failures
    assert failure.part == "the fit of the model with stray_light without fold 2 of 4"
    ((step,), (same,)) = found.steps, complete.steps
    np.testing.assert_allclose(step.held_out_gain.gains, np.delete(same.held_out_gain.gains, 1), rtol=1e-6)
    assert found.after.held_out.degrees_of_freedom < complete.after.held_out.degrees_of_freedom
    assert found.before.held_out == complete.before.held_out
    missing = [row["held_out_relative_rms_after"] for row in found.to_dict()["scans"]]
    assert [value is None for value in missing].count(True) == 1


def test_a_candidate_that_no_fold_can_test_is_not_accepted(lit):
    Now.fails_in = "held out with stray_light"
    found = diagnosed(lit, Own)
    assert "stray_light" not in {step.effect for step in found.steps}
    assert len([f for f in found.failures if "stray_light without fold" in f.part]) == 4
    assert found.declared.converged


def test_numerical_errors_of_a_fit_cost_what_it_was_for(lit, monkeypatch):
    """As of a factorisation that does not converge, wherever it is."""

    def fit(self, *args, original=CandidateObjective.fit, **kwargs):
        if Now.task == "refit with drift":
            raise np.linalg.LinAlgError("SVD did not converge")
        return original(self, *args, **kwargs)

    monkeypatch.setattr(CandidateObjective, "fit", fit)
    found = diagnosed(lit, Own)
    require_right_name(found)
    (failure,) = found.failures
    assert failure == ("the refit with drift", "drift", "LinAlgError: SVD did not converge")


def test_detection_limits_that_cannot_be_verified_are_those_of_the_screen(monkeypatch):
    def fit_near(self, *args, original=CandidateObjective.fit_near, **kwargs):
        if Now.task == "detection limit, drift":
            raise FloatingPointError
        return original(self, *args, **kwargs)

    monkeypatch.setattr(CandidateObjective, "fit_near", fit_near)
    found = diagnosed(drawn((), {}, 11), Own)
    assert found.verdict.code is VerdictCode.NO_MISFIT
    (failure,) = found.failures
    assert failure.name == "drift"
    assert failure.reason == "FloatingPointError"


def test_an_interruption_and_what_the_caller_raises_get_through(lit):
    class Interrupted(Own):
        @classmethod
        def forms(cls, case):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        diagnosed(lit, Interrupted)

    def stop(what, step, misfit):
        if what == "refit with stray_light":
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        diagnose(lit, parse_sample(SAMPLE), OPTIONS, stop)
