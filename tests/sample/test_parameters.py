"""Ties, priors, spectra and the way to plain data and back."""

import math

import pytest

from jaxink.sample import Backing, Prior, parse_sample, sample_from_dict, sample_to_dict
from jaxink.sample.parameters import Parameter, ParameterTable
from jaxink.sample.ties import evaluate_tie

SAMPLE = """\
schema_version = 1
title = "two inks"
wavelength_nm = [650, 450]
[surroundings]
index_back = 1.33
[[layers]]
name = "blue"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = { value = 20, free = true, min = 10, max = 40, prior = { mean = 22, standard_deviation = 2 } }
scattering_per_mm = { per_wavelength = true, value = [40, 30], free = true, min = 1, max = 500 }
absorption_per_mm = { per_wavelength = true, value = 2 }
asymmetry_parameter = { free = true, min = 0, max = 0.95 }
[[layers]]
name = "red"
kind = "scattering"
phase_function = "tabulated"
moments = [1, 0.5, 0.25]
refractive_index = { tie = "blue.refractive_index" }
thickness_um = { tie = "40 - (blue.thickness_um + 2) ** 1 / 2" }
scattering_per_mm = 10
absorption_per_mm = 0
front_roughness = { density = "ggx", sigma_deg = 4 }
[noise]
relative = 0.01
floor_per_sr = 1e-4
[[weights]]
theta_i_deg = 30
side = "T"
weight = 0.5
[[weights]]
theta_o_deg = [0, 60]
wavelength_nm = [500, 600]
column = "count"
"""


@pytest.fixture(scope="module")
def sample():
    return parse_sample(SAMPLE)


def test_ties_follow_the_values_they_name(sample):
    values = sample.parameters.values_with({"blue.thickness_um": 30.0})
    assert values["red.thickness_um"] == 24.0
    assert values["red.refractive_index"] == 1.5
    assert sample.parameters.values_with({})["red.thickness_um"] == 29.0


def test_a_tie_of_a_tie():
    table = ParameterTable(
        [Parameter("a", math.nan, tie="-b + 1"), Parameter("b", math.nan, tie="c / 4"), Parameter("c", 2.0)]
    )
    assert table.values_with({}) == {"a": 0.5, "b": 0.5, "c": 2.0}
    assert table.values_with({"c": 8.0})["a"] == -1.0


@pytest.mark.parametrize(
    "expression", ["a if b else c", "[a]", "'a'", "a.real()", "a < b", "lambda: 1", "__import__('os')"]
)
def test_ties_are_arithmetic_only(expression, refused):
    with refused("+ - * / **"):
        evaluate_tie(expression, {"a": 1.0, "b": 1.0, "c": 1.0})


def test_the_value_of_a_tied_parameter_does_not_matter():
    one, other = (Parameter("a.b", value, tie="2 * c.d") for value in (math.nan, float("nan")))
    assert one == other
    assert len({one, other}) == 1
    assert one != Parameter("a.b", math.nan, tie="3 * c.d")
    assert Parameter("a.b", 1.0) != Parameter("a.b", 2.0)


def test_tie_differentiates(sample):
    import jax

    slope = jax.grad(lambda x: evaluate_tie("2 * x ** 3 - 1 / x", {"x": x}))(2.0)
    assert slope == pytest.approx(24.25)


def test_values_by_wavelength_ascend(sample):
    table = sample.parameters
    assert sample.wavelengths_nm == (450.0, 650.0)
    assert table["blue.scattering_per_mm@450"].value == 40
    assert table["blue.scattering_per_mm@650"].value == 30
    assert table["blue.absorption_per_mm@450"].value == table["blue.absorption_per_mm@650"].value == 2
    assert [p.name for p in table.free] == [
        "blue.thickness_um",
        "blue.scattering_per_mm@450",
        "blue.scattering_per_mm@650",
        "blue.asymmetry_parameter",
    ]


