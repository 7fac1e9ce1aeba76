"""The command that writes a rough boundary alone for ray tracers."""

import re
import shlex
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from typer.testing import CliRunner

from jaxink.cli.app import app
from jaxink.ink import read_ink_table
from jaxink.ink.boundary import BoundaryOptions, boundary_table, facet_boundary
from jaxink.ink.boundary_file import DESCRIPTIONS, OTHER_KEYS, TOP_KEYS, load_boundary
from jaxink.ink.boundary_validity import validity_checks
from jaxink.ink.hemispherical_totals import power_sent_out
from jaxink.numerics.precision import computing
from tests.surfaces.densities import gaussian_slopes

DOCUMENT = (Path(__file__).resolve().parents[2] / "docs" / "manual" / "surfaces.md").read_text(
    encoding="utf-8"
)
SECTION = DOCUMENT[DOCUMENT.index("## A boundary as a table") : DOCUMENT.index("## References")]
MEDIA = "index_inside = 1.5\nindex_outside = 1.0\nwavelength_nm = 550\n"
FACETS = MEDIA + '[facets]\ndensity = "beckmann"\nsigma_deg = 20\n'
GAUSSIAN = MEDIA + "[gaussian]\nheight_rms_um = 0.05\ncorrelation_length_um = 1.2\n"
MAP = MEDIA + '[height_map]\nheights_um = "map.npy"\npitch_um = 0.25\nmethod = "waves"\n'
COARSE = ("--n-theta", "31", "--n-phi", "13")


@pytest.fixture(autouse=True)
def short_and_in_place(monkeypatch):
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    # The ends are worst; between them is only time.
    monkeypatch.setattr("jaxink.ink.boundary_validity.INCIDENCES_DEG", (0.0, 75.0))


@pytest.fixture(scope="module")
def maps(tmp_path_factory):
    """Simulated heights of 0.1 um root mean square and 3 um correlation length, as both kinds of file."""
    folder, n, pitch, length = tmp_path_factory.mktemp("maps"), 128, 0.25, 3.0
    frequency = np.hypot(*np.meshgrid(*[np.fft.fftfreq(n, pitch)] * 2))
    noise = np.fft.fft2(np.random.default_rng(3).standard_normal((n, n)))
    heights = np.fft.ifft2(noise * np.exp(-((np.pi * length * frequency) ** 2) / 2)).real
    heights *= 0.1 / heights.std()
    np.save(folder / "map.npy", heights)
    np.savetxt(folder / "map.csv", heights, delimiter=",", fmt="%.17g")
    np.save(folder / "profile.npy", heights[:1])
    np.save(folder / "flat.npy", np.zeros((32, 32)))
    (folder / "words.csv").write_text("1,2\n3,four\n")
    (folder / "ragged.csv").write_text("1,2\n3\n")
    (folder / "map.txt").write_text("1,2\n")
    return folder


def run(text, folder, *options):
    file = folder / "surface.toml"
    file.write_text(text)
    return CliRunner().invoke(app, ["boundary", str(file), *map(str, options)])


def described(text, folder):
    (folder / "described.toml").write_text(text)
    return load_boundary(folder / "described.toml")


def table_of(text, folder):
    return boundary_table(described(text, folder), n_theta=31, n_phi=13)


def test_facets_are_those_of_the_named_density(maps, tmp_path, told):
    done = run(FACETS, maps, "--format", "netcdf", "--out", tmp_path, *COARSE, "--limit-power")
    assert (done.exit_code, done.stderr) == (0, "")
    table = read_ink_table(tmp_path / "boundary.nc")
    with computing():
        density = gaussian_slopes(jnp.tan(jnp.deg2rad(20.0)) ** 2)
    expected = facet_boundary(density, [550.0], BoundaryOptions(1.5, 1.0, n_theta=31, n_phi=13))
    np.testing.assert_allclose(power_sent_out(table), 1.0, atol=1e-6)
    np.testing.assert_allclose(table.bsdf_per_sr, expected.bsdf_per_sr, rtol=1e-12, atol=1e-15)
    told(done.stdout, numbers=False)
    assert expected.attrs["power_of_table"] in done.stdout
    told(table.attrs["title"], "beckmann")


