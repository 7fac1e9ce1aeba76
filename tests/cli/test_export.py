"""The command that writes an ink for ray tracers."""

import dataclasses
import shlex
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.fitting.fitted_parameters import FittedParameter, FittedParameters
from jaxink.ink import TableOptions
from jaxink.ink.uncertainty import ParameterCovariance
from tests.ink.analytic_tables import smooth_table
from tests.samples import BEHIND_AIR, PRINTED_INK


def run(*arguments):
    return CliRunner().invoke(app, ["export", *map(str, arguments)])


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    table = smooth_table()
    table = dataclasses.replace(table, bsdf_standard_error_per_sr=0.01 * table.bsdf_per_sr)
    return table.to_netcdf(tmp_path_factory.mktemp("table") / "table.nc")


@pytest.mark.parametrize(
    ("format", "loss", "names"),
    [
        (
            "zemax",
            "beyond_critical,standard_errors",
            [f"ink_550nm_{c}.bsdf" for c in ("R_AA", "R_II", "T_AI", "T_IA")],
        ),
        ("lighttools", "standard_errors", ["ink_550nm.bsdf"]),
        ("speos", "standard_errors", [f"ink_550nm_{side}.anisotropicbsdf" for side in ("inside", "outside")]),
        (
            "integra",
            "standard_errors",
            ["ink_550nm_R_AA.ddr", "ink_550nm_R_II.ddr", "ink_550nm_T_AI.ddt", "ink_550nm_T_IA.ddt"],
        ),
        ("radiance", "standard_errors, index_step", ["ink_550nm.xml"]),
        ("mitsuba", "standard_errors", ["example_scene.py", "ink.nc", "jaxink_table.py"]),
        ("csv", "", ["ink_bsdf.csv", "ink_totals.csv"]),
        ("netcdf", "", ["ink.nc"]),
    ],
)
def test_each_format_is_written(format, loss, names, file, tmp_path, told):
    out = tmp_path / "out"
    done = run(file, "--format", format, "--out", out, "--allow-loss", loss)
    assert (done.exit_code, done.stderr) == (0, "")
    assert sorted(path.name for path in out.iterdir()) == sorted([*names, "ink_README.txt"])
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert all(str(out / name) in done.stdout for name in names)
    told(done.stdout, numbers=False)
    assert "Lost: " in done.stdout


def test_netcdf_comes_back_to_the_last_bit(file, tmp_path):
    from jaxink.ink import read_ink_table

    assert run(file, "--format", "netcdf", "--out", tmp_path, "--name", "red", "--quiet").stdout == ""
    first, again = read_ink_table(file), read_ink_table(tmp_path / "red.nc")
    np.testing.assert_array_equal(again.bsdf_per_sr, first.bsdf_per_sr)
    np.testing.assert_array_equal(again.bsdf_standard_error_per_sr, first.bsdf_standard_error_per_sr)


def test_a_refusal_is_one_sentence_and_writes_nothing(file, tmp_path, told):
    out = tmp_path / "two words"
    done = run(file, "--format", "lighttools", "--out", out)
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, "jaxink: LightTools .bsdf", "standard errors")
    sentence, what, command = done.stderr.splitlines()
    assert shlex.split(command) == [
        "jaxink", "export", str(file), "--format", "lighttools", "--out", str(out), "--allow-loss",
        "standard_errors",
    ]  # fmt: skip
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--format", "merl"), "merl"),
        (("--format", "csv", "--allow-loss", "all"), "'all'"),
        (("--format", "csv", "--regular-bin-deg", "5"), "CSV"),
        (("--format", "radiance", "--basis", "klems_half"), "klems_half"),
    ],
    ids=["format", "loss", "bin", "basis"],
)
def test_bad_options_are_refused(options, named, file, tmp_path, told):
    done = run(file, *options, "--out", tmp_path / "out")
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, "jaxink: ", named)
    assert list(tmp_path.iterdir()) == []


