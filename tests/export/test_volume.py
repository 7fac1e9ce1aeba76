"""The ink as a volume: what is written is read back, and gives the same light."""

import csv
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.special import roots_legendre
from typer.testing import CliRunner

import jaxink
from benchmarks.validation.render.speos_file import read_speos_material
from jaxink.cli.app import app
from jaxink.export.medium import gegenbauer, light_of, medium_of, short_forms
from jaxink.export.speos_material import write_speos_material
from jaxink.export.volume import even_table, write_volume
from jaxink.ink.ink_layers import find_ink
from jaxink.numerics.precision import computing
from jaxink.particles.phase_function import HenyeyGreenstein

PLATE = """schema_version = 1
wavelength_nm = [450, 650]
[surroundings]
index_front = 1.0
index_back = 1.0
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
refractive_index = 1.52
"""
HG = PLATE + (
    'phase_function = "henyey_greenstein"\nthickness_um = 63\nscattering_per_mm = 60\n'
    "absorption_per_mm = 0.4\nasymmetry_parameter = 0.8\n"
)
MIE = PLATE + (
    'phase_function = "mie"\nthickness_um = 63\nradius_nm = 250\nvolume_fraction = 0.0177\n'
    "particle_index = 1.8\nparticle_absorption_index = 0.001\n"
)


def medium(text):
    sample = jaxink.parse_sample(text)
    return medium_of(find_ink(sample, inside="front"), sample.wavelengths_nm)


@pytest.fixture(scope="module")
def mie():
    return medium(MIE)


@pytest.fixture(scope="module")
def written(mie, tmp_path_factory):
    folder = tmp_path_factory.mktemp("volume")
    files = write_volume(mie, "mitsuba", folder)
    return folder, [file.name for file in files]


def read_moments(values, n_moments=400):
    """Moments of a table that is linear in the cosine between equally spaced points from -1 to 1."""
    node, weight = roots_legendre(3000)
    phase = np.interp(node, np.linspace(-1, 1, len(values)), values)
    return np.polynomial.legendre.legvander(node, n_moments - 1).T @ (weight * phase) / 2


def test_a_medium_of_mitsuba_has_the_same_light_when_read_back(mie, written):
    folder, names = written
    assert names == [
        "ink_450nm_medium.xml",
        "ink_650nm_medium.xml",
        "ink_phase.csv",
        "ink_volume.csv",
        "ink_volume.txt",
    ]
    root = ElementTree.parse(folder / "ink_650nm_medium.xml").getroot()
    numbers = {e.get("name"): float(e.get("value")) for e in root.iter("spectrum")}
    assert numbers["sigma_t"] == pytest.approx(mie.extinction_per_mm[1], rel=1e-8)
    assert numbers["albedo"] == pytest.approx(mie.scattering_per_mm[1] / mie.extinction_per_mm[1], rel=1e-8)
    values = np.array(next(root.iter("string")).get("value").split(","), float)
    # Per steradian: its integral over the sphere is 1.
    moments = 4 * np.pi * read_moments(values)
    assert moments[0] == pytest.approx(1.0, abs=1e-4)
    assert moments[1] == pytest.approx(mie.asymmetry[1], abs=2e-4)
    for found, wanted in zip(light_of(mie, 1, moments / moments[0]), light_of(mie, 1), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=3e-3, atol=1e-4)


@pytest.mark.parametrize("waves", [(450.0, 650.0), (650.0,)])
def test_a_material_of_speos_has_the_same_light_when_read_back(waves, tmp_path):
    sample = jaxink.parse_sample(MIE)
    mie = medium_of(find_ink(sample, inside="front"), waves)
    write_speos_material(mie, tmp_path / "ink.material")
    read = read_speos_material(tmp_path / "ink.material")
    last = len(waves) - 1
    for curve, wanted in (
        (read.index, mie.refractive_index),
        (read.absorption_per_mm, mie.absorption_per_mm),
        (read.scattering_per_mm, mie.scattering_per_mm),
    ):
        np.testing.assert_allclose(curve, np.column_stack([waves, wanted]), rtol=1e-8)
    assert (read.angles_deg[0], read.angles_deg[-1]) == (0.0, 180.0)
    node, weight = roots_legendre(3000)
    phase = read.phase(node, last)
    # A relative intensity: the program normalises it.
    moments = np.polynomial.legendre.legvander(node, 399).T @ (weight * phase)
    assert moments[1] / moments[0] == pytest.approx(mie.asymmetry[last], abs=2e-4)
    for found, wanted in zip(light_of(mie, last, moments / moments[0]), light_of(mie, last), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=3e-3, atol=1e-4)