def test_waves_leave_the_regular_light_of_theory(maps):
    table = table_of(GAUSSIAN.replace("550", "[450, 650]").replace("1.5", "[1.5, 1.4]"), maps)
    phase = 4 * np.pi * 0.05 / np.array([0.45, 0.65])
    index = np.array([1.5, 1.4])
    fresnel = ((index - 1) / (index + 1)) ** 2
    np.testing.assert_allclose(table.regular[3, :, 0], fresnel * np.exp(-(phase**2)), rtol=1e-9)
    np.testing.assert_allclose(table.regular[0, :, 0], fresnel * np.exp(-((index * phase) ** 2)), rtol=1e-9)


def test_k_correlation_has_its_numbers(maps):
    text = MEDIA + "[k_correlation]\nheight_rms_um = 0.1\nlength_b_um = 5\nexponent = 4.5\n"
    shape = described(text, maps).shape
    with computing():
        variance = float(shape.slope_variance)
    assert variance == pytest.approx(4 * np.pi**2 * 0.1**2 / (5**2 * 0.5))


def test_maps_of_either_kind_of_file_are_the_same_surface(maps):
    first = described(MAP, maps)
    second = described(MAP.replace("map.npy", "map.csv").replace("0.25", "[0.25, 0.25]"), maps)
    assert np.sqrt(first.shape.height_variance_um2) == pytest.approx(0.1, rel=0.1)
    np.testing.assert_array_equal(second.heights.heights_um, first.heights.heights_um)
    for one, other in zip(jax.tree.leaves(first.shape), jax.tree.leaves(second.shape), strict=True):
        np.testing.assert_array_equal(one, other)


def test_height_scale_has_its_standard_error(maps):
    scale = "height_scale = 0.5\nheight_scale_standard_error = 0.01\n"
    plain, scaled = table_of(MAP, maps), table_of(MAP + scale, maps)
    assert plain.regular_standard_error is None
    # Fresnel exp(-A^2 (s sigma)^2), and its derivative by s.
    exponents = [np.log(table.regular[3, 0, 0] / 0.04) for table in (plain, scaled)]
    assert exponents[1] == pytest.approx(exponents[0] / 4, rel=1e-9)
    expected = abs(2 * exponents[1] / 0.5) * 0.01 * scaled.regular[3, 0, 0]
    assert scaled.regular_standard_error[3, 0, 0] == pytest.approx(expected, rel=1e-3)
    # Transmitted light sees few heights, and is scattered as their variance: twice two per cent.
    lobe, error = (
        values[2, 0, 12, :, -1] for values in (scaled.bsdf_per_sr, scaled.bsdf_standard_error_per_sr)
    )
    assert error[np.argmax(lobe)] / lobe.max() == pytest.approx(0.04, rel=0.1)


def test_what_holds_is_said(maps, tmp_path, told):
    rough = MAP.replace("waves", "facets")
    done = run(rough, maps, "--format", "netcdf", "--out", tmp_path, *COARSE, "--limit-power")
    verdicts = {line.split()[0]: line for line in done.stdout.splitlines() if line.startswith("  ")}
    told(verdicts["a_sigma_transmission"], "above 5", numbers=False)
    told(verdicts["a_sigma_reflection"], "75 degrees, 550 nm", numbers=False)
    holds = {check.name: check.holds for check in validity_checks(described(rough, maps))}
    assert holds["slope_growth"]
    assert holds["anisotropy"]
    assert holds["a_sigma_reflection"] is False
    told(verdicts["slope_growth"], numbers=False)
    told(verdicts["anisotropy"], numbers=False)


def test_judgement_follows_the_heights(maps):
    def holds(text):
        return {check.name: check for check in validity_checks(described(text, maps))}

    smooth, rough = holds(GAUSSIAN.replace("0.05", "0.002")), holds(GAUSSIAN.replace("0.05", "0.5"))
    assert all(check.holds in (None, True) for check in smooth.values())
    for name in ("slope", "slope_over_grazing_slope", "power_error"):
        assert not rough[name].holds
    # 2 pi 1.5 (1 + 1) sigma / lambda, from inside at normal incidence.
    assert rough["a_sigma_reflection"].largest == pytest.approx(6 * np.pi * 0.5 / 0.55, rel=1e-9)
    high = holds(MAP.replace("waves", "facets") + "height_scale = 300\n")
    assert high["a_sigma_reflection"].holds
    assert high["a_sigma_transmission"].holds


