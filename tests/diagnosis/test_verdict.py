"""Verdicts from what was found and what is left."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest

from jaxink.diagnosis import (
    CandidateRow,
    Figures,
    HeldOutGain,
    Location,
    SmoothPart,
    Step,
    StructureResult,
    StructureStatistic,
    Summary,
    Testability,
    VerdictCode,
)
from jaxink.diagnosis.findings.consistency import Consistency
from jaxink.diagnosis.findings.further_measurements import FurtherMeasurement, menu_of
from jaxink.diagnosis.findings.judgement import (
    Evidence,
    fits_noise,
    judge,
    significant_tests,
    tightened_by_repeats,
)
from jaxink.diagnosis.findings.location import NOWHERE
from jaxink.diagnosis.policy import DEFAULT_POLICY
from jaxink.effects import invalidity
from jaxink.effects.constants import PlateThickness
from jaxink.effects.geometry import LateralLoss, UndeclaredBacking
from jaxink.effects.instrument import StrayLight
from jaxink.effects.surfaces import WaveSurface
from jaxink.effects.volume import ShadowHiding
from jaxink.sample import Parameter


def summary(reduced, probability, freedom=600):
    figures = Figures(0.01, 0.02, 0.02, reduced * freedom, freedom, reduced, probability)
    return Summary(figures, figures, *(np.zeros(1),) * 3)


def structure(p_value):
    order = StructureStatistic("runs", 0.0, p_value, 0, p_value)
    size = StructureStatistic("chi_square", 0.0, 0.5, -1, np.nan)
    return StructureResult((size, order), p_value, "runs", 600.0, 600)


def test_a_reader_is_told_the_field_of_view_and_how_much_a_constant_differs():
    field = dataclasses.replace(step(LateralLoss(1.0)), strength=-940.0)
    thickness = step(PlateThickness(Parameter("plate.thickness_mm", 2.0, True, 0.1, 10.0, "mm")))
    assert field.shown == 60.0
    assert thickness.shown == thickness.strength


def step(form, *others):
    gain = HeldOutGain(np.array([5.0, 6.0]))
    return Step(form.name, form, (form.name, *others), 50.0, 60.0, gain, 0.1, 0.01, "", {}, {}, None)


NOISE, LEFT = (summary(1.0, 0.5), structure(0.4)), (summary(4.0, 0.0), structure(5e-4))
SMOOTH = SmoothPart(np.zeros(1), np.zeros(1), 0.5, 1.0, 10.0, 0.01)
LOCATION = Location("positive in reflection", (), SMOOTH)
HARD = CandidateRow(
    "gain", 0.1, 0.5, 0.9, 0.99, 0.1, "", 0.0, "", ("gain",), 0.0, None, Testability.HARDLY, ""
)


def verdict(steps, after, before=LEFT[0]):
    return judge(Evidence(tuple(steps), before, *after, LOCATION, (HARD,)))


@pytest.mark.parametrize(
    ("steps", "after", "code", "effects"),
    [
        ([step(UndeclaredBacking())], NOISE, VerdictCode.EXPLAINED, ("backing",)),
        ([step(UndeclaredBacking(), "gain")], NOISE, VerdictCode.EXPLAINED_BY_ONE_OF, ("backing", "gain")),
        ([step(StrayLight())], NOISE, VerdictCode.INSTRUMENT, ("stray_light",)),
        (
            [step(StrayLight()), step(UndeclaredBacking())],
            NOISE,
            VerdictCode.EXPLAINED,
            ("stray_light", "backing"),
        ),
        (
            [step(StrayLight(), "gain"), step(UndeclaredBacking(), "gain")],
            NOISE,
            VerdictCode.EXPLAINED_BY_ONE_OF,
            ("stray_light", "backing", "gain"),
        ),
        ([step(UndeclaredBacking())], LEFT, VerdictCode.PARTLY_EXPLAINED, ("backing",)),
        ([], LEFT, VerdictCode.UNEXPLAINED_STRUCTURE, ()),
        ([], NOISE, VerdictCode.NO_MISFIT, ()),
    ],
)
def test_codes(steps, after, code, effects, told):
    found = verdict(steps, after)
    assert (found.code, found.effects) == (code, effects)
    told(found.sentence, *effects)


def test_codes_and_meanings_are_those_of_the_page():
    page = (Path(__file__).parents[2] / "docs" / "manual" / "diagnosis.md").read_text(encoding="utf-8")
    for code in VerdictCode:
        exit_code = 3 if code.structure_remains else 6 if code is VerdictCode.UNFINISHED else 0
        assert f"| `{code}` | {code.meaning} | {exit_code} |" in page
    assert len(re.findall(r"^\| `\w+` \| .* \| [036] \|$", page, re.MULTILINE)) == len(VerdictCode)


def test_what_is_left_is_located_and_what_is_hard_to_see_is_named(told):
    told(verdict([], LEFT).sentence, LOCATION.sentence)
    told(verdict([], NOISE, NOISE[0]).sentence, "gain")


def test_no_more_points_than_parameters_is_not_testable():
    assert verdict([], NOISE, summary(0.0, None, 0)).code is VerdictCode.NOT_TESTABLE


def test_noise_that_is_stated_a_little_too_small_is_no_misfit():
    assert fits_noise(summary(1.15, 1e-5), structure(0.3))
    assert not fits_noise(summary(1.3, 1e-9), structure(0.3))
    assert not fits_noise(summary(1.25, 0.01, 40), structure(4e-4))
    assert fits_noise(summary(1.25, 0.01, 40), structure(0.3))


def test_an_order_within_the_noise_is_no_misfit_but_the_code_shows_it(told):
    small = (summary(1.15, 1e-5), structure(4e-4))
    assert fits_noise(*small)
    found = verdict([], small, small[0])
    assert found.code is VerdictCode.ORDER_REMAINS
    assert not found.code.structure_remains
    assert not found.code.fits_noise
    told(found.sentence, LOCATION.sentence)
    added = verdict([step(StrayLight())], small, LEFT[0])
    assert (added.code, added.effects) == (VerdictCode.ORDER_REMAINS, ("stray_light",))
    told(added.sentence, LOCATION.sentence)
    assert LOCATION.sentence not in verdict([], NOISE, NOISE[0]).sentence


def test_no_misfit_says_when_chi_square_is_improbable_all_the_same(told):
    small = (summary(1.15, 1e-5), structure(0.3))
    found = verdict([], small, small[0])
    assert found.code is VerdictCode.NO_MISFIT
    assert "consistent with noise" not in told(found.sentence, "p = 1e-05", "1.15")
    assert "consistent with noise" in verdict([], NOISE, NOISE[0]).sentence
    told(verdict([step(StrayLight())], small).sentence, "p = 1e-05")
    # Tests of the order say more than chi-square.
    assert "level is known" not in verdict([step(StrayLight())], (small[0], structure(4e-4))).sentence


def test_structure_without_a_smooth_part_is_named_by_the_tests_that_see_it(told):
    nowhere = Location(NOWHERE, (), SMOOTH)
    assert not nowhere.is_found
    assert LOCATION.is_found
    evidence = Evidence((), LEFT[0], *LEFT, nowhere, (HARD,))
    sentence = told(judge(evidence).sentence, "runs of one sign (p = 0.0005)")
    assert NOWHERE not in sentence
    assert [name for name, _ in significant_tests(LEFT[1], None)] == ["runs of one sign"]
    assert significant_tests(NOISE[1], None) == []


def test_what_the_model_itself_is_known_to_err_is_no_structure(told):
    left = (summary(1.24, 1e-6), structure(5e-4))
    evidence = Evidence((step(LateralLoss(1.0)),), LEFT[0], *left, LOCATION, (HARD,))
    assert judge(evidence).code is VerdictCode.PARTLY_EXPLAINED
    found = judge(dataclasses.replace(evidence, tolerated=0.25))
    assert found.code is VerdictCode.EXPLAINED
    told(found.sentence, "1.24")
    assert judge(dataclasses.replace(evidence, tolerated=0.2)).code is VerdictCode.PARTLY_EXPLAINED


def pairs(count, relative, expected):
    return Consistency("repeats", count, relative, expected, 0.5, False)


def test_pairs_that_tell_the_noise_well_leave_less_tolerance():
    many, few = pairs(1800, 0.01, 0.01), pairs(12, 0.01, 0.01)
    assert tightened_by_repeats((many,)).sigma_tolerance == pytest.approx(1 + 2 / 60)
    assert tightened_by_repeats((few,)).sigma_tolerance == DEFAULT_POLICY.sigma_tolerance
    # Noise that is stated too small, by the pairs, is tolerated as before.
    assert tightened_by_repeats((pairs(1800, 0.02, 0.01),)).sigma_tolerance == DEFAULT_POLICY.sigma_tolerance
    assert not fits_noise(summary(1.15, 1e-5), structure(0.3), tightened_by_repeats((many,)))
    assert fits_noise(summary(1.15, 1e-5), structure(0.3), tightened_by_repeats((few,)))


def test_values_that_mean_nothing_are_called_an_imitation(told):
    def judged(after):
        evidence = Evidence((step(StrayLight()),), LEFT[0], *after, LOCATION, (HARD,))
        return judge(dataclasses.replace(evidence, imitations={"stray_light": "it is at the end"}))

    fitting = judged(NOISE)
    assert fitting.code is VerdictCode.IMITATED
    assert fitting.code.structure_remains
    told(fitting.sentence, "stray_light: it is at the end")
    assert judged(LEFT).code is VerdictCode.PARTLY_EXPLAINED
    told(judged(LEFT).sentence, "stray_light: it is at the end", LOCATION.sentence)


def test_values_at_the_end_of_a_range_or_beyond_a_theory():
    effect = ShadowHiding()
    amplitude, width = effect.terms
    inside = {amplitude.name: 0.3, width.name: 0.1}
    assert not invalidity(effect, inside, [550.0])
    assert width.name in invalidity(effect, inside | {width.name: width.minimum}, [550.0])
    # All of the area, or none of the property, is possible.
    assert not invalidity(effect, inside | {amplitude.name: 1.0}, [550.0])
    waves = WaveSurface("ink", "back_roughness")
    height, length, exponent = (term.name for term in waves.terms)
    # At the exponent 4 of a smooth bend, the rms slope is about 2 pi sigma / B times sqrt(ln).
    for size, is_valid in ((0.05, True), (2.0 - 1e-2, False)):
        values = {height: size, length: 20.0, exponent: 4.0}
        assert bool(invalidity(waves, values, [600.0])) != is_valid


def test_a_measurement_that_tells_a_class_apart_is_named(told):
    def sentence(chi_square):
        further = (FurtherMeasurement(("backing", "gain"), "the plane at 75", chi_square),)
        steps = (step(UndeclaredBacking(), "gain"),)
        return judge(Evidence(steps, LEFT[0], *NOISE, LOCATION, (HARD,), further)).sentence

    told(sentence(25.0), "The plane at 75", "backing from gain", 25)
    assert "plane at 75" not in told(sentence(4.0), "backing from gain")


def test_menu_offers_what_was_not_measured(told):
    angle, view = np.meshgrid([0.0, 20.0, 70.0], np.arange(0.0, 80.0, 10.0), indexing="ij")
    phi, wave, side = (np.full(angle.size, v) for v in (180.0, 550.0, 1.0))
    in_plane = np.column_stack([angle.ravel(), view.ravel(), phi, wave, side])
    menu = menu_of(in_plane)
    in_it, across_it = menu
    told(in_it, 45)
    told(across_it, 70)
    added = menu[in_it]
    assert set(added[:, 0]) == {45.0}
    assert set(added[:, 4]) == {1.0}
    assert np.all(np.abs(added[:, 1] - 45.0) >= 4.0)
    assert set(menu[across_it][:, 2]) == {90.0, -90.0}
    across = np.column_stack([angle.ravel(), view.ravel(), np.full(angle.size, 60.0), wave, side])
    assert list(menu_of(across)) == [in_it]
