"""Arguments of the library's functions that cannot be meant are refused before anything is computed."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
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
    lambda: jaxink.FitOptions(n_starts=True),
    lambda: jaxink.FitOptions(accuracy="high"),
    lambda: jaxink.FitOptions(config=16),
    lambda: jaxink.ink_table(data),
    lambda: jaxink.ink_table(sample, options={"n_theta": 61}),
    lambda: jaxink.ink_table(sample, wavelengths_nm="red"),
    lambda: sample.parameters.replace("ink.thickness_um", value="60"),
):
    try:
        call()
    except InputRefusedError as error:
        print(error)
"""
SENTENCES = """\
data is of type Sample; it must be of type GonioData, str or Path.
data is of type Sample; it must be of type GonioData, str or Path.
sample is of type dict; it must be of type Sample, str or Path.
options is of type DiagnosisOptions; it must be of type FitOptions.
options is of type FitOptions; it must be of type DiagnosisOptions.
n_bootstrap is 250.5; it must be a whole number of at least 1.
level is '5 %'; it must be a number.
the catalogue takes classes of effects; it was given 'blur'.
n_starts is True; it must be a whole number of at least 1.
accuracy is 'high'; give a relative error between 1e-08 and 0.1.
config is of type int; it must be of type SolverConfig.
source is of type GonioData; it must be of type FitResult, ForwardModel or Sample.
options is of type dict; it must be of type TableOptions.
a wavelength of wavelengths_nm is 'red'; it must be a number.
value of ink.thickness_um is '60'; it must be a number.
"""


def sample_with(**changes):
    sample = jaxink.parse_sample(PRINTED_INK)
    table = sample.parameters.replace("ink.scattering_per_mm", **changes)
    return dataclasses.replace(sample, parameters=table)


def test_another_kind_of_argument():
    command = [sys.executable, "-c", OF_ANOTHER_KIND]
    done = subprocess.run(command, input=PRINTED_INK, capture_output=True, text=True, timeout=120)
    assert done.stdout == SENTENCES, done.stderr


@pytest.mark.parametrize(
    ("options", "choice", "sentence"),
    [
        (jaxink.DiagnosisOptions, {"max_effects": -1}, "max_effects is -1; it must be a whole number"),
        (jaxink.DiagnosisOptions, {"max_parameters": 0}, "max_parameters is 0"),
        (jaxink.DiagnosisOptions, {"n_bootstrap": 100}, "at level 0.05 it must be at least 200"),
        (jaxink.DiagnosisOptions, {"level": 0.9}, "level is 0.9; it must be between 0 and 0.5"),
        (jaxink.FitOptions, {"n_starts": 10**11}, "n_starts is 100000000000; it must be at most 10000"),
        (jaxink.DiagnosisOptions, {"n_bootstrap": 10**14}, "n_bootstrap is 1.*; it must be at most 100000"),
        (jaxink.FitOptions, {"n_starts": 0}, "n_starts is 0; it must be a whole number of at least 1"),
        (jaxink.SolverConfig, {"n_orders": 0}, "n_orders is 0; it must be a whole number of at least 1"),
    ],
)
def test_choices_outside_their_range(options, choice, sentence):
    with pytest.raises(InputRefusedError, match=sentence):
        options(**choice)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"value": float("nan")}, "value of ink.scattering_per_mm is nan; it must be a number"),
        ({"minimum": 5.0, "maximum": 1.0}, "the range of ink.scattering_per_mm, 5 to 1, is empty"),
        ({"scale": "square"}, "scale of ink.scattering_per_mm is 'square'; it must be one of: linear, log"),
    ],
)
def test_parameters_that_are_none(changes, sentence):
    with pytest.raises(InputRefusedError, match=sentence):
        sample_with(**changes)


@pytest.mark.parametrize("function", [jaxink.predict, lambda sample, data: jaxink.fit(data, sample)])
def test_value_outside_its_range(function):
    same = np.ones(2)
    data = jaxink.GonioData(20 * same, ANGLES, 0 * same, 550 * same, [False, False], same)
    with pytest.raises(InputRefusedError, match="ink.scattering_per_mm is -5; it must lie between 1 and 500"):
        function(sample_with(value=-5.0), data)
    # A fit that ends on a bound may be off by rounding.
    sample_with(value=1.0 - 1e-15).parameters.require_ranges()


@pytest.mark.parametrize(
    ("theta_i", "theta_o", "sentence"),
    [
        ([20.0, 20.0], [10.0, 100.0], "theta_o_deg is 100; it must lie in 0 ... 90"),
        ([20.0, -20.0], ANGLES, "theta_i_deg is -20"),
        ([20.0, 20.0], [10.0], r"theta_o_deg has shape \(1,\)"),
    ],
)
def test_points_of_a_model(theta_i, theta_o, sentence):
    with pytest.raises(InputRefusedError, match=sentence):
        jaxink.ForwardModel(sample_with(), theta_i, theta_o, [0.0, 0.0], [550.0, 550.0], [False, False])