def test_a_result_is_tabulated_with_the_named_layers(tmp_path, monkeypatch, example_result):
    """The folder of a fit; the computation of the table has tests of its own."""
    asked = []

    def table_of(result, layers, options):
        asked.append((result.values, layers))
        return smooth_table()

    monkeypatch.setattr("jaxink.ink_table", table_of, raising=False)
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    example_result.save(tmp_path / "result")
    done = run(tmp_path / "result", "--format", "csv", "--out", tmp_path / "out", "--layer", "ink")
    assert done.exit_code == 0, done.stderr
    ((values, layers),) = asked
    assert layers == ["ink"]
    assert values == pytest.approx(example_result.values)


SMALL = ("--n-theta", "25", "--n-phi", "9")


@pytest.fixture
def saved(example_result, tmp_path):
    """Saves a sample as if it had been fitted, without standard errors; gives its folder."""

    def save(text):
        sample = jaxink.parse_sample(text)
        rows = tuple(
            FittedParameter(p.name, p.unit, p.value, None, p.value, p.minimum, p.maximum, False)
            for p in sample.parameters.values()
        )
        nothing = {"correlation_names": (), "correlations": np.zeros((0, 0)), "derived": ()}
        parameters = FittedParameters.of(rows)
        result = dataclasses.replace(example_result, sample=sample, parameters=parameters, **nothing)
        result.save(tmp_path / "my fit")
        return tmp_path / "my fit"

    return save


def commands(done):
    """Arguments of the whole commands that a refusal names, after ``jaxink export``."""
    assert done.exit_code == 5, done.output
    found = [shlex.split(line) for line in done.stderr.splitlines() if line.startswith("  ")]
    assert all(words[:2] == ["jaxink", "export"] for words in found)
    return [words[2:] for words in found]


def test_an_air_gap_is_not_taken_for_the_plate(saved, tmp_path):
    result, out = saved(BEHIND_AIR), tmp_path / "the files"
    asked = [result, "--format", "csv", "--out", out, *SMALL]
    from_air, from_plate = commands(run(*asked))
    assert not out.exists()
    asked = [*map(str, asked[:5]), *SMALL]
    expected = [["--layer", "ink", "--from", "air_gap"],
                ["--layer", "air_gap", "--layer", "ink", "--from", "plate"]]  # fmt: skip
    media = ("air_gap, refractive index 1", "plate, refractive index 1.5")
    for words, chosen, medium in zip((from_air, from_plate), expected, media, strict=True):
        assert sorted(words) == sorted([*asked, *chosen])
        done = run(*words)
        assert done.exit_code == 0, done.stderr
        readme = (out / "ink_README.txt").read_text()
        assert f"Side I, from which the ink is seen: {medium}." in readme
        assert all(line in done.stdout for line in readme.splitlines()[1:7])


@pytest.fixture(scope="module")
def gap_table():
    options = TableOptions(n_theta=45, n_phi=37, inside="plate", accuracy=1e-3)
    return jaxink.ink_table(jaxink.parse_sample(BEHIND_AIR), ["air_gap", "ink"], options=options)


@pytest.mark.parametrize("format", ["zemax", "lighttools", "speos", "radiance"])
def test_every_command_of_a_refusal_works(format, saved, tmp_path, gap_table, monkeypatch):
    """First the medium is chosen; its commands already keep regular light. Then the losses alone."""
    monkeypatch.setattr("jaxink.ink_table", lambda *_, options: gap_table, raising=False)
    asked = (
        saved(BEHIND_AIR),
        "--format",
        format,
        "--out",
        tmp_path / "files",
        "--n-theta",
        "45",
        "--name",
        "red",
    )
    _, from_plate = commands(run(*asked))
    asked = list(from_plate)
    for option in ("--allow-loss", "--regular-bin-deg"):
        if option in asked:
            at = asked.index(option)
            del asked[at : at + 2]
    # The first keeps total reflection, without which a plate guides no light.
    spread, leave_out = commands(run(*asked))
    assert sorted(spread) == sorted(from_plate)
    assert "--regular-bin-deg" in spread
    assert "regular" not in "".join(spread).split("allow-loss")[-1].split(",")
    assert "regular" in leave_out[leave_out.index("--allow-loss") + 1].split(",")
    for words in (spread, leave_out):
        done = run(*words)
        assert done.exit_code == 0, done.stderr
        assert ("Lost: regular" in done.stdout) == (words is not spread)
        assert (tmp_path / "files" / "red_README.txt").is_file()