def test_prior_and_start(sample):
    assert sample.parameters["blue.thickness_um"].prior == Prior(22.0, 2.0)
    assert sample.parameters["blue.asymmetry_parameter"].value == 0.475
    assert sample.parameters["surroundings.index_front"].value == 1.0


def test_unknown_names_are_refused(sample, refused):
    with refused("blue.thickness_um"):
        sample.parameters.values_with({"blue.thickness_mm": 1.0})
    with refused("blue.thickness_um"):
        sample.parameters.replace("blue.thickness_mm", value=1.0)


def test_plain_data_and_back(sample):
    import json

    plain = json.loads(json.dumps(sample_to_dict(sample), allow_nan=False))
    again = sample_from_dict(plain)
    assert sample_to_dict(again) == sample_to_dict(sample)
    assert again.layers == sample.layers
    assert again.parameters.values_with({}) == sample.parameters.values_with({})


def test_backing_as_plain_data_and_back():
    sample = parse_sample(
        SAMPLE + "\n[backing]\nreflectance = { value = 0.3, free = true, min = 0, max = 1 }\n"
    )
    assert sample.parameters["backing.reflectance"].free
    again = sample_from_dict(sample_to_dict(sample))
    assert again.backing == sample.backing == Backing("R", False)
    # Results of before there were backings lack the key.
    older = sample_to_dict(sample)
    del older["backing"]
    assert sample_from_dict(older).backing is None


def test_numbers_of_a_rough_face_are_parameters(sample):
    face = sample.layers[1].roughness[0]
    assert (face.face, face.density, face.second_density) == ("front_roughness", "ggx", None)
    assert sample.parameters["red.front_roughness.sigma_deg"].value == 4
    twice = SAMPLE.replace(
        'density = "ggx", sigma_deg = 4',
        'density = "ggx", sigma_deg = 4, second_density = "beckmann", second_sigma_deg = 20, '
        "second_weight = { free = true, min = 0, max = 1 }",
    )
    table = parse_sample(twice).parameters
    assert table["red.front_roughness.second_sigma_deg"].value == 20
    assert table["red.front_roughness.second_weight"].free


def test_the_same_interface_is_rough_once(sample, refused):
    from jaxink import ForwardModel

    text = SAMPLE.replace(
        'front_roughness = { density = "ggx", sigma_deg = 4 }',
        'front_roughness = { density = "ggx", sigma_deg = 4 }\n',
    ).replace('name = "blue"', 'name = "blue"\nback_roughness = { density = "ggx", sigma_deg = 4 }')
    with refused("blue.back_roughness"):
        ForwardModel(parse_sample(text), [0.0], [10.0], [0.0], [450.0], [False])


@pytest.mark.parametrize(
    ("entry", "named"),
    [
        ('{ tie = "1 / (plate.thickness_mm - 1)" }', "1 / (plate.thickness_mm - 1)"),
        ('{ tie = "0 - plate.thickness_mm" }', "1"),
        ("{ value = 1, prior = { mean = 1, standard_deviation = 1 } }", "ink.absorption_per_mm"),
        (
            '{ tie = "plate.thickness_mm", prior = { mean = 1, standard_deviation = 1 } }',
            "ink.absorption_per_mm",
        ),
        ('{ value = 1, per_wavelength = "no" }', "per_wavelength"),
    ],
)
def test_what_would_be_ignored_or_meaningless_is_refused(entry, named, refused):
    text = f"""
    schema_version = 1
    [[layers]]
    name = "plate"
    kind = "clear"
    refractive_index = 1.5
    thickness_mm = 1
    [[layers]]
    name = "ink"
    kind = "scattering"
    phase_function = "rayleigh"
    refractive_index = 1.5
    thickness_um = 10
    scattering_per_mm = 10
    absorption_per_mm = {entry}
    """
    with refused(named):
        parse_sample(text)
