"""A quantity whose spectrum is known up to its mean: one parameter, values by wavelength."""

import json

import numpy as np
import pytest

from jaxink.model.forward import ForwardModel, evaluate
from jaxink.sample import Smoothness, parse_sample, sample_from_dict, sample_text, sample_to_dict
from tests.samples import GOOD_SAMPLE, edited

SCATTERING = "scattering_per_mm = { free = true, min = 1, max = 1000 }"
FREE = "{ free = true, value = 60, min = 1, max = 300, shape = [1.5, 4.5] }"


def with_scattering(entry: str) -> str:
    return edited(GOOD_SAMPLE, (SCATTERING, f"scattering_per_mm = {entry}"))


def test_only_the_mean_is_free_and_the_values_follow_in_the_ratios_of_the_shape():
    table = parse_sample(with_scattering(FREE)).parameters
    assert [p.name for p in table.free] == ["ink.scattering_per_mm"]
    for mean in (60.0, 200.0):
        values = table.values_with({"ink.scattering_per_mm": mean})
        assert values["ink.scattering_per_mm@450"] == pytest.approx(0.5 * mean, rel=1e-15)
        assert values["ink.scattering_per_mm@550"] == pytest.approx(1.5 * mean, rel=1e-15)


def test_the_prediction_is_that_of_the_values_by_wavelength():
    listed = with_scattering("{ per_wavelength = true, value = [30, 90] }")
    angles = [0.0, 40.0, 0.0, 40.0], [20.0, 60.0, 20.0, 60.0], [0.0, 180.0, 0.0, 180.0]
    columns = *angles, [450.0, 450.0, 550.0, 550.0], [False, True, False, True]
    shaped, single = (
        evaluate(ForwardModel(parse_sample(text), *columns))
        for text in (with_scattering("{ value = 60, shape = [1.5, 4.5] }"), listed)
    )
    np.testing.assert_allclose(shaped, single, rtol=1e-12)
    assert not np.allclose(shaped[:2], shaped[2:])


@pytest.mark.parametrize(
    "entry",
    [
        FREE,
        "{ value = 60, shape = [0.7, 0.1] }",
        '{ tie = "2 * ink.absorption_per_mm", shape = [0, 3] }',
        "{ free = true, min = 1, max = 300, prior = { mean = 60, standard_deviation = 5 }, shape = [1, 2] }",
    ],
    ids=["free", "fixed", "tied", "prior"],
)
def test_written_and_saved_samples_are_read_back_the_same(entry):
    sample = parse_sample(with_scattering(entry))
    assert parse_sample(sample_text(sample)) == sample
    assert sample_from_dict(json.loads(json.dumps(sample_to_dict(sample)))) == sample


def test_a_tie_to_the_mean_follows_it():
    text = edited(
        with_scattering(FREE), ("= 1.0\nasymmetry", '= { tie = "ink.scattering_per_mm / 6" }\nasymmetry')
    )
    values = parse_sample(text).parameters.values_with({"ink.scattering_per_mm": 90.0})
    assert values["ink.absorption_per_mm"] == 15.0


def test_results_of_before_there_were_shapes_are_read():
    sample = parse_sample(GOOD_SAMPLE)
    plain = sample_to_dict(sample)
    for parameter in plain["parameters"]:
        del parameter["shape"]
    assert sample_from_dict(plain) == sample


@pytest.mark.parametrize(
    ("entry", "named"),
    [
        ("{ value = 60, shape = [1, 2, 3] }", "2"),
        ("{ value = 60, shape = [0, 0] }", "shape"),
        ("{ value = 60, shape = [1, -1] }", "shape"),
        ("{ value = 60, shape = [1, nan] }", "shape"),
        ("{ value = 60, shape = 2 }", "shape"),
        ("{ value = [60, 70], shape = [1, 2] }", "per_wavelength"),
        ("{ value = 60, per_wavelength = true, shape = [1, 2] }", "per_wavelength"),
        ("{ value = 60, free = true, min = 1, max = 9e5, shape = [1, 2] }", "1.2e+06"),
        ("{ free = true, min = 1, max = 10, spectrum = [1, 2] }", "shape?"),
        ('{ tie = ["2 * ink.absorption_per_mm", "3 * ink.absorption_per_mm"] }', "shape"),
        ('{ per_wavelength = true, tie = ["ink.absorption_per_mm", "2"] }', "shape"),
    ],
)
def test_impossible_shapes_are_refused(entry, named, refused_sample):
    refused_sample(with_scattering(entry), "ink.scattering_per_mm", named)


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("thickness_um = 80", "thickness_um = { value = 80, shape = [1, 2] }", "ink.thickness_um"),
        ("wavelength_nm = [450, 550]\n", "", "wavelength_nm"),
        (
            "thickness_mm = 1.0",
            "thickness_mm = 1.0\nabsorption_per_mm = { value = 1, shape = [1] }",
            "plate.absorption_per_mm",
        ),
        ("[noise]", "[effects.gain]\nrelative = { value = 0.1, shape = [1, 2] }\n[noise]", "effects.gain"),
        (
            "refractive_index = 1.5\nthickness_mm",
            'refractive_index = { dispersion = "cauchy", a = { value = 1.5, shape = [1, 1] } }\nthickness_mm',
            "plate.refractive_index.a",
        ),
    ],
    ids=["thickness", "no wavelengths", "plate", "effect", "dispersion"],
)
def test_shapes_out_of_place_are_refused(old, new, named, refused_sample):
    refused_sample(edited(with_scattering(FREE), (old, new)), named)


SMOOTH = (
    "{ per_wavelength = true, free = true, min = 1, max = 300, smoothness = { change = 4, over_nm = 25 } }"
)


def test_a_smoothness_is_written_and_saved_with_every_value():
    sample = parse_sample(with_scattering(SMOOTH))
    assert {p.smoothness for p in sample.parameters.free if "scattering" in p.name} == {Smoothness(4.0, 25.0)}
    assert parse_sample(sample_text(sample)) == sample
    assert sample_from_dict(json.loads(json.dumps(sample_to_dict(sample)))) == sample


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("per_wavelength = true, ", "", "per_wavelength = true"),
        ("free = true, min = 1, max = 300", "value = 3", "free = true"),
        ("over_nm = 25", "over_nm = 0", "smoothness.over_nm"),
        ("change = 4", "change = -4", "smoothness.change"),
        (", over_nm = 25", "", "over_nm"),
        ("{ change = 4, over_nm = 25 }", "4", "change"),
    ],
    ids=["one value", "fixed", "no distance", "negative", "incomplete", "a number"],
)
def test_a_smoothness_that_means_nothing_is_refused(refused, old, new, named):
    with refused("ink.scattering_per_mm", named):
        parse_sample(with_scattering(edited(SMOOTH, (old, new))))
