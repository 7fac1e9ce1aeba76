"""The commands in this process, on the embedded simulated measurement and a coarse discretisation."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.data import SIMULATED_TRUTH, STRAY_LIGHT_TRUTH, simulated_example
from jaxink.fitting import Outcome
from jaxink.numerics.program_store import write_program

DATA, SAMPLE = map(str, simulated_example())
FREE = tuple(SIMULATED_TRUTH)
RESULT = ("parameters.csv", "report.html", "result.json", "result.nc", "sample.toml")


@pytest.fixture
def run(monkeypatch, coarse):
    """Run the command; the test session's JAX settings stay as they are."""
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    monkeypatch.setattr("jaxink.model.forward.model_sizes", lambda *_: coarse)
    return lambda *arguments: CliRunner().invoke(app, [str(a) for a in arguments])


def fit(run, out, *more):
    return run("fit", DATA, "--sample", SAMPLE, "--out", out, *more)


def files(folder):
    return sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())


def test_fit_prints_the_result_and_writes_it(run, tmp_path, example_result, told):
    done = fit(run, tmp_path / "out")
    assert done.exit_code == 0
    # Without a terminal, the progress is written in lines.
    assert all(": step " in line or ": still running" in line for line in done.stderr.splitlines())
    written = ["figures/cuts_R_550nm.png", "figures/cuts_T_550nm.png", *RESULT]
    assert files(tmp_path / "out") == written
    assert all(str(tmp_path / "out" / name) in done.stdout for name in written)
    loaded = jaxink.load_result(tmp_path / "out")
    assert loaded.values == pytest.approx(example_result.values, rel=1e-9)
    row = next(line for line in done.stdout.splitlines() if line.strip().startswith("ink.scattering_per_mm"))
    assert row.split()[-3:] == ["500.5", "1", "1000"]
    told(done.stdout, "ink.scattering_per_mm", numbers=False)


def test_json_is_the_result_file(run, tmp_path):
    done = fit(run, tmp_path / "out", "--json", "--no-figures", "--profile", "none")
    assert done.exit_code == 0
    printed = json.loads(done.stdout)
    assert printed.pop("files") == [str(tmp_path / "out" / name) for name in RESULT]
    assert printed == json.loads((tmp_path / "out" / "result.json").read_text())


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--objective", "chi"), "objective"),
        (("--accuracy", "2"), "accuracy"),
        (("--layer-method", "mie"), "layer_method"),
        (("--profile", "some"), "profile"),
        (("--starts", "0"), "starts"),
    ],
    ids=["objective", "accuracy", "layer method", "profile", "starts"],
)
def test_bad_options_are_refused(options, named, run, tmp_path, told):
    done = fit(run, tmp_path / "out", *options)
    assert (done.exit_code, done.stdout) == (5, "")
    told(done.stderr, "jaxink: ", named)
    assert list(tmp_path.iterdir()) == []


def test_a_second_fit_takes_the_place_of_the_first(run, tmp_path):
    out = tmp_path / "out"
    assert fit(run, out, "--quiet", "--pdf", "--profile", "none").stdout == ""
    assert "figures/cuts_T_550nm.pdf" in files(out)
    (out / "notes.txt").write_text("mine")
    done = fit(run, out, "--quiet", "--no-figures", "--profile", "none", "--seed", "7")
    assert done.exit_code == 0
    # Figures of the first fit would lie about the second; a file of the user's stays.
    assert files(out) == ["notes.txt", *RESULT]
    assert jaxink.load_result(out).seed == 7
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_failed_writing_leaves_the_old_result(run, tmp_path, monkeypatch, told):
    out = tmp_path / "out"
    fit(run, out, "--quiet", "--no-figures", "--profile", "none")
    before = (out / "result.json").read_bytes()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("jaxink.files.writing.take_place", full)
    done = fit(run, out, "--profile", "none", "--quiet")
    assert done.exit_code == 5
    told(done.stderr, f"jaxink: {out}: ", "No space left on device")
    assert (out / "result.json").read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_simplex_that_does_not_converge_says_so(run, tmp_path, told):
    done = fit(run, tmp_path / "out", "--method", "simplex", "--max-evaluations", "8", "--no-figures")
    assert done.exit_code == 4
    told(done.stdout, numbers=False)
    result = jaxink.load_result(tmp_path / "out")
    assert result.outcome is Outcome.MAX_EVALUATIONS
    assert "--max-evaluations" in result.verdict.sentence


def test_a_fit_that_reaches_its_goal_is_a_success_without_standard_errors(run, tmp_path, told):
    done = fit(run, tmp_path / "out", "--objective", "absolute", "--goal", "0.01", "--no-figures")
    assert done.exit_code == 0
    told(done.stdout, numbers=False)
    result = jaxink.load_result(tmp_path / "out")
    assert result.outcome is Outcome.GOAL
    assert not result.converged
    assert not result.verdict.standard_errors_hold
    assert result.merit.rmsd_absolute_pi <= 0.01 * np.pi
    assert all(p.standard_error is None for p in result.parameters.values())


