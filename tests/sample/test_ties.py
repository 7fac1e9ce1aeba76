"""Ties are a bounded language: what cannot be meant is refused at once, by a sentence with the parameter."""

import json
import math

import numpy as np
import pytest

from jaxink.sample import parse_sample, sample_from_dict, sample_to_dict
from jaxink.sample.parameters import Parameter, ParameterTable
from jaxink.sample.ties import evaluate_tie
from jaxink.sample.writing import sample_text
from tests.samples import GOOD_SAMPLE, edited

ABSURD = [
    "9**9**9**9",
    "10**20000000*0",
    "10**400",
    "2.0**99999",
    "(10**99)**99",
    "1e300*1e300",
    "1/(1e300*1e300)",
    "(-1)**0.5",
    "0**-1",
    "1e999",
    "1" * 400,
    "True",
    "2j",
    # Python's parser would warn of these.
    "1or 2",
    r"'\\d'",
    r"\u0000",
    "",
    "(" * 300 + "1" + ")" * 300,
    "-" * 500 + "1",
    "+".join("1" * 300),
]


@pytest.mark.parametrize("tie", ABSURD, ids=[tie[:20] for tie in ABSURD])
def test_absurd_ties_are_refused(tie, refused_sample):
    text = edited(GOOD_SAMPLE, ("absorption_per_mm = 1.0", f'absorption_per_mm = {{ tie = "{tie}" }}'))
    refused_sample(text, "ink.absorption_per_mm")


@pytest.mark.parametrize(
    "tie",
    ["-" * 20_000 + "1", "(" * 20_000, "a." * 20_000 + "a", "1" * 20_000],
    ids=["signs", "brackets", "points", "digits"],
)
def test_long_ties_are_refused_by_a_short_sentence(tie, refused_sample):
    text = edited(GOOD_SAMPLE, ("absorption_per_mm = 1.0", f'absorption_per_mm = {{ tie = "{tie}" }}'))
    assert len(refused_sample(text, "ink.absorption_per_mm", len(tie), 1000)) < 2000


@pytest.mark.parametrize("tie", ["9**9**9**9", "10**20000000*0", "-" * 20_000 + "1", "1or 2"])
def test_absurd_ties_of_a_stored_sample_are_refused(tie, refused):
    plain = json.loads(json.dumps(sample_to_dict(parse_sample(GOOD_SAMPLE))))
    (parameter,) = (p for p in plain["parameters"] if p["name"] == "ink.absorption_per_mm")
    parameter["tie"] = tie
    with refused("ink.absorption_per_mm"):
        sample_from_dict(plain)


def test_a_stored_tie_that_is_no_text_is_refused(refused):
    plain = json.loads(json.dumps(sample_to_dict(parse_sample(GOOD_SAMPLE))))
    plain["parameters"][8]["tie"] = 7
    with refused("sample.parameters[8].tie"):
        sample_from_dict(plain)


def test_ties_compute_as_floats_do():
    values = {"a": 3, "b.c": np.float64(-2.0), "d_1": 0.1}
    assert evaluate_tie("2 * a ** 2 - b.c / 4", values) == 18.5
    assert evaluate_tie("b . c ** 3 + 1_0.5e-1", values) == -6.95
    assert evaluate_tie(" -(-a) ** -2 ", values) == -1 / 9
    assert type(evaluate_tie("a", values)) is float
    assert evaluate_tie("+".join(["d_1"] * 101), values) == pytest.approx(10.1)


def test_numpy_values_that_overflow_are_refused_without_a_warning(refused):
    with refused("a * a"):
        evaluate_tie("a * a", {"a": np.float64(1e300)})


def test_whole_powers_of_traced_values_differentiate_at_zero_and_below():
    import jax

    slope = jax.grad(lambda x: evaluate_tie("x ** 3 + x ** 2", {"x": x}))
    assert slope(0.0) == 0.0
    assert slope(-2.0) == pytest.approx(8.0, rel=1e-15)
    # A power that is not whole keeps its own slope.
    root = jax.grad(lambda x: evaluate_tie("x ** 0.5", {"x": x}))
    assert root(4.0) == pytest.approx(0.25)


