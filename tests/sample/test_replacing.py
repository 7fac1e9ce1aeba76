"""Other values for parameters of a sample."""

import math

import pytest

import jaxink
from jaxink.sample.replacing import assigned
from tests.samples import PRINTED_INK, edited

TIED = edited(
    PRINTED_INK,
    (
        "absorption_per_mm = { free = true, min = 0, max = 50, value = 1 }",
        'absorption_per_mm = { tie = "ink.scattering_per_mm / 50" }',
    ),
)


@pytest.fixture
def sample():
    return jaxink.parse_sample(PRINTED_INK)


def test_a_mapping_and_keywords_give_the_same_sample(sample):
    changed = sample.replace({"ink.thickness_um": 70, "ink.scattering_per_mm": 80.0})
    assert changed == sample.replace(**{"ink.thickness_um": 70, "ink.scattering_per_mm": 80.0})
    assert changed.parameters["ink.thickness_um"].value == 70
    assert changed.parameters["ink.scattering_per_mm"].value == 80
    # What is free stays free, in its range; the sample itself does not change.
    assert changed.parameters["ink.scattering_per_mm"].free
    assert changed.parameters["ink.scattering_per_mm"].maximum == 500
    assert sample.parameters["ink.thickness_um"].value == 60
    assert sample.replace() == sample


def test_ties_follow():
    changed = jaxink.parse_sample(TIED).replace({"ink.scattering_per_mm": 100})
    assert changed.parameters.values_with({})["ink.absorption_per_mm"] == 2


def test_values_change_together():
    # With the scattering alone, the tie would give an absorption that is out of range.
    difference = '"ink.scattering_per_mm - ink.thickness_um"'
    tied = jaxink.parse_sample(edited(TIED, ('"ink.scattering_per_mm / 50"', difference)))
    changed = tied.replace({"ink.scattering_per_mm": 20, "ink.thickness_um": 15})
    assert changed.parameters.values_with({})["ink.absorption_per_mm"] == 5


def test_bad_values_are_refused(sample, refused):
    with refused("ink.thickness_m", "ink.thickness_um"):
        sample.replace({"ink.thickness_m": 6e-5})
    with refused("ink.scattering_per_mm", "600", "500"):
        sample.replace({"ink.scattering_per_mm": 600})
    with refused("ink.thickness_um", "-1"):
        sample.replace({"ink.thickness_um": -1})
    with refused("ink.thickness_um", "nan"):
        sample.replace({"ink.thickness_um": math.nan})
    with refused("ink.absorption_per_mm", "ink.scattering_per_mm / 50"):
        jaxink.parse_sample(TIED).replace({"ink.absorption_per_mm": 1})


def test_a_value_of_all_wavelengths_names_those_there_are(refused):
    text = PRINTED_INK.replace("wavelength_nm = 550", "wavelength_nm = [500, 600]").replace(
        "scattering_per_mm = { free", "scattering_per_mm = { per_wavelength = true, free"
    )
    with refused("ink.scattering_per_mm@500", "ink.scattering_per_mm@600"):
        jaxink.parse_sample(text).replace({"ink.scattering_per_mm": 60})


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("ink.thickness_um=60", 60),
        ("ink.thickness_um = 60 um", 60),
        ("ink.thickness_um=0.06mm", 60),
        ("plate.thickness_mm=1e3 um", 1),
        ("ink.scattering_per_mm=600 1/cm", 60),
        ("ink.asymmetry_parameter=-0.5", -0.5),
        ("ink.thickness_um=0,06 mm", 60),
        ("ink.thickness_um=60 microns", 60),
        ("ink.thickness_um=60 μm", 60),
        ("ink.thickness_um=0.006 CM", 60),
        ("ink.scattering_per_mm=0.06 1/micron", 60),
        # Exactly, not 70.00000000000001.
        ("ink.thickness_um=0.07 mm", 70),
        ("ink.asymmetry_parameter=0,25", 0.25),
    ],
)
def test_texts_with_and_without_units(text, value, sample):
    ((name, found),) = assigned(sample.parameters, [text]).items()
    assert text.startswith(name)
    assert found == value


@pytest.mark.parametrize(
    ("texts", "named"),
    [
        (["ink.thickness_um"], "NAME=VALUE"),
        (["ink.thickness_um=thick"], "NAME=VALUE"),
        (["ink.thickness_um=1-2"], "1-2"),
        (["ink.thickness_um=1,500"], "can be 1500 or 1.500"),
        (["ink.thickness_um=1,5,0"], "1,5,0"),
        (["ink.thikness_um=60"], "ink.thickness_um"),
        (["ink.thickness_um=60 deg"], "deg"),
        (["ink.asymmetry_parameter=0.5 mm"], "a pure number"),
        (["ink.thickness_um=60", "ink.thickness_um=70"], "twice"),
    ],
)
def test_texts_that_are_none_are_refused(texts, named, sample, refused):
    with refused(named):
        assigned(sample.parameters, texts)
