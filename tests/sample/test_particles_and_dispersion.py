"""Several kinds of particles and dispersion in sample files: what is read, what is kept, what is refused."""

import dataclasses
import json

import pytest

from jaxink.data import simulated_example
from jaxink.sample import (
    Parameter,
    ParameterTable,
    Population,
    load_sample,
    parse_sample,
    sample_from_dict,
    sample_to_dict,
)
from tests.samples import edited

GOOD = """\
schema_version = 1
wavelength_nm = [450, 550]
[[layers]]
name = "plate"
kind = "clear"
refractive_index = { dispersion = "cauchy", a = 1.47766, b_um2 = 0.004479 }
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = { dispersion = "sellmeier", b1 = 1.2, c1_um2 = 0.011 }
thickness_um = 80
radius_nm = 120
radius_variance_ln = { value = 0.05, free = true, min = 0, max = 0.2 }
volume_fraction = { value = 0.2, free = true, min = 0.05, max = 0.3 }
particle_index = { dispersion = "table", wavelength_nm = [400, 700], value = [2.9, 2.6] }
structure_factor_weight = 1
binder_absorption_per_mm = { per_wavelength = true, value = [0.2, 0.1] }
[[layers.populations]]
name = "filler"
radii_nm = [300, 500, 700]
number_weights = [1, 2, 1]
volume_fraction = 0.1
particle_index = { tie = "ink.particle_index.offset + 1.58" }
[noise]
scan_relative = 0.002
"""


@pytest.fixture(scope="module")
def sample():
    return parse_sample(GOOD)


def test_parameters_have_the_names_of_layer_population_and_coefficient(sample):
    assert list(sample.parameters) == [
        "surroundings.index_front",
        "surroundings.index_back",
        "plate.refractive_index.a",
        "plate.refractive_index.b_um2",
        "plate.refractive_index.c_um4",
        "plate.thickness_mm",
        "plate.absorption_per_mm",
        "ink.refractive_index.b1",
        "ink.refractive_index.c1_um2",
        "ink.refractive_index.b2",
        "ink.refractive_index.c2_um2",
        "ink.refractive_index.b3",
        "ink.refractive_index.c3_um2",
        "ink.thickness_um",
        "ink.radius_nm",
        "ink.volume_fraction",
        "ink.particle_index.offset",
        "ink.particle_absorption_index",
        "ink.structure_factor_weight",
        "ink.binder_absorption_per_mm@450",
        "ink.binder_absorption_per_mm@550",
        "ink.radius_variance_ln",
        "ink.filler.volume_fraction",
        "ink.filler.particle_index",
        "ink.filler.particle_absorption_index",
    ]
    assert [p.name for p in sample.parameters.free] == ["ink.volume_fraction", "ink.radius_variance_ln"]
    ink = sample.layers[1]
    assert ink.populations == (Population("filler", ((300.0, 500.0, 700.0), (1.0, 2.0, 1.0))),)
    assert list(ink.particles) == ["ink", "ink.filler"]


def test_values_at_a_wavelength(sample):
    values = sample.at_wavelength(sample.parameters.values_with({"ink.particle_index.offset": 0.06}), 450.0)
    assert values["plate.refractive_index"] == pytest.approx(1.4998, abs=1e-4)
    assert values["ink.refractive_index"] == pytest.approx((1 + 1.2 * 0.2025 / (0.2025 - 0.011)) ** 0.5)
    # Linear in 1 / wavelength^2.
    share = (1 / 450**2 - 1 / 700**2) / (1 / 400**2 - 1 / 700**2)
    assert values["ink.particle_index"] == pytest.approx(2.6 + 0.3 * share + 0.06)
    assert values["ink.filler.particle_index"] == pytest.approx(1.64)
    assert values["ink.binder_absorption_per_mm"] == 0.2
    assert "ink.binder_absorption_per_mm@550" not in values


