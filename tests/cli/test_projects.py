"""Projects at the command line: fitted, refused where one measurement is needed, and planned further."""

import json
import shutil
import tomllib
import types

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from tests.projects.conftest import TRUTH, fitted, project, project_folder  # noqa: F401


@pytest.fixture
def run(monkeypatch):
    """Run the command; the test session's JAX settings stay as they are."""
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    return lambda *arguments: CliRunner().invoke(app, [str(a) for a in arguments])


def test_a_project_is_fitted_and_written(run, project_folder, tmp_path):  # noqa: F811
    out = tmp_path / "out"
    done = run("fit", project_folder / "project.toml", "--out", out, "--profile", "none")
    assert done.exit_code == 0, done.output
    page = (out / "report.html").read_text()
    for name in ("thin", "thick", "thick_lit_ink"):
        assert name in done.stdout
        assert (out / "measurements" / name / "report.html").exists()
        assert f'href="measurements/{name}/report.html"' in page
    assert "The measurements agree" in done.stdout
    loaded = jaxink.load_joint_result(out)
    assert loaded.parameters.keys() >= TRUTH.keys()
    assert (out / "parameters.csv").read_text().count("\n") == len(loaded.parameters) + 1


def test_json_is_the_result_file(run, project_folder, tmp_path):  # noqa: F811
    arguments = "--no-figures", "--profile", "none", "--json"
    done = run("fit", project_folder / "project.toml", "--out", tmp_path / "out", *arguments)
    printed = json.loads(done.stdout)
    del printed["files"]
    assert printed == json.loads((tmp_path / "out" / "joint.json").read_text())


@pytest.mark.parametrize(
    ("more", "named"),
    [
        (("--sample", "ink.toml"), "--sample"),
        (("--side", "R"), "side"),
        (("--rows", "side=R", "--side", "R"), "`rows`"),
        (("other.csv",), "other"),
    ],
)
def test_what_a_project_states_itself_is_refused(run, more, named, project_folder, tmp_path, told):  # noqa: F811
    done = run("fit", project_folder / "project.toml", *more, "--out", tmp_path / "out")
    assert done.exit_code == 5
    told(done.stderr, "project.toml", named)


def test_a_prediction_of_a_project_takes_a_folder(run, project_folder, tmp_path, told):  # noqa: F811
    done = run("predict", project_folder / "project.toml", "--out", tmp_path / "all.csv")
    assert done.exit_code == 5
    assert "--measurement" not in told(done.stderr, "all.csv", "give a folder")


def test_a_measurement_needs_a_sample(run, project_folder, tmp_path, told):  # noqa: F811
    done = run("fit", project_folder / "thin.csv", "--out", tmp_path / "out")
    assert done.exit_code == 5
    told(done.stderr, "--sample")


@pytest.mark.parametrize(
    "option",
    [
        ("--sample", "ink.toml"),
        ("--resume",),
        ("--time-limit", "60"),
        ("--level", "0.1"),
        ("--bootstrap", "10"),
        ("--max-parameters", "2"),
        ("--seed", "1"),
    ],
)
def test_what_a_project_takes_no_option_for(run, project_folder, tmp_path, option, told):  # noqa: F811
    done = run("diagnose", project_folder / "project.toml", *option, "--out", tmp_path / "out")
    assert done.exit_code == 5
    told(done.stderr, option[0])


def test_a_joint_fit_without_a_minimum_is_not_diagnosed(run, project_folder, tmp_path, monkeypatch, told):  # noqa: F811
    stopped = types.SimpleNamespace(outcome=jaxink.fitting.Outcome.STALLED)
    monkeypatch.setattr("jaxink.diagnosis.joint.search.fit_project", lambda *_: stopped)
    done = run("diagnose", project_folder / "project.toml", "--out", tmp_path / "out")
    assert done.exit_code == 4
    told(done.stderr, "no minimum", "start values")


def test_a_project_is_diagnosed(run, project_folder, tmp_path):  # noqa: F811
    out = tmp_path / "out"
    # Without a search, which tests/projects has; here it is about what is written and told.
    done = run(
        "diagnose", project_folder / "project.toml", "--out", out, "--max-effects", "0", "--no-figures"
    )
    assert done.exit_code == 0, done.output
    assert "fits all measurements as it is" in done.stdout
    assert (out / "joint_report.json").exists()
    page = (out / "report.html").read_text()
    assert "no_misfit" in page
    for name in ("declared", "corrected"):
        assert (out / name / "joint.json").exists()
        assert (out / name / "report.html").exists()
    # Nothing was found, so that there is one model.
    assert 'href="corrected/report.html"' in page
    assert 'href="declared/report.html"' not in page
    predicted = run("predict", out, "--out", tmp_path / "thin.csv", "--measurement", "thin", "--quiet")
    assert predicted.exit_code == 0, predicted.output
    assert jaxink.load_joint_result(out).to_dict() == jaxink.load_joint_result(out / "corrected").to_dict()


def test_the_plan_is_printed_and_written(run, project_folder, tmp_path):  # noqa: F811
    data, sample = project_folder / "thin.csv", project_folder / "ink.toml"
    assert run("fit", data, "--sample", sample, "--out", tmp_path / "fit", "--no-figures").exit_code == 0
    done = run("plan", tmp_path / "fit", "--target", "ink.absorption_per_mm", "--out", tmp_path / "next.toml")
    assert done.exit_code == 0, done.output
    assert "ink.absorption_per_mm" in done.stdout
    text = (tmp_path / "next.toml").read_text()
    assert "To be measured" in text
    # The present measurement is there as it was read; the table of the new one is still empty.
    (tmp_path / "now.toml").write_text(text[: text.index("# To be measured")])
    [there] = jaxink.load_project(tmp_path / "now.toml").measurements
    np.testing.assert_array_equal(there.data.bsdf_per_sr, jaxink.read(data).bsdf_per_sr)
    again = run("plan", tmp_path / "fit", "--out", tmp_path / "next.toml")
    assert again.exit_code == 5
    assert "exists already" in again.stderr


