"""Bad sample files, each with the key that its user is told of."""

import pytest

from jaxink.sample import parse_sample
from tests.samples import GOOD_SAMPLE, edited

SCATTERING = "scattering_per_mm = { free = true, min = 1, max = 1000 }"


def scattering(entry: str):
    return (SCATTERING, f"scattering_per_mm = {entry}")


# name, (text of the good file, what stands there instead), what is named
BAD_SAMPLES = [
    (
        "not TOML",
        ("[noise]", "[noise"),
        "]",
    ),
    (
        "no version",
        ("schema_version = 1\n", ""),
        "schema_version",
    ),
    (
        "later version",
        ("schema_version = 1", "schema_version = 7"),
        "schema_version",
    ),
    (
        "unknown table",
        ("[noise]", "[nois]"),
        "nois",
    ),
    (
        "unknown key of a layer",
        ("thickness_um = 80", "thikness_um = 80"),
        "thikness_um",
    ),
    (
        "key in another unit",
        ("thickness_mm = 1.0", "thickness_cm = 0.1"),
        "thickness_mm, in mm",
    ),
    (
        "thickness in both units",
        ("thickness_um = 80", "thickness_um = 80\nthickness_mm = 0.08"),
        "thickness_mm",
    ),
    (
        "tie in another unit",
        ("thickness_um = 80", 'thickness_mm = { tie = "plate.thickness_mm" }'),
        "ink.thickness_um",
    ),
    (
        "thickness in mm with the unit um",
        ("thickness_um = 80", 'thickness_mm = { value = 80, unit = "um" }'),
        "ink.thickness_mm",
    ),
    (
        "converted thickness out of range",
        ("thickness_um = 80", "thickness_mm = 1e5"),
        "ink.thickness_um",
    ),
    (
        "misspelt key of a parameter",
        scattering("{ fre = true, min = 1, max = 10 }"),
        "ink.scattering_per_mm",
    ),
    (
        "another unit",
        scattering('{ value = 10, unit = "1/cm" }'),
        "ink.scattering_per_mm",
    ),
    (
        "unit of a pure number",
        ("asymmetry_parameter = 0.6", 'asymmetry_parameter = { value = 0.6, unit = "deg" }'),
        "ink.asymmetry_parameter",
    ),
    (
        "wavelength in micrometres",
        ("wavelength_nm = [450, 550]", "wavelength_nm = 0.55"),
        "wavelength_nm",
    ),
    (
        "wavelength twice",
        ("[450, 550]", "[550, 550]"),
        "wavelength_nm",
    ),
    (
        "wavelengths that have the same name",
        ("[450, 550]", "[550, 550.0001]"),
        "wavelength_nm",
    ),
    (
        "truth value for the version",
        ("schema_version = 1", "schema_version = true"),
        "schema_version",
    ),
    (
        "quantity missing",
        ("absorption_per_mm = 1.0\n", ""),
        "ink.absorption_per_mm",
    ),
    (
        "text for a number",
        ("absorption_per_mm = 1.0", 'absorption_per_mm = "high"'),
        "ink.absorption_per_mm",
    ),
    (
        "not finite",
        ("absorption_per_mm = 1.0", "absorption_per_mm = inf"),
        "ink.absorption_per_mm",
    ),
    (
        "truth value for a number",
        ("absorption_per_mm = 1.0", "absorption_per_mm = true"),
        "ink.absorption_per_mm",
    ),
    (
        "negative coefficient",
        ("absorption_per_mm = 1.0", "absorption_per_mm = -1.0"),
        "ink.absorption_per_mm",
    ),
    (
        "index below vacuum",
        ('kind = "clear"\nrefractive_index = 1.5', 'kind = "clear"\nrefractive_index = 0.9'),
        "plate.refractive_index",
    ),
    (
        "asymmetry beyond 1",
        ("asymmetry_parameter = 0.6", "asymmetry_parameter = 1.2"),
        "ink.asymmetry_parameter",
    ),
    (
        "free without a range",
        scattering("{ free = true, min = 1 }"),
        "ink.scattering_per_mm",
    ),
    (
        "free neither true nor false",
        scattering('{ free = "yes", min = 1, max = 10 }'),
        "ink.scattering_per_mm",
    ),
    (
        "fixed without a value",
        scattering("{ min = 1, max = 10 }"),
        "ink.scattering_per_mm",
    ),
    (
        "range upside down",
        scattering("{ free = true, min = 1000, max = 1 }"),
        "ink.scattering_per_mm",
    ),
    (
        "range beyond physics",
        scattering("{ free = true, min = -1, max = 10 }"),
        "ink.scattering_per_mm",
    ),
    (
        "start outside the range",
        scattering("{ value = 2000, free = true, min = 1, max = 1000 }"),
        "ink.scattering_per_mm",
    ),
    (
        "tie and value",
        scattering('{ value = 1, tie = "2 * ink.absorption_per_mm" }'),
        "ink.scattering_per_mm",
    ),
    (
        "tie to nothing",
        scattering('{ tie = "2 * ink.absorbtion_per_mm" }'),
        "ink.scattering_per_mm",
    ),
    (
        "tie that calls",
        scattering('{ tie = "exp(ink.absorption_per_mm)" }'),
        "ink.scattering_per_mm",
    ),
    (
        "tie that is no expression",
        scattering('{ tie = "2 *" }'),
        "ink.scattering_per_mm",
    ),
    (
        "tie to itself",
        scattering('{ tie = "2 * ink.scattering_per_mm" }'),
        "ink.scattering_per_mm",
    ),
    (
        "prior without a width",
        scattering("{ free = true, min = 1, max = 9, prior = { mean = 3 } }"),
        "ink.scattering_per_mm",
    ),
    (
        "prior of no width",
        scattering("{ free = true, min = 1, max = 9, prior = { mean = 3, standard_deviation = 0 } }"),
        "ink.scattering_per_mm",
    ),
    (
        "one value too few",
        scattering("{ per_wavelength = true, value = [3, 4, 5] }"),
        "ink.scattering_per_mm",
    ),
    (
        "no wavelengths for a spectrum",
        ("wavelength_nm = [450, 550]\n", "", *scattering("{ per_wavelength = true, value = 3 }")),
        "ink.scattering_per_mm",
    ),
    (
        "unknown kind",
        ('kind = "clear"', 'kind = "glass"'),
        "plate",
    ),
    (
        "unknown phase function",
        ('"henyey_greenstein"', '"hg"'),
        "phase_function",
    ),
    (
        "name with a dot",
        ('name = "ink"', 'name = "my.ink"'),
        "my.ink",
    ),
    (
        "same name twice",
        ('name = "ink"', 'name = "plate"'),
        "plate",
    ),
    (
        "lit from the other end",
        ("wavelength_nm = [450, 550]", 'lit_side = "ink"'),
        "lit_side",
    ),
    (
        "coefficients of an opaque layer",
        ("thickness_um = 80", 'thickness_um = "opaque"\nsingle_scattering_albedo = 0.9'),
        "scattering_per_mm",
    ),
    (
        "table without numbers",
        ('"henyey_greenstein"', '"tabulated"', "asymmetry_parameter = 0.6\n", ""),
        "angle_deg",
    ),
    (
        "table of unequal columns",
        (
            '"henyey_greenstein"',
            '"tabulated"',
            "asymmetry_parameter = 0.6\n",
            "angle_deg = [0, 90, 180]\nphase_value = [1, 1]\n",
        ),
        "angle_deg",
    ),
    (
        "roughness of unknown kind",
        ("thickness_mm = 1.0", 'thickness_mm = 1.0\nfront_roughness = { density = "gauss", sigma_deg = 3 }'),
        "plate.front_roughness",
    ),
    (
        "roughness without its angle",
        ("thickness_mm = 1.0", 'thickness_mm = 1.0\nfront_roughness = { density = "ggx" }'),
        "plate.front_roughness.sigma_deg",
    ),
    (
        "second roughness without its weight",
        (
            "thickness_mm = 1.0",
            'thickness_mm = 1.0\nfront_roughness = { density = "ggx", sigma_deg = 3, second_density = "ggx", '
            "second_sigma_deg = 9 }",
        ),
        "plate.front_roughness.second_weight",
    ),
    (
        "noise in per cent",
        ("scan_relative = 0.002", "scan_relative = 2.0"),
        "noise.scan_relative",
    ),
    (
        "unknown mask",
        ("[noise]", "[masks]\nspecular_deg = 3\n[noise]"),
        "specular_deg",
    ),
    (
        "cone too wide",
        ("[noise]", "[instrument]\nsource_half_angle_deg = 45\n[noise]"),
        "instrument.source_half_angle_deg",
    ),
    (
        "weight of no side",
        ("[noise]", '[[weights]]\nside = "back"\nweight = 2\n[noise]'),
        "weights.side",
    ),
    (
        "weight of one angle of view",
        ("[noise]", "[[weights]]\ntheta_o_deg = 30\nweight = 2\n[noise]"),
        "weights.theta_o_deg",
    ),
    (
        "weight of a number of a column",
        ("[noise]", "[[weights]]\ncolumn = 3\n[noise]"),
        "weights.column",
    ),
    (
        "negative weight",
        ("[noise]", "[[weights]]\nweight = -2\n[noise]"),
        "weights.weight",
    ),
    (
        "backing without reflectance",
        ("[noise]", '[backing]\nside = "R"\n[noise]'),
        "backing.reflectance",
    ),
    (
        "backing brighter than white",
        ("[noise]", "[backing]\nreflectance = 1.2\n[noise]"),
        "backing.reflectance",
    ),
    (
        "backing in transmission only",
        ("[noise]", '[backing]\nreflectance = 0.2\nside = "T"\n[noise]'),
        "backing",
    ),
    (
        "backing that touches and is taken away",
        ("[noise]", '[backing]\nreflectance = 0.2\nside = "R"\ncontact = true\n[noise]'),
        "backing.contact",
    ),
    (
        "contact that is a number",
        ("[noise]", "[backing]\nreflectance = 0.2\ncontact = 1\n[noise]"),
        "backing.contact",
    ),
    (
        "layer called backing",
        ('name = "plate"', 'name = "backing"', "[noise]", "[backing]\nreflectance = 0.2\n[noise]"),
        "backing",
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
        "backing",
    ),
    (
        "beam without a field",
        ("[noise]", "[instrument]\nbeam_diameter_mm = 2\n[noise]"),
        "beam_diameter_mm",
    ),
    (
        "field without a size",
        ("[noise]", "[instrument]\nbeam_diameter_mm = 2\ndetector_diameter_mm = 0\n[noise]"),
        "instrument.detector_diameter_mm",
    ),
]


@pytest.mark.parametrize(
    ("changes", "named"), [bad[1:] for bad in BAD_SAMPLES], ids=[bad[0] for bad in BAD_SAMPLES]
)
def test_the_key_is_named(changes, named, refused_sample):
    refused_sample(edited(GOOD_SAMPLE, changes), named)


def test_good_sample_is_accepted():
    sample = parse_sample(GOOD_SAMPLE)
    assert [p.name for p in sample.parameters.free] == ["ink.scattering_per_mm"]
    assert sample.parameters["ink.scattering_per_mm"].value == 500.5


@pytest.mark.parametrize(
    "text",
    [
        "schema_version = 1\n",
        'schema_version = 1\n[[layers]]\nname = "a"\nkind = "clear"\n'
        "refractive_index = 1\nthickness_mm = 1\n",
    ],
    ids=["no layers", "no ink"],
)
def test_nothing_to_find(text, refused):
    with refused("sample: "):
        parse_sample(text)