def test_long_chains_of_ties_are_resolved():
    n = 3000
    links = [Parameter(f"p{i}", math.nan, tie=f"p{i + 1} + 1") for i in range(n)]
    table = ParameterTable([*links, Parameter(f"p{n}", 0.5)])
    assert table.values_with({})["p0"] == n + 0.5


def test_circles_are_refused_by_those_that_form_them(refused):
    table = [Parameter(name, math.nan, tie=tie) for name, tie in (("a", "b"), ("b", "c"), ("c", "b"))]
    with refused("b", "c"):
        ParameterTable(table)


BY_WAVELENGTH = """
schema_version = 1
wavelength_nm = [500, 550.5, 600]
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 50
scattering_per_mm = { per_wavelength = true, free = true, value = [10, 12, 14], min = 1, max = 100 }
absorption_per_mm = { per_wavelength = true, tie = "0.02 * ink.scattering_per_mm + 1e-3*ink.thickness_um" }
asymmetry_parameter = { tie = "ink.scattering_per_mm@550.5 / 20" }
"""


def test_ties_by_wavelength_name_the_values_there():
    sample = parse_sample(BY_WAVELENGTH)
    values = sample.parameters.values_with({"ink.scattering_per_mm@600": 20.0})
    absorption = [values[f"ink.absorption_per_mm@{nm}"] for nm in ("500", "550.5", "600")]
    assert absorption == pytest.approx([0.25, 0.29, 0.45])
    assert values["ink.asymmetry_parameter"] == pytest.approx(0.6)
    assert parse_sample(sample_text(sample)).parameters == sample.parameters


def test_a_tie_by_wavelength_may_name_another_wavelength_too():
    mixed = edited(
        BY_WAVELENGTH,
        (
            "0.02 * ink.scattering_per_mm + 1e-3*ink.thickness_um",
            "0.02 * ink.scattering_per_mm@500 + 1e-3 * ink.scattering_per_mm",
        ),
    )
    sample = parse_sample(mixed)
    assert sample.parameters.values_with({})["ink.absorption_per_mm@600"] == pytest.approx(0.214)
    assert parse_sample(sample_text(sample)).parameters == sample.parameters


def test_only_what_no_other_wavelength_uses_is_of_one_wavelength():
    sample = parse_sample(BY_WAVELENGTH)
    free = [p.name for p in sample.parameters.free]
    assert set(sample.own_wavelengths(free, sample.wavelengths_nm).values()) == {500.0, 600.0}
    # Through a value at the same wavelength that is used at all of them.
    chain = edited(BY_WAVELENGTH, ("ink.scattering_per_mm@550.5 / 20", "ink.absorption_per_mm@600"))
    found = parse_sample(chain).own_wavelengths(free, (500.0, 550.5, 600.0))
    assert set(found.values()) == {500.0, 550.5}


def test_the_mean_of_a_shape_is_named_by_values_at_the_wavelength():
    shaped = edited(
        BY_WAVELENGTH,
        (
            "{ per_wavelength = true, free = true, value = [10, 12, 14], min = 1, max = 100 }",
            "{ value = 12, shape = [1, 2, 3] }",
        ),
    )
    values = parse_sample(shaped).parameters.values_with({})
    assert values["ink.absorption_per_mm@600"] == pytest.approx(0.02 * 18 + 0.05)


@pytest.mark.parametrize(
    "tie", ["ink.scattering_per_mm", "ink.scattering_per_mm@700", "2@500", "ink.thickness_um@500"]
)
def test_a_tie_to_no_value_at_a_wavelength_is_refused(tie, refused_sample):
    text = edited(BY_WAVELENGTH, ("ink.scattering_per_mm@550.5 / 20", tie))
    refused_sample(text, "ink.asymmetry_parameter", tie)