def test_a_project_is_fitted_and_planned(run, project_folder, tmp_path):  # noqa: F811
    folder = shutil.copytree(project_folder, tmp_path / "folder")
    source, out = folder / "project.toml", folder / "next.toml"
    done = run("plan", source, "--out", out)
    assert done.exit_code == 0, done.output
    assert "The model fits within" in done.stdout
    present = [one.name for one in jaxink.load_project(source).measurements]
    assert "Add this table" not in out.read_text()
    named = tomllib.loads(out.read_text())["measurements"]
    assert [one["name"] for one in named[:-1]] == present
    assert named[-1]["name"] not in present
    # Elsewhere, the files of the project would not be found.
    away = tmp_path / "next.toml"
    assert run("plan", source, "--out", away, "--target", "ink.absorption_per_mm").exit_code == 0
    assert len(tomllib.loads(away.read_text())["measurements"]) == 1


def test_a_plan_takes_no_sample_file(run, project_folder, told):  # noqa: F811
    done = run("plan", project_folder / "ink.toml")
    assert done.exit_code == 5
    told(done.stderr, "ink.toml", "sample file")


@pytest.mark.parametrize(
    ("arguments", "named"), [(("--readings", "0"), "readings"), (("--target", "ink.size"), "ink.size")]
)
def test_a_bad_plan_is_refused(run, arguments, named, project_folder, tmp_path, told):  # noqa: F811
    data, sample = project_folder / "thin.csv", project_folder / "ink.toml"
    run("fit", data, "--sample", sample, "--out", tmp_path / "fit", "--no-figures")
    done = run("plan", tmp_path / "fit", *arguments)
    assert done.exit_code == 5
    told(done.stderr, named)


@pytest.fixture(scope="module")
def saved(fitted, tmp_path_factory):  # noqa: F811
    """Folder of the joint fit."""
    folder = tmp_path_factory.mktemp("joint") / "fit"
    fitted.save(folder)
    return folder


def test_every_measurement_of_a_joint_fit_is_predicted(run, saved, fitted, tmp_path):  # noqa: F811
    done = run("predict", saved, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    for name, predicted in fitted.predict().items():
        written = jaxink.read(tmp_path / "out" / f"{name}.csv")
        np.testing.assert_allclose(written.bsdf_per_sr, predicted, rtol=1e-9)
    done = run("predict", saved, "--out", tmp_path / "thick.csv", "--measurement", "thick")
    assert done.exit_code == 0, done.stderr
    alone = jaxink.read(tmp_path / "thick.csv").bsdf_per_sr
    np.testing.assert_allclose(alone, fitted.predict()["thick"], rtol=1e-9)


def test_a_project_file_is_predicted_from_its_start_values(run, project_folder, project, tmp_path):  # noqa: F811
    done = run("predict", project_folder / "project.toml", "--out", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    for one in project.measurements:
        written = jaxink.read(tmp_path / "out" / f"{one.name}.csv").bsdf_per_sr
        np.testing.assert_allclose(written, jaxink.predict(one.sample, one.data), rtol=1e-9)


def test_the_ink_of_a_joint_fit_is_exported_once_its_measurement_is_named(run, saved, tmp_path, told):
    export = "export", saved, "--format", "csv", "--from", "plate", "--out", tmp_path / "ink"
    sizes = "--n-theta", "31", "--n-phi", "19"
    done = run(*export, *sizes)
    assert done.exit_code == 5
    told(done.stderr, "--measurement", "thin, thick, thick_lit_ink")
    assert run(*export, *sizes, "--measurement", "thin").exit_code == 0
    direct = ("export", saved / "measurements" / "thin", *export[2:-1], tmp_path / "direct", *sizes)
    assert run(*direct).exit_code == 0
    for file in (tmp_path / "direct").glob("*.csv"):
        assert (tmp_path / "ink" / file.name).read_text() == file.read_text()


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--out", "all.csv"), ("all.csv", "--measurement")),
        (("--out", "all", "--set", "ink.thickness_um=9"), ("--set", "--measurement")),
        (("--out", "one.csv", "--measurement", "thinner"), ("thinner", "thin, thick, thick_lit_ink")),
    ],
    ids=["file", "set", "unknown"],
)
def test_a_prediction_of_a_joint_fit_is_refused(run, saved, monkeypatch, tmp_path, words, named, told):
    monkeypatch.chdir(tmp_path)
    done = run("predict", saved, *words)
    assert done.exit_code == 5
    told(done.stderr, *named)


def test_a_value_of_a_project_is_set_in_its_file(run, project_folder, tmp_path, told):  # noqa: F811
    file = project_folder / "project.toml"
    done = run("predict", file, "--out", tmp_path / "all", "--set", "ink.thickness_um=9")
    assert done.exit_code == 5
    told(done.stderr, "--set", "changes")


def test_a_plain_fit_has_no_measurement_to_choose(run, saved, tmp_path, told):
    done = run("predict", saved / "measurements" / "thin", "--out", tmp_path / "a.csv", "--measurement", "b")
    assert done.exit_code == 5
    told(done.stderr, "joint fit")