def test_the_size_of_printed_dots_is_stated_beside_the_files(saved, tmp_path):
    source = saved(PRINTED_INK)
    told = run(source, "--format", "netcdf", "--out", tmp_path / "table", *SMALL).stdout
    readme = (tmp_path / "table" / "ink_README.txt").read_text(encoding="utf-8")
    assert run(source, "--as", "volume", "--format", "csv", "--out", tmp_path / "volume").exit_code == 0
    volume = (tmp_path / "volume" / "ink_volume.txt").read_text(encoding="utf-8")
    for text in (told, readme, volume):
        (line,) = (line for line in text.splitlines() if line.startswith("Printed dots: "))
        assert "times the ink's thickness" in line
    # A table that was exported still says so.
    again = run(tmp_path / "table" / "ink.nc", "--format", "csv", "--out", tmp_path / "again").stdout
    assert line in again


def test_a_refusal_needs_no_jax(saved, tmp_path):
    code = """
import sys
from typer.testing import CliRunner
from jaxink.cli.app import app
done = CliRunner().invoke(app, ["export", *sys.argv[1:]])
assert done.exit_code == 5 and "--from plate" in done.stderr, done.stderr
assert not {"jax", "equinox", "xarray"} & set(sys.modules)
"""
    arguments = (saved(BEHIND_AIR), "--format", "zemax", "--out", tmp_path / "files")
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments], check=False, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_a_table_is_refused_options_of_its_computation(file, tmp_path):
    for options in (("--layer", "ink"), ("--from", "plate"), ("--n-theta", "31")):
        done = run(file, "--format", "netcdf", "--out", tmp_path / "out", *options)
        assert (done.exit_code, done.stdout) == (5, "")
        assert options[0] in done.stderr


def test_a_sample_file_without_a_wavelength_is_refused(tmp_path, told):
    path = tmp_path / "ink.toml"
    path.write_text(PRINTED_INK.replace("wavelength_nm = 550\n", ""), encoding="utf-8")
    done = run(path, "--format", "csv", "--out", tmp_path / "files")
    assert done.exit_code == 5
    told(done.stderr, "wavelength_nm")


def test_the_ink_of_a_fit_that_is_not_sound_comes_with_a_warning(tmp_path):
    sentence = "The model does not fit: reduced chi-square 776, where the stated noise gives about 1."
    for verdict in ("consistent", "misfit", "not_converged", "overstated_noise"):
        table = smooth_table()
        table.attrs.update({"fit": sentence, "fit_verdict": verdict})
        table.to_netcdf(tmp_path / "table.nc")
        done = run(tmp_path / "table.nc", "--format", "csv", "--out", tmp_path / "out")
        assert done.exit_code == 0
        assert ("776" in done.stderr) == (verdict != "consistent")
        assert sentence in (tmp_path / "out" / "ink_README.txt").read_text()
        assert f"# fit: {sentence}" in (tmp_path / "out" / "ink_totals.csv").read_text()


def test_standard_errors_of_a_misfit_are_no_errors_of_its_ink(example_result):
    sound = ParameterCovariance.of(example_result)
    misfit = dataclasses.replace(example_result, whitened=5 * example_result.whitened)
    assert sound.known
    assert misfit.verdict.is_misfit
    assert not ParameterCovariance.of(misfit).known
    options = TableOptions(n_theta=13, n_phi=5, accuracy=1e-2)
    table = jaxink.ink_table(misfit, options=options)
    assert table.bsdf_standard_error_per_sr is None
    assert (table.attrs["fit"], table.attrs["fit_verdict"]) == (misfit.verdict.sentence, "misfit")