def test_more_power_than_arrives_is_refused_unless_limited(maps, tmp_path, told):
    done = run(GAUSSIAN.replace("0.05", "0.2"), maps, "--format", "csv", "--out", tmp_path / "out", *COARSE)
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, f"jaxink: {maps / 'surface.toml'}: ", "550 nm", "--limit-power", numbers=False)
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


REFUSED = {
    "no index": (FACETS.replace("index_outside = 1.0\n", ""), "index_outside"),
    "two indices": (FACETS.replace("1.5", "[1.5, 1.6]"), "index_inside"),
    "glass": (FACETS.replace("1.5", '"glass"'), "index_inside"),
    "descending": (FACETS.replace("550", "[650, 550]"), "wavelength_nm"),
    "micrometres": (FACETS.replace("550", "0.55"), "wavelength_nm"),
    "facet": (FACETS.replace("[facets]", "[facet]"), "'facet'"),
    "a sample file": (FACETS.replace("[facets]", "[[layers]]"), "sample file"),
    "no table": (MEDIA, "height_map"),
    "two tables": (FACETS + "[gaussian]\n", "gaussian"),
    "phong": (FACETS.replace("beckmann", "phong"), "phong"),
    "steep": (FACETS.replace("20", "60"), "facets.sigma_deg"),
    "sigma_um": (GAUSSIAN.replace("height_rms_um", "sigma_um"), "sigma_um"),
    "exponent": (
        MEDIA + "[k_correlation]\nheight_rms_um = 0.1\nlength_b_um = 5\nexponent = 2\n",
        "k_correlation.exponent",
    ),
    "rays": (MAP.replace("waves", "rays"), "'rays'"),
    "heights": (MAP.replace('"map.npy"', "3"), "height_map.heights_um"),
    "three pitches": (MAP.replace("0.25", "[1, 2, 3]"), "height_map.pitch_um"),
    "no pitch": (MAP.replace("0.25", "0"), "height_map.pitch_um"),
    "flat": (MAP.replace("map.npy", "flat.npy").replace("waves", "facets"), "height_map.heights_um"),
    "standard error": (MAP + "height_scale_standard_error = 1.5\n", "height_map.height_scale_standard_error"),
    "no TOML": ("index_inside = \n", ": "),
}


@pytest.mark.parametrize(("text", "named"), REFUSED.values(), ids=REFUSED)
def test_wrong_files_are_refused_by_key(text, named, maps, tmp_path, told):
    done = run(text, maps, "--format", "csv", "--out", tmp_path / "out")
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, f"jaxink: {maps / 'surface.toml'}: ", named)
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("file", "method", "named"),
    [
        ("none.npy", "waves", "none.npy"),
        ("map.txt", "waves", ".npy"),
        ("words.csv", "waves", "words.csv, row 2, column 2"),
        ("ragged.csv", "waves", "ragged.csv, row 2"),
        ("profile.npy", "facets", "heights_um"),
    ],
)
def test_wrong_maps_are_refused_by_place(file, method, named, maps, tmp_path, told):
    text = MAP.replace("map.npy", file).replace("waves", method)
    done = run(text, maps, "--format", "csv", "--out", tmp_path / "out")
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, f"jaxink: {maps / 'surface.toml'}: ", "height_map.heights_um", named)
    assert done.stderr.count("\n") == 1


def test_tables_beyond_memory_are_refused(maps, tmp_path, told):
    done = run(FACETS, maps, "--format", "csv", "--out", tmp_path / "out", "--n-theta", "1000000")
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, "n_theta", 1000000, "n_phi")
    assert done.stderr.count("\n") == 1


def test_example_of_the_documents_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = next(block for block in re.findall(r"```toml\n(.*?)```", SECTION, re.DOTALL))
    (command,) = re.findall(r"^jaxink (boundary .*)$", DOCUMENT, re.MULTILINE)
    words = shlex.split(command)
    Path(words[1]).write_text(text)
    done = CliRunner().invoke(app, [*words, *COARSE])
    assert (done.exit_code, done.stderr) == (0, "")
    assert any(Path(words[words.index("--out") + 1]).iterdir())


def test_every_key_is_documented():
    for key in {*TOP_KEYS, *(k for keys in (*DESCRIPTIONS.values(), *OTHER_KEYS.values()) for k in keys)}:
        assert f"`{key}`" in SECTION, key
