"""What people write at first, and the key, with its unit, that they are told."""

import pytest

from jaxink.sample import parse_sample
from jaxink.sample.hints import meant_word
from jaxink.sample.schema import PHASE_FUNCTIONS
from tests.samples import GOOD_SAMPLE, edited

PLATE, INK = "refractive_index = 1.5\nthickness_mm", "refractive_index = 1.5\nthickness_um"
SCATTERING = "scattering_per_mm = { free"
ABSORPTION = "absorption_per_mm = 1.0"
GUESSES = [
    (PLATE, "index = 1.5\nthickness_mm", "refractive_index?"),
    (INK, "binder_index = 1.5\nthickness_um", "refractive_index?"),
    (INK, "n = 1.5\nthickness_um", "refractive_index?"),
    ("asymmetry_parameter", "hg", "asymmetry_parameter?"),
    ("asymmetry_parameter", "g", "asymmetry_parameter?"),
    ("asymmetry_parameter", "asymmetry", "asymmetry_parameter?"),
    (SCATTERING, "mu_s = { free", "scattering_per_mm, in 1/mm?"),
    (SCATTERING, "scattering_per_cm = { free", "scattering_per_mm, in 1/mm?"),
    (ABSORPTION, "mu_a = 1.0", "absorption_per_mm, in 1/mm?"),
    ("thickness_um = 80", "d_um = 80", "thickness_um, in um?"),
    ("thickness_um = 80", "thickness = 80", "thickness_um, in um?"),
    ("thickness_mm = 1.0", "thickness = 1.0", "thickness_mm, in mm?"),
    (
        SCATTERING,
        "albedo = 0.5\nscattering_per_mm = { free",
        "scattering_per_mm and absorption_per_mm, in 1/mm?",
    ),
    ('kind = "clear"', 'type = "clear"', "'type'"),
    ('kind = "clear"', 'kind = "plate"', "did you mean clear "),
    ('kind = "scattering"', 'kind = "ink"', "did you mean scattering "),
    (
        'phase_function = "henyey_greenstein"',
        'phase_function = "henyey-greenstein"',
        "did you mean henyey_greenstein ",
    ),
    ('phase_function = "henyey_greenstein"', 'phase_function = "HG"', "did you mean henyey_greenstein "),
    ('phase_function = "henyey_greenstein"', 'phase = "hg"', "'phase'"),
    ("wavelength_nm = [", "wavelengths = [", "wavelength_nm, in nm?"),
    ("wavelength_nm = [", "lambda = [", "wavelength_nm, in nm?"),
    ("scan_relative = 0.002", "sigma = 0.01", "relative?"),
    ("free = true, min = 1, max = 1000", "free = true, bounds = [1, 1000]", "min and max?"),
    ("free = true, min = 1, max = 1000", "free = true, lower = 1, max = 1000", "min?"),
    ("free = true, min", "start = 3, free = true, min", "value?"),
    (
        "asymmetry_parameter = 0.6",
        'asymmetry_parameter = { tie = "0.01 * ink.mu_s" }',
        "ink.scattering_per_mm, in",
    ),
    ("thickness_um = 80", 'thickness_um = { tie = "80 * plate.thickness_um" }', "plate.thickness_mm, in mm?"),
]


@pytest.mark.parametrize(
    ("old", "new", "named"), GUESSES, ids=[f"{g[1].split(' =')[0]}-{g[2]}" for g in GUESSES]
)
def test_a_guess_gets_its_hint(old, new, named, refused_sample):
    refused_sample(edited(GOOD_SAMPLE, (old, new)), named)


@pytest.mark.parametrize("word", ["Henyey Greenstein", "HG", "henyeygreenstein", "henyey-greenstien"])
def test_words_of_many_spellings(word):
    assert meant_word(word, PHASE_FUNCTIONS) == "henyey_greenstein"


@pytest.mark.parametrize("word", ["", "xyz", 3, None, ["mie"]])
def test_no_hint_rather_than_a_wrong_one(word):
    assert meant_word(word, PHASE_FUNCTIONS) is None


def thickness(text: str, layer: str = "ink"):
    unit = {"ink": "um", "plate": "mm"}[layer]
    old = {"ink": "thickness_um = 80", "plate": "thickness_mm = 1.0"}[layer]
    return parse_sample(edited(GOOD_SAMPLE, (old, text))).parameters[f"{layer}.thickness_{unit}"]


@pytest.mark.parametrize(
    ("written", "expected"), [("0.07", 70.0), ("0.08", 80.0), ("1e-3", 1.0), ("2", 2000.0)]
)
def test_an_ink_in_millimetres(written, expected):
    found = thickness(f"thickness_mm = {written}")
    assert (found.value, found.unit, found.free) == (expected, "um", False)


def test_a_plate_in_micrometres():
    assert thickness("thickness_um = 3000", "plate").value == 3.0
    assert parse_sample(edited(GOOD_SAMPLE, ("thickness_mm = 1.0", "thickness_um = 1000"))).parameters == (
        parse_sample(GOOD_SAMPLE).parameters
    )


def test_range_prior_and_wavelengths_are_converted():
    found = thickness(
        "thickness_mm = { value = 0.02, free = true, min = 0.01, max = 0.03, "
        'unit = "mm", prior = { mean = 0.021, standard_deviation = 0.001 } }'
    )
    assert (found.value, found.minimum, found.maximum) == (20, 10, 30)
    assert (found.prior.mean, found.prior.standard_deviation) == (21, 1)
    text = edited(
        GOOD_SAMPLE, ("thickness_um = 80", "thickness_mm = { per_wavelength = true, value = [0.08, 0.09] }")
    )
    parameters = parse_sample(text).parameters
    assert [parameters[f"ink.thickness_um@{w}"].value for w in (450, 550)] == [80, 90]


def test_an_opaque_ink_has_no_unit():
    changes = ("thickness_um = 80", 'thickness_mm = "opaque"', ABSORPTION, "single_scattering_albedo = 0.9")
    text = edited(GOOD_SAMPLE, (*changes, "scattering_per_mm = { free = true, min = 1, max = 1000 }", ""))
    assert parse_sample(text).layers[1].opaque
