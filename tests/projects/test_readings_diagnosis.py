"""The diagnosis of readings: what an effect changes in them, and that it is named, where it is."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.diagnosis import DiagnosisOptions
from jaxink.diagnosis.joint.readings_screen import readings_directions
from jaxink.effects import CATALOGUE, declare
from jaxink.fitting import readings_objective
from jaxink.measurement import Readings
from jaxink.numerics.failures import Failures
from jaxink.projects import Measurement, Project
from tests.projects.conftest import SAMPLE, TRUTH

_NOISE = 0.003
_QUANTITIES = {"R_total": 8.0, "T_total": 8.0, "T_collimated": 0.0}
_OF = {effect.name: effect for effect in CATALOGUE}
OPTIONS = DiagnosisOptions(catalogue=tuple(_OF[name] for name in ("gain", "side_gain", "plate_absorption")))
_INK = jaxink.parse_sample(SAMPLE)


def read(sample, factor: float = 1.0, noise: float = 0.0, seed: int = 0) -> Readings:
    """Simulated readings of a sample."""
    n, rng = len(_QUANTITIES), np.random.default_rng(seed)
    none = np.full(n, np.nan)
    columns = np.array(list(_QUANTITIES)), np.array(list(_QUANTITIES.values())), none, none, np.full(n, 550.0)
    at = Readings(*columns, np.full(n, 0.5))
    value = factor * jaxink.predict(sample, at) * (1 + noise * rng.standard_normal(n))
    return dataclasses.replace(at, value=value, sigma=_NOISE * value)


def project_of(true_sample, factors: dict[int, float]) -> Project:
    """Three prints of one ink, by one instrument, whose readings of a print may be wrong by a factor."""
    measurements = []
    for seed, thickness_um in enumerate((10, 40, 80)):
        own = {"ink.thickness_um": float(thickness_um)}
        data = read(true_sample.replace(TRUTH | own), factors.get(thickness_um, 1.0), _NOISE, seed)
        sample, name = _INK.replace(own), f"print_{thickness_um}"
        names = {p: f"{name}/{p}" if p in own else p for p in sample.parameters}
        measurements.append(Measurement(name, data, sample, names))
    return Project(tuple(measurements))


@pytest.fixture(scope="module")
def without_other_causes():
    """What a fit itself tries of an outlier is for tests/projects/test_joint_fit.py."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jaxink.fitting.joint_fit.own_causes", lambda *_: ())
        yield


def test_an_effect_of_the_sample_is_named_in_all_readings(without_other_causes):
    absorbing = _INK.replace({"plate.absorption_per_mm": 0.05})
    found = jaxink.diagnose(project_of(absorbing, {}), options=OPTIONS)
    (step,) = found.steps
    assert (step.effect, step.where) == ("plate_absorption", "in all measurements")
    value = found.corrected["plate.absorption_per_mm"]
    assert abs(value.value - 0.05) < 3 * value.standard_error


def test_a_gain_of_one_print_is_named_as_its_own(without_other_causes):
    found = jaxink.diagnose(project_of(_INK, {40: 1.05}), options=OPTIONS)
    (step,) = found.steps
    assert (step.effect, step.where) == ("gain", "in 'print_40' alone")
    value = found.corrected[step.parameters[0]]
    assert abs(value.value - 0.05) < 3 * value.standard_error


@pytest.mark.parametrize("name", ["gain", "second_lobe", "depth_gradient"])
def test_columns_of_the_screen_are_what_an_effect_changes(name):
    sample, failures = _INK.replace(TRUTH), Failures()
    options = dataclasses.replace(OPTIONS, catalogue=(_OF[name],))
    readings = read(sample)
    part = readings_objective(readings, sample)
    directions = list(readings_directions(sample, readings, part, options, failures))
    assert directions
    for direction in directions:
        effect, strength = direction.effect, direction.effect.strength.name
        step = {strength: 1e-4} | direction.setting
        changed = jaxink.predict(declare(sample, (effect,), step), readings)
        per = 1.0 if strength in direction.setting else 1e-4
        expected = (changed - readings.value) / readings.sigma / per
        np.testing.assert_allclose(direction.column, expected, rtol=2e-3, atol=1e-3 * np.abs(expected).max())
    assert not failures.found
