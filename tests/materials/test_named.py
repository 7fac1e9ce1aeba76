"""Materials by name, and quantities that name them."""

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.errors import InputRefusedError
from jaxink.materials import material, names

INK = """
schema_version = 1
wavelength_nm = [450, 550, 650]
[[layers]]
name = "plate"
kind = "clear"
refractive_index = { material = "pmma" }
thickness_mm = 3
absorption_per_mm = { material = "pmma" }
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = 20
radius_nm = 120
volume_fraction = { free = true, min = 0.001, max = 0.3, value = 0.1 }
particle_index = { material = "rutile" }
[[layers.populations]]
name = "red"
radius_nm = 100
volume_fraction = { free = true, min = 0.001, max = 0.3, value = 0.05 }
particle_index = { material = "hematite" }
particle_absorption_index = { material = "hematite" }
"""


@pytest.mark.parametrize(
    ("name", "n"),
    # Textbook values at the sodium line; of crystals, the mean of two ordinary and one extraordinary axis.
    [
        ("rutile", (2 * 2.612 + 2.908) / 3),
        ("zinc_oxide", (2 * 2.002 + 2.018) / 3),
        ("calcite", (2 * 1.658 + 1.486) / 3),
        ("pmma", 1.492),
        ("polycarbonate", 1.5845),
        ("polystyrene", 1.591),
        ("water", 1.333),
    ],
)
def test_indices_are_those_of_the_books(name, n):
    assert material(name).n(np.array([589.0]))[0] == pytest.approx(n, abs=2e-3)


def test_hematite_is_red_and_carbon_black():
    red = material("hematite").k(np.array([450.0, 650.0]))
    assert red[0] > 5 * red[1]
    assert np.all(material("carbon").k(np.array([450.0, 650.0])) > 0.5)


def test_each_has_its_source_and_licence():
    for name in names():
        one = material(name)
        assert "CC0" in one.sources[-1]
        assert len(one.sources) >= 2
        assert np.all(np.diff(one.wavelength_nm) > 0)


def test_a_sample_of_pigments_by_name():
    sample = jaxink.parse_sample(INK)
    at = sample.at_wavelength(sample.parameters.values_with({}), 550.0)
    assert at["ink.particle_index"] == pytest.approx(material("rutile").n(np.array([550.0]))[0])
    assert at["ink.red.particle_absorption_index"] == pytest.approx(0.4853, abs=1e-3)
    k = material("pmma").k(np.array([550.0]))[0]
    assert at["plate.absorption_per_mm"] == pytest.approx(4 * np.pi * k / 550e-6)
    assert [p.name for p in sample.parameters.free] == ["ink.volume_fraction", "ink.red.volume_fraction"]


def test_a_spectrum_from_a_file(tmp_path):
    (tmp_path / "k.csv").write_text("wavelength_nm,dye,other\n400,1,9\n600,3,9\n700,3,9\n")
    text = INK.replace(
        "absorption_per_mm = { material", 'absorption_per_mm = { file = "k.csv", column = "dye" }\n#'
    )
    sample = jaxink.parse_sample(text, folder=tmp_path)
    found = [sample.parameters[f"plate.absorption_per_mm@{w}"].value for w in (450, 550, 650)]
    np.testing.assert_allclose(found, [1.5, 2.5, 3.0])


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ('material = "rutile"', 'material = "rutil"', "rutil"),
        ('material = "rutile"', 'material = "rutile", value = 2', "value"),
        ('material = "rutile"', "material = 3", "text"),
        ("[450, 550, 650]", "[250, 550, 650]", "250"),
        ("radius_nm = 120", 'radius_nm = { material = "rutile" }', "radius_nm"),
        ("wavelength_nm = [450, 550, 650]", "", "wavelength"),
    ],
)
def test_wrong_uses_have_their_sentences(old, new, named, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.parse_sample(INK.replace(old, new))
    told(str(refused.value), named)


def test_a_file_that_ends_too_early(tmp_path, told):
    (tmp_path / "k.csv").write_text("wavelength_nm,absorption_per_mm\n400,1\n600,3\n")
    text = INK.replace("absorption_per_mm = { material", 'absorption_per_mm = { file = "k.csv" }\n#')
    with pytest.raises(InputRefusedError) as refused:
        jaxink.parse_sample(text, folder=tmp_path)
    told(str(refused.value), "k.csv", "600", "650")


def test_the_command_lists_them():
    done = CliRunner().invoke(app, ["materials"])
    assert done.exit_code == 0
    for name in names():
        assert name in done.stdout