def test_what_may_change(sample):
    assert not sample.varies("plate.refractive_index")
    assert sample.varies("ink.binder_absorption_per_mm")
    # Tied to a constant.
    assert not sample.varies("ink.filler.particle_index")
    free = sample.parameters.replace("plate.refractive_index.a", free=True, minimum=1.4, maximum=1.5)
    assert dataclasses.replace(sample, parameters=free).varies("plate.refractive_index")


def test_a_tied_quantity_varies_as_what_it_is_tied_to():
    ties = {"a": None, "b": "a", "c": "b", "d": "2 * c"}
    table = ParameterTable([Parameter(name, 1.0, maximum=9.0, tie=tie) for name, tie in ties.items()])
    sample = dataclasses.replace(parse_sample(GOOD), parameters=table)
    assert [table.source(name) for name in "abcd"] == ["a", "a", "a", "d"]
    assert [sample.varies(name) for name in "abcd"] == [False] * 4
    free = table.replace("a", free=True, minimum=0.0, maximum=2.0)
    assert all(dataclasses.replace(sample, parameters=free).varies(name) for name in "abcd")


def test_plain_data_and_back(sample):
    again = sample_from_dict(json.loads(json.dumps(sample_to_dict(sample), allow_nan=False)))
    assert again.layers == sample.layers
    assert again.dispersions == sample.dispersions
    assert hash(again.layers) == hash(sample.layers)
    assert sample_to_dict(again) == sample_to_dict(sample)
    assert again.at_wavelength(again.parameters.values_with({}), 450.0) == sample.at_wavelength(
        sample.parameters.values_with({}), 450.0
    )


def test_results_of_before_are_still_read():
    sample = load_sample(simulated_example()[1])
    plain = sample_to_dict(sample)
    del plain["dispersions"], plain["backing"], plain["illumination"]
    for layer in plain["layers"]:
        del layer["radius_table"], layer["populations"]
    assert sample_from_dict(plain) == sample


def test_keys_that_are_absent_bring_no_parameter():
    text = GOOD
    for key in ("radius_variance_ln", "structure_factor_weight", "binder_absorption_per_mm"):
        line = next(line for line in text.splitlines() if line.startswith(key))
        text = text.replace(line + "\n", "")
    names = list(parse_sample(text).parameters)
    assert not [n for n in names if "variance" in n or "structure" in n or "binder" in n]


