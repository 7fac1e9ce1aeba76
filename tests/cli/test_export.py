"""The command that writes an ink for ray tracers."""

import dataclasses
import shlex

import numpy as np
import pytest
from typer.testing import CliRunner

from jaxink.cli.app import app
from tests.ink.analytic_tables import smooth_table


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
        ("radiance", "standard_errors, index_step", ["ink_550nm.xml"]),
        ("mitsuba", "", ["example_scene.py", "ink.nc", "jaxink_table.py"]),
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
    assert all(name.strip() in done.stdout for name in loss.split(","))


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
