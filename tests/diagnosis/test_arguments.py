"""Arguments of the library's functions that cannot be meant are refused before anything is computed."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest

import jaxink
from tests.samples import PRINTED_INK

ANGLES = [10.0, 20.0]
# In a process without the tests' own check of types, which would be first.
OF_ANOTHER_KIND = """
import sys
import jaxink
from jaxink.errors import InputRefusedError

sample = jaxink.parse_sample(sys.stdin.read())
one = [1.0]
data = jaxink.GonioData(one, one, one, [550.0], [False], one)
for call in (
    lambda: jaxink.fit(sample, data),
    lambda: jaxink.predict(data, sample),
    lambda: jaxink.diagnose(data, {"layers": []}),
    lambda: jaxink.fit(data, sample, jaxink.DiagnosisOptions()),
    lambda: jaxink.diagnose(data, sample, jaxink.FitOptions()),
    lambda: jaxink.DiagnosisOptions(n_bootstrap=250.5),
    lambda: jaxink.DiagnosisOptions(level="5 %"),
    lambda: jaxink.DiagnosisOptions(catalogue=("blur",)),
    lambda: jaxink.FitOptions(starts=True),
    lambda: jaxink.FitOptions(accuracy="high"),
    lambda: jaxink.FitOptions(config=16),
    lambda: jaxink.ink_table(data),
    lambda: jaxink.ink_table(sample, options={"n_theta": 61}),
    lambda: jaxink.ink_table(sample, wavelengths_nm="red"),
    lambda: sample.parameters.replace("ink.thickness_um", value="60"),
    lambda: jaxink.fit(data.to_frame(), sample),
):
    try:
        call()
    except InputRefusedError as error:
        print(error)
"""
NAMED = (
    "data",
    "data",
    "sample",
    "options",
    "options",
    "n_bootstrap",
    "level",
    "blur",
    "starts",
    "accuracy",
)
NAMED += ("config", "source", "options", "wavelengths_nm", "ink.thickness_um", "jaxink.read")


def sample_with(**changes):
    sample = jaxink.parse_sample(PRINTED_INK)
    table = sample.parameters.replace("ink.scattering_per_mm", **changes)
    return dataclasses.replace(sample, parameters=table)


def test_another_kind_of_argument(told):
    command = [sys.executable, "-c", OF_ANOTHER_KIND]
    done = subprocess.run(command, input=PRINTED_INK, capture_output=True, text=True, timeout=120)
    for sentence, named in zip(done.stdout.splitlines(), NAMED, strict=True):
        told(sentence, named)


@pytest.mark.parametrize(
    ("options", "choice", "named"),
    [
        (jaxink.DiagnosisOptions, {"max_effects": -1}, "max_effects"),
        (jaxink.DiagnosisOptions, {"max_parameters": 0}, "max_parameters"),
        (jaxink.DiagnosisOptions, {"n_bootstrap": 100}, "n_bootstrap"),
        (jaxink.DiagnosisOptions, {"level": 0.9}, "level"),
        (jaxink.FitOptions, {"starts": 10**11}, "starts"),
        (jaxink.DiagnosisOptions, {"n_bootstrap": 10**14}, "n_bootstrap"),
        (jaxink.FitOptions, {"starts": 0}, "starts"),
        (jaxink.SolverConfig, {"n_orders": 0}, "n_orders"),
    ],
)
def test_choices_outside_their_range(options, choice, named, refused):
    with refused(named):
        options(**choice)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"value": float("nan")}, "ink.scattering_per_mm"),
        ({"minimum": 5.0, "maximum": 1.0}, "ink.scattering_per_mm"),
        ({"scale": "square"}, "ink.scattering_per_mm"),
    ],
)
def test_parameters_that_are_none(changes, named, refused):
    with refused(named):
        sample_with(**changes)


@pytest.mark.parametrize("function", [jaxink.predict, lambda sample, data: jaxink.fit(data, sample)])
def test_value_outside_its_range(function, refused):
    same = np.ones(2)
    data = jaxink.GonioData(20 * same, ANGLES, 0 * same, 550 * same, [False, False], same)
    with refused("ink.scattering_per_mm"):
        function(sample_with(value=-5.0), data)
    # A fit that ends on a bound may be off by rounding.
    sample_with(value=1.0 - 1e-15).parameters.require_ranges()


@pytest.mark.parametrize(
    ("theta_i", "theta_o", "named"),
    [
        ([20.0, 20.0], [10.0, 100.0], "theta_o_deg"),
        ([20.0, -20.0], ANGLES, "theta_i_deg"),
        ([20.0, 20.0], [10.0], "theta_o_deg"),
    ],
)
def test_points_of_a_model(theta_i, theta_o, named, refused):
    with refused(named):
        jaxink.ForwardModel(sample_with(), theta_i, theta_o, [0.0, 0.0], [550.0, 550.0], [False, False])
