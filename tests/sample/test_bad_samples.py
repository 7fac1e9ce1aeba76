"""Bad sample files, each with the exact sentence that its user gets after the file name."""

import pytest

from jaxink.errors import InputRefusedError
from jaxink.sample import parse_sample
from tests.refused import edited, sentence_of
from tests.samples import GOOD_SAMPLE

SCATTERING = "scattering_per_mm = { free = true, min = 1, max = 1000 }"


def scattering(entry: str):
    return (SCATTERING, f"scattering_per_mm = {entry}")


# name, (text of the good file, what stands there instead), sentence
BAD_SAMPLES = [
    (
        "not TOML",
        ("[noise]", "[noise"),
        "is not valid TOML: Expected ']' at the end of a table declaration (at line 17, column 7).",
    ),
    (
        "no version",
        ("schema_version = 1\n", ""),
        "schema_version is None; this jaxink reads 1, so write `schema_version = 1` at the top.",
    ),
    (
        "later version",
        ("schema_version = 1", "schema_version = 7"),
        "schema_version is 7; this jaxink reads 1, so write `schema_version = 1` at the top.",
    ),
    (
        "unknown table",
        ("[noise]", "[nois]"),
        "the file has the key 'nois', which does not exist; did you mean noise?",
    ),
    (
        "unknown key of a layer",
        ("thickness_um = 80", "thikness_um = 80"),
        "layer 'ink' has the key 'thikness_um', which does not exist; did you mean thickness_um?",
    ),
    (
        "key in another unit",
        ("thickness_mm = 1.0", "thickness_um = 1000"),
        "layer 'plate' has the key 'thickness_um', which does not exist; did you mean thickness_mm?",
    ),
    (
        "misspelt key of a parameter",
        scattering("{ fre = true, min = 1, max = 10 }"),
        "ink.scattering_per_mm has the key 'fre', which does not exist; did you mean free?",
    ),
    (
        "another unit",
        scattering('{ value = 10, unit = "1/cm" }'),
        "ink.scattering_per_mm has unit = '1/cm'; it is always in 1/mm, as its name says.",
    ),
    (
        "unit of a pure number",
        ("asymmetry_parameter = 0.6", 'asymmetry_parameter = { value = 0.6, unit = "deg" }'),
        "ink.asymmetry_parameter has unit = 'deg'; it is always in no unit (a pure number), as its name "
        "says.",
    ),
    (
        "wavelength in micrometres",
        ("wavelength_nm = [450, 550]", "wavelength_nm = 0.55"),
        "wavelength_nm is [0.55]; it must be a number or a list of numbers, in nanometres (100 ... 100000).",
    ),
    (
        "wavelength twice",
        ("[450, 550]", "[550, 550]"),
        "wavelength_nm names a wavelength twice, to six digits: [550, 550].",
    ),
    (
        "wavelengths that have the same name",
        ("[450, 550]", "[550, 550.0001]"),
        "wavelength_nm names a wavelength twice, to six digits: [550, 550.0001].",
    ),
    (
        "truth value for the version",
        ("schema_version = 1", "schema_version = true"),
        "schema_version is True; this jaxink reads 1, so write `schema_version = 1` at the top.",
    ),
    (
        "quantity missing",
        ("absorption_per_mm = 1.0\n", ""),
        "ink.absorption_per_mm is missing; write absorption_per_mm = <number in 1/mm>.",
    ),
    (
        "text for a number",
        ("absorption_per_mm = 1.0", 'absorption_per_mm = "high"'),
        "ink.absorption_per_mm is 'high'; it must be a finite number in 1/mm.",
    ),
    (
        "not finite",
        ("absorption_per_mm = 1.0", "absorption_per_mm = inf"),
        "ink.absorption_per_mm is inf; it must be a finite number in 1/mm.",
    ),
    (
        "truth value for a number",
        ("absorption_per_mm = 1.0", "absorption_per_mm = true"),
        "ink.absorption_per_mm is True; it must be a finite number in 1/mm.",
    ),
    (
        "negative coefficient",
        ("absorption_per_mm = 1.0", "absorption_per_mm = -1.0"),
        "ink.absorption_per_mm is -1 1/mm; it must lie between 0 and 1e+06 1/mm.",
    ),
    (
        "index below vacuum",
        ('kind = "clear"\nrefractive_index = 1.5', 'kind = "clear"\nrefractive_index = 0.9'),
        "plate.refractive_index is 0.9; it must lie between 1 and 4.",
    ),
    (
        "asymmetry beyond 1",
        ("asymmetry_parameter = 0.6", "asymmetry_parameter = 1.2"),
        "ink.asymmetry_parameter is 1.2; it must lie between -0.9999 and 0.9999.",
    ),
    (
        "free without a range",
        scattering("{ free = true, min = 1 }"),
        "ink.scattering_per_mm is free and needs a range: give min and max.",
    ),
    (
        "free neither true nor false",
        scattering('{ free = "yes", min = 1, max = 10 }'),
        "ink.scattering_per_mm: free is 'yes'; it must be true or false.",
    ),
    (
        "fixed without a value",
        scattering("{ min = 1, max = 10 }"),
        "ink.scattering_per_mm is fixed and has no value.",
    ),
    (
        "range upside down",
        scattering("{ free = true, min = 1000, max = 1 }"),
        "ink.scattering_per_mm: min = 1000 is not below max = 1.",
    ),
    (
        "range beyond physics",
        scattering("{ free = true, min = -1, max = 10 }"),
        "ink.scattering_per_mm: min is -1 1/mm; it must lie between 0 and 1e+06 1/mm.",
    ),
    (
        "start outside the range",
        scattering("{ value = 2000, free = true, min = 1, max = 1000 }"),
        "ink.scattering_per_mm: the start value 2000 lies outside its range 1 ... 1000.",
    ),
    (
        "tie and value",
        scattering('{ value = 1, tie = "2 * ink.absorption_per_mm" }'),
        'ink.scattering_per_mm has a tie, which gives its value: write tie = "expression" without value and '
        "free.",
    ),
    (
        "tie to nothing",
        scattering('{ tie = "2 * ink.absorbtion_per_mm" }'),
        "ink.scattering_per_mm: the tie '2 * ink.absorbtion_per_mm' names ink.absorbtion_per_mm, which does "
        "not exist; did you mean ink.absorption_per_mm?",
    ),
    (
        "tie that calls",
        scattering('{ tie = "exp(ink.absorption_per_mm)" }'),
        "ink.scattering_per_mm: the tie 'exp(ink.absorption_per_mm)' may hold numbers, parameter names, "
        "+ - * / ** and brackets only.",
    ),
    (
        "tie that is no expression",
        scattering('{ tie = "2 *" }'),
        "ink.scattering_per_mm: the tie '2 *' is not an expression.",
    ),
    (
        "tie to itself",
        scattering('{ tie = "2 * ink.scattering_per_mm" }'),
        "the ties of ink.scattering_per_mm refer to each other in a circle.",
    ),
    (
        "prior without a width",
        scattering("{ free = true, min = 1, max = 9, prior = { mean = 3 } }"),
        "ink.scattering_per_mm: prior must be { mean = ..., standard_deviation = ... }.",
    ),
    (
        "prior of no width",
        scattering("{ free = true, min = 1, max = 9, prior = { mean = 3, standard_deviation = 0 } }"),
        "ink.scattering_per_mm: prior.standard_deviation is 0; fix the parameter instead.",
    ),
    (
        "one value too few",
        scattering("{ per_wavelength = true, value = [3, 4, 5] }"),
        "ink.scattering_per_mm has 3 values for 2 wavelengths; give one for each, by ascending wavelength, "
        "or a single one.",
    ),
    (
        "no wavelengths for a spectrum",
        ("wavelength_nm = [450, 550]\n", "", *scattering("{ per_wavelength = true, value = 3 }")),
        "ink.scattering_per_mm has per_wavelength = true, but the file names no wavelengths; write "
        "wavelength_nm = [...] at the top.",
    ),
    (
        "unknown kind",
        ('kind = "clear"', 'kind = "glass"'),
        "layer 'plate' has kind = 'glass'; it must be one of: clear, scattering.",
    ),
    (
        "unknown phase function",
        ('"henyey_greenstein"', '"hg"'),
        "layer 'ink' has phase_function = 'hg'; it must be one of: henyey_greenstein, "
        "two_term_henyey_greenstein, rayleigh, tabulated, mie.",
    ),
    (
        "name with a dot",
        ('name = "ink"', 'name = "my.ink"'),
        "layer 2 has name = 'my.ink'; it needs a name of letters, digits and underscores, such as "
        'name = "ink".',
    ),
    (
        "same name twice",
        ('name = "ink"', 'name = "plate"'),
        "two layers are named 'plate'; give each a name of its own.",
    ),
    (
        "lit from the other end",
        ("wavelength_nm = [450, 550]", 'lit_side = "ink"'),
        "lit_side is 'ink' but the first layer is 'plate': list the layers in the order in which light meets "
        "them.",
    ),
    (
        "coefficients of an opaque layer",
        ("thickness_um = 80", 'thickness_um = "opaque"\nsingle_scattering_albedo = 0.9'),
        "layer 'ink' is opaque, so scattering_per_mm alone has no effect; give single_scattering_albedo, "
        "which is scattering / (scattering + absorption).",
    ),
    (
        "table without numbers",
        ('"henyey_greenstein"', '"tabulated"', "asymmetry_parameter = 0.6\n", ""),
        "layer 'ink' has a tabulated phase function: give either moments = [1, ...] or angle_deg and "
        "phase_value.",
    ),
    (
        "table of unequal columns",
        (
            '"henyey_greenstein"',
            '"tabulated"',
            "asymmetry_parameter = 0.6\n",
            "angle_deg = [0, 90, 180]\nphase_value = [1, 1]\n",
        ),
        "layer 'ink': angle_deg has 3 entries and phase_value 2; they must be equally many.",
    ),
    (
        "roughness of unknown kind",
        ("thickness_mm = 1.0", 'thickness_mm = 1.0\nfront_roughness = { density = "gauss", sigma_deg = 3 }'),
        "plate.front_roughness has density = 'gauss'; it must be one of: cauchy, cauchy_angle, cauchy2d, "
        "beckmann, ggx, height_map.",
    ),
    (
        "roughness without its angle",
        ("thickness_mm = 1.0", 'thickness_mm = 1.0\nfront_roughness = { density = "ggx" }'),
        "plate.front_roughness.sigma_deg is missing; write sigma_deg = <number in deg>.",
    ),
    (
        "second roughness without its weight",
        (
            "thickness_mm = 1.0",
            'thickness_mm = 1.0\nfront_roughness = { density = "ggx", sigma_deg = 3, second_density = "ggx", '
            "second_sigma_deg = 9 }",
        ),
        "plate.front_roughness.second_weight is missing; write second_weight = <number>.",
    ),
    (
        "noise in per cent",
        ("scan_relative = 0.002", "scan_relative = 2.0"),
        "noise.scan_relative is 2; it must lie between 0 and 1.",
    ),
    (
        "unknown mask",
        ("[noise]", "[masks]\nspecular_deg = 3\n[noise]"),
        "[masks] has the key 'specular_deg', which does not exist; did you mean specular_half_angle_deg?",
    ),
    (
        "cone too wide",
        ("[noise]", "[instrument]\nsource_half_angle_deg = 45\n[noise]"),
        "instrument.source_half_angle_deg is 45 deg; it must lie between 0 and 30 deg.",
    ),
    (
        "weight of no side",
        ("[noise]", '[[weights]]\nside = "back"\nweight = 2\n[noise]'),
        'weights.side is \'back\'; it must be "R" or "T".',
    ),
    (
        "negative weight",
        ("[noise]", "[[weights]]\nweight = -2\n[noise]"),
        "weights.weight is -2; it must lie between 0 and inf.",
    ),
    (
        "backing without reflectance",
        ("[noise]", '[backing]\nside = "R"\n[noise]'),
        "backing.reflectance is missing; write reflectance = <number>.",
    ),
    (
        "backing brighter than white",
        ("[noise]", "[backing]\nreflectance = 1.2\n[noise]"),
        "backing.reflectance is 1.2; it must lie between 0 and 1.",
    ),
    (
        "backing in transmission only",
        ("[noise]", '[backing]\nreflectance = 0.2\nside = "T"\n[noise]'),
        "[backing] has side = 'T'; it must be one of: R, both.",
    ),
    (
        "backing that touches and is taken away",
        ("[noise]", '[backing]\nreflectance = 0.2\nside = "R"\ncontact = true\n[noise]'),
        'backing.contact is true, so the backing cannot be taken away: write side = "both" or leave it out.',
    ),
    (
        "contact that is a number",
        ("[noise]", "[backing]\nreflectance = 0.2\ncontact = 1\n[noise]"),
        "backing.contact is 1; it must be true or false.",
    ),
    (
        "layer called backing",
        ('name = "plate"', 'name = "backing"', "[noise]", "[backing]\nreflectance = 0.2\n[noise]"),
        "two layers are named 'backing'; give each a name of its own.",
    ),
    (
        "backing behind an opaque layer",
        (
            SCATTERING + "\nabsorption_per_mm = 1.0",
            "single_scattering_albedo = 0.9",
            "thickness_um = 80",
            'thickness_um = "opaque"',
            "[noise]",
            "[backing]\nreflectance = 0.2\n[noise]",
        ),
        "there is a [backing] behind the opaque layer 'ink', which lets no light come to it; take it out, or "
        "give the layer a thickness.",
    ),
    (
        "beam without a field",
        ("[noise]", "[instrument]\nbeam_diameter_mm = 2\n[noise]"),
        "[instrument] has one of beam_diameter_mm and detector_diameter_mm; give both, or neither if the "
        "detector sees all light, wherever it comes out.",
    ),
    (
        "field without a size",
        ("[noise]", "[instrument]\nbeam_diameter_mm = 2\ndetector_diameter_mm = 0\n[noise]"),
        "instrument.detector_diameter_mm is 0 mm; it must lie between 0.001 and 10000 mm.",
    ),
]


@pytest.mark.parametrize(
    ("changes", "sentence"), [bad[1:] for bad in BAD_SAMPLES], ids=[bad[0] for bad in BAD_SAMPLES]
)
def test_sentence(changes, sentence, tmp_path):
    assert sentence_of(edited(GOOD_SAMPLE, changes), tmp_path) == sentence


def test_good_sample_is_accepted():
    sample = parse_sample(GOOD_SAMPLE)
    assert [p.name for p in sample.parameters.free] == ["ink.scattering_per_mm"]
    assert sample.parameters["ink.scattering_per_mm"].value == 500.5


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (
            "schema_version = 1\n",
            "there are no layers; write one [[layers]] table for each, in the order in which",
        ),
        (
            'schema_version = 1\n[[layers]]\nname = "a"\nkind = "clear"\n'
            "refractive_index = 1\nthickness_mm = 1\n",
            'no layer has kind = "scattering"; there is no ink whose properties could be found.',
        ),
    ],
)
def test_nothing_to_find(text, sentence):
    with pytest.raises(InputRefusedError) as caught:
        parse_sample(text)
    assert str(caught.value).startswith(f"sample: {sentence}")