@pytest.mark.slow
def test_demo_leads_from_a_misfit_to_a_corrected_ink(run, tmp_path, told):
    out = tmp_path / "demo"
    done = run("demo", "--out", out)
    assert done.exit_code == 0
    assert "SIMULATED" in told(done.stdout, numbers=False).splitlines()[0]
    first, second = done.stdout.split("2. The diagnosis")
    fits, models = (
        {line.split()[0]: line.split()[1:] for line in part.splitlines() if len(line.split()) > 2}
        for part in (first, second)
    )
    for name, truth in STRAY_LIGHT_TRUTH.items():
        assert float(models[name][0]) == truth
    assert fits["Jacobians"][1] == "0"
    assert int(fits["evaluations"][1]) > int(fits["Jacobians"][0]) > 0
    declared, found = jaxink.load_result(out / "fit"), jaxink.load_diagnosis(out / "report")
    assert jaxink.load_result(out / "fit-simplex").converged
    # The page of the fit is there before anything else is computed.
    assert done.stdout.index(str(out / "fit" / "report.html")) < done.stdout.index("1. The fit")
    assert (out / "fit" / "report.html").is_file()
    assert declared.verdict.is_misfit
    assert not found.corrected.verdict.is_misfit
    for name, truth in STRAY_LIGHT_TRUTH.items():
        p = found.corrected[name]
        assert abs(p.value - truth) < 3 * p.standard_error
    # The folder of the diagnosis stands for the corrected model.
    again = jaxink.load_result(out / "report")
    np.testing.assert_allclose(again.predict()[again.data.used], again.predicted_per_sr, rtol=1e-9)
    assert jaxink.load_sample(out / "report").effects == again.sample.effects
    assert jaxink.load_sample(out / "report" / "sample.toml").parameters["stray_light.level_per_sr"].free
    assert {"ink_README.txt", "ink_bsdf.csv"} <= set(files(out / "ink"))
    assert "stray_light" in (out / "ink" / "ink_README.txt").read_text()


def test_predict_from_a_result_and_from_a_sample(run, tmp_path, example_result, told):
    example_result.save(tmp_path / "result")
    done = run("predict", tmp_path / "result", "--out", tmp_path / "own.csv")
    assert done.exit_code == 0
    own = jaxink.read(tmp_path / "own.csv")
    np.testing.assert_allclose(own.bsdf_per_sr, example_result.predicted_per_sr, rtol=1e-10)
    np.testing.assert_array_equal(own.extra["measured_per_sr"], example_result.data.bsdf_per_sr)
    assert own.sigma_per_sr is None
    done = run("predict", SAMPLE, DATA, "--out", tmp_path / "start.nc")
    told(done.stdout, numbers=False)
    start = jaxink.read(tmp_path / "start.nc")
    assert np.abs(start.bsdf_per_sr / own.bsdf_per_sr - 1).max() > 0.1
    told(start.attrs["bsdf_per_sr"], numbers=False)


def test_every_row_is_predicted_and_masked_ones_are_marked(run, tmp_path, told):
    rows = [line for line in Path(DATA).read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    # The specular direction, a negative value, and a wavelength that the sample does not name.
    new = ["30,30,180,550,R,0.1,0.01", "30,50,0,550,R,-0.001,0.01", "30,50,0,650,R,0.1,0.01"]
    (tmp_path / "more.csv").write_text("\n".join([rows[0], new[0], *rows[1:40], *new[1:]]))
    done = run("predict", SAMPLE, tmp_path / "more.csv", "--out", tmp_path / "all.csv")
    assert done.exit_code == 0
    told(done.stdout, "650 nm", "1 of 42", "specular", numbers=False)
    read, written = jaxink.read(tmp_path / "more.csv"), jaxink.read(tmp_path / "all.csv")
    for name in ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side"):
        assert np.array_equal(getattr(written, name), getattr(read, name))
    assert written.extra["masked"].tolist() == ["specular", *[""] * 39, "negative", ""]
    expected = jaxink.predict(SAMPLE, read)
    np.testing.assert_allclose(written.bsdf_per_sr, expected, rtol=1e-12)
    assert expected[-1] == pytest.approx(expected[-2])
    only = "\n".join([rows[0], new[0]])
    (tmp_path / "one.csv").write_text(only)
    assert run("predict", SAMPLE, tmp_path / "one.csv", "--out", tmp_path / "one.nc").exit_code == 0
    assert jaxink.read(tmp_path / "one.nc").mask.tolist() == [2]


def test_unexpected_error_is_one_sentence(run, tmp_path, monkeypatch, told):
    def broken(*_, **__):
        raise ZeroDivisionError("float division\nby zero")

    monkeypatch.setattr(jaxink, "read", broken, raising=False)
    done = fit(run, tmp_path / "out")
    assert (done.exit_code, done.stdout) == (1, "")
    told(done.stderr, "ZeroDivisionError: float division by zero", "JAXINK_DEBUG=1")
    assert done.stderr.count("\n") == 1
    assert isinstance(fit(run, tmp_path / "out", "--debug").exception, ZeroDivisionError)


def test_interruption_is_one_sentence(run, tmp_path, monkeypatch, told):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(jaxink, "fit", interrupted, raising=False)
    done = fit(run, tmp_path / "out")
    assert done.exit_code == 130
    told(done.stderr, "jaxink: ")
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("case", ["stored", "off", "open"])
def test_what_is_stored_and_why_not(case, run, tmp_path, monkeypatch, told):
    folder = tmp_path / "store"
    monkeypatch.setenv("JAXINK_CACHE_DIR", "" if case == "off" else str(folder))
    write_program("a", bytes(1000))
    if case == "open":
        if os.name != "posix":
            pytest.skip("rights as POSIX has them")
        folder.chmod(0o777)
    done = run("cache", "info")
    if case == "stored":
        assert done.exit_code == 0
        told(done.stdout, str(folder), "1 files")
        return
    assert done.exit_code == 5
    told(done.stderr, "JAXINK_CACHE_DIR", *([f"chmod -R go-w {folder}"] if case == "open" else []))