CAUCHY = "a = 1.47766, b_um2 = 0.004479"
FILLER = 'name = "filler"\nradii_nm = [300, 500, 700]\nnumber_weights = [1, 2, 1]'
BAD_SAMPLES = [
    (
        "formula that does not exist",
        ('"cauchy"', '"conrady"'),
        "plate.refractive_index",
    ),
    (
        "coefficient in another unit",
        ("b_um2", "b_nm2"),
        "plate.refractive_index",
    ),
    (
        "coefficient that is missing",
        (CAUCHY, "b_um2 = 0.004"),
        "plate.refractive_index.a",
    ),
    (
        "coefficient by wavelength",
        ("b_um2 = 0.004479", "b_um2 = { per_wavelength = true, value = [0.004, 0.005] }"),
        "plate.refractive_index.b_um2",
    ),
    (
        "coefficient out of its range",
        ("a = 1.47766", "a = 14.7"),
        "plate.refractive_index.a",
    ),
    (
        "index below one",
        ("a = 1.47766", "a = 0.9"),
        "plate.refractive_index",
    ),
    (
        "range that reaches below one",
        ("b_um2 = 0.004479", "b_um2 = { free = true, min = -0.2, max = 0.01 }"),
        "plate.refractive_index",
    ),
    (
        "resonance in a range",
        ("c1_um2 = 0.011", "c1_um2 = { free = true, min = 0, max = 1 }"),
        "ink.refractive_index.c1_um2",
    ),
    (
        "no real index",
        ("b1 = 1.2, c1_um2 = 0.011", "b1 = -2, c1_um2 = 0.011"),
        "ink.refractive_index",
    ),
    (
        "table that is too short",
        ("[400, 700]", "[500, 700]"),
        "ink.particle_index",
    ),
    (
        "table out of order",
        ("[400, 700]", "[700, 400]"),
        "ink.particle_index",
    ),
    (
        "table of unequal columns",
        ("[2.9, 2.6]", "[2.9, 2.7, 2.6]"),
        "ink.particle_index",
    ),
    (
        "table of words",
        ("[2.9, 2.6]", '"rutile"'),
        "ink.particle_index",
    ),
    (
        "dispersion of a length",
        ("thickness_um = 80", 'thickness_um = { dispersion = "cauchy", a = 1 }'),
        "ink.thickness_um",
    ),
    (
        "standard deviation in place of the variance",
        ("radius_variance_ln = {", "sigma_ln = {"),
        "sigma_ln",
    ),
    (
        "variance too large",
        ("value = 0.05, free = true, min = 0, max = 0.2", "value = 1.6"),
        "ink.radius_variance_ln",
    ),
    (
        "weight of the structure factor in per cent",
        ("structure_factor_weight = 1", "structure_factor_weight = 100"),
        "ink.structure_factor_weight",
    ),
    (
        "negative absorption of the binder",
        ("value = [0.2, 0.1]", "value = [0.2, -0.1]"),
        "ink.binder_absorption_per_mm@550",
    ),
    (
        "populations that are no tables",
        (
            "binder_absorption_per_mm",
            'populations = ["filler"]\nbinder_absorption_per_mm',
            f"[[layers.populations]]\n{FILLER}\n"
            'volume_fraction = 0.1\nparticle_index = { tie = "ink.particle_index.offset + 1.58" }\n',
            "",
        ),
        "layers.populations",
    ),
    (
        "population without a name",
        ('name = "filler"', "name = 3"),
        "ink",
    ),
    (
        "population named as a key",
        ('name = "filler"', 'name = "radius_nm"'),
        "radius_nm",
    ),
    (
        "two populations of one name",
        (
            "[noise]",
            f"[[layers.populations]]\n{FILLER}\nvolume_fraction = 0.1\nparticle_index = 1.6\n[noise]",
        ),
        "ink",
    ),
    (
        "key of the layer in a population",
        (FILLER, FILLER + "\nthickness_um = 3"),
        "ink.filler",
    ),
    (
        "population without a radius",
        (FILLER, 'name = "filler"'),
        "ink.filler.radius_nm",
    ),
    (
        "radii without weights",
        ("number_weights = [1, 2, 1]\n", ""),
        "ink.filler",
    ),
    (
        "radii and a radius",
        (FILLER, FILLER + "\nradius_nm = 300"),
        "ink.filler",
    ),
    (
        "unequal radii and weights",
        ("number_weights = [1, 2, 1]", "number_weights = [1, 2]"),
        "ink.filler",
    ),
    (
        "radius of zero",
        ("radii_nm = [300, 500, 700]", "radii_nm = [0, 500, 700]"),
        "ink.filler",
    ),
    (
        "no spheres at all",
        ("number_weights = [1, 2, 1]", "number_weights = [0, 0, 0]"),
        "ink.filler",
    ),
    (
        "more particles than room",
        ("volume_fraction = 0.1\n", "volume_fraction = 0.5\n"),
        "volume_fraction",
    ),
    (
        "tie to an index with a dispersion",
        ("ink.particle_index.offset + 1.58", "plate.refractive_index + 0.1"),
        "ink.filler.particle_index",
    ),
]


@pytest.mark.parametrize(
    ("changes", "named"), [bad[1:] for bad in BAD_SAMPLES], ids=[bad[0] for bad in BAD_SAMPLES]
)
def test_the_key_is_named(changes, named, refused_sample):
    refused_sample(edited(GOOD, changes), named)