def test_values_and_table_are_those_of_the_medium(mie, written):
    folder, _ = written
    with (folder / "ink_volume.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["wavelength_nm"]) for row in rows] == [450.0, 650.0]
    for w, line in enumerate(rows):
        assert float(line["scattering_per_mm"]) == pytest.approx(mie.scattering_per_mm[w])
        assert float(line["g"]) == pytest.approx(mie.asymmetry[w])
        assert float(line["mean_free_path_mm"]) == pytest.approx(1 / mie.extinction_per_mm[w])
        assert (float(line["index_inside"]), float(line["index_outside"])) == (1.5, 1.0)
        assert float(line["thickness_mm"]) == pytest.approx(0.063)
    table = np.loadtxt(folder / "ink_phase.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(table[:, 1], mie.phase[0](np.cos(np.deg2rad(table[:, 0]))), rtol=1e-7)
    text = (folder / "ink_volume.txt").read_text()
    assert "do not add a surface BSDF" in text
    assert "0.063 mm" in text


def test_short_forms_of_henyey_and_greenstein_are_exact():
    one, two, kernel = short_forms(medium(HG), 0)
    assert one.numbers["g"] == pytest.approx(0.8)
    assert kernel.numbers["g"] == pytest.approx(0.8, abs=0.01)
    assert kernel.numbers["alpha"] == pytest.approx(0.5, abs=0.02)
    for form in (one, two, kernel):
        assert max(form.reflectance, form.transmittance) < 1e-3
        assert form.bsdf_rms < 0.01


def test_short_forms_of_spheres_say_how_wrong_they_are(mie):
    g = mie.asymmetry[1]
    one, two, kernel = short_forms(mie, 1)
    mean = (1 - two.numbers["weight_2"]) * two.numbers["g_1"] + two.numbers["weight_2"] * two.numbers["g_2"]
    assert mean == pytest.approx(g, abs=1e-4)
    cosine, weight = np.polynomial.legendre.leggauss(400)
    phase = gegenbauer(cosine, **kernel.numbers)
    assert weight @ phase / 2 == pytest.approx(1.0, abs=1e-8)
    assert weight @ (cosine * phase) / 2 == pytest.approx(g, abs=1e-3)
    assert one.bsdf_rms > 0.02
    assert all(0 < form.bsdf_rms < 1 for form in (one, two, kernel))


def test_an_even_table_keeps_the_mean_cosine_of_a_narrow_peak():
    with computing():
        phase = HenyeyGreenstein(0.97)
        cosine, value = even_table(lambda mu: np.asarray(phase.value(mu)))
    fine = np.linspace(-1, 1, 400_001)
    assert np.trapezoid(np.interp(fine, cosine, value) * fine, fine) / 2 == pytest.approx(0.97, abs=2e-4)


def test_the_command_writes_a_volume_and_refuses_tables(example_result, tmp_path):
    example_result.save(tmp_path / "fit")
    options = ["--format", "speos", "--out", str(tmp_path / "out"), "--as", "volume", "--from", "front"]
    done = CliRunner().invoke(app, ["export", str(tmp_path / "fit"), *options])
    assert (done.exit_code, done.stderr) == (0, "")
    assert "Speos" in (tmp_path / "out" / "ink_volume.txt").read_text()
    written = read_speos_material(tmp_path / "out" / "ink.material")
    assert written.scattering_per_mm[0, 0] == example_result.sample.wavelengths_nm[0]
    refused = CliRunner().invoke(app, ["export", str(tmp_path / "table.nc"), *options])
    assert refused.exit_code == 5
    assert "--as volume" in refused.stderr
