"""``jaxink colour``."""

import dataclasses
import json

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.data import simulated_example


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A fit of two wavelengths with few free parameters."""
    folder = tmp_path_factory.mktemp("colour")
    data, sample = (f(p) for f, p in zip((jaxink.read, jaxink.load_sample), simulated_example(), strict=True))
    data = data.select(theta_i_deg=0.0)
    both = jaxink.GonioData(
        *(np.concatenate([getattr(data, name)] * 2) for name in ("theta_i_deg", "theta_o_deg", "phi_deg")),
        np.repeat([550.0, 600.0], len(data)),
        np.concatenate([data.is_transmission] * 2),
        np.concatenate([data.bsdf_per_sr] * 2),
    )
    sample = dataclasses.replace(sample, wavelengths_nm=(550.0, 600.0))
    jaxink.fit(both, sample, options=jaxink.FitOptions(accuracy=1e-2)).save(folder)
    return folder


@pytest.fixture
def run(monkeypatch, saved):
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    return lambda *words: CliRunner().invoke(app, ["colour", str(saved), *map(str, words)])


def test_the_same_ink_at_two_wavelengths_is_grey(run):
    done = run("--json", "--geometry", "8:di", "--geometry", "8:de")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert [one["name"] for one in found["colours"]] == ["8:di", "8:de"]
    for one in found["colours"]:
        assert abs(one["a"]) < 0.01
        assert abs(one["b"]) < 0.01
    assert found["colours"][0]["range_nm"] == [550, 600]
    assert found["ciede2000_measured_against_fitted"]["reflection"]["mean"] < 1


def test_tables_and_arrangements(run):
    done = run("--geometry", "8:di", "--thickness-um", 200, "--over", "0,5", "--free", "--illuminant", "A")
    assert done.exit_code == 0, done.output
    assert "200 um, free, over 0.5" in done.stdout
    assert "Illuminant A, 550 to 600 nm only" in done.stdout


def test_wrong_options(run, told):
    for words, named in (
        (("--over", "paper"), "paper"),
        (("--illuminant", "D55"), "D55"),
        (("--observer", 3), "2 or 10"),
        (("--geometry", "8/d"), "8/d"),
    ):
        done = run(*words)
        assert done.exit_code == 5, done.output
        told(done.stderr, named)


def test_a_sample_file_has_colours_without_errors(saved, run):
    one = ["--json", "--geometry", "8:di"]
    done = CliRunner().invoke(app, ["colour", str(saved / "sample.toml"), *one])
    assert done.exit_code == 0, done.output
    of_sample, of_fit = (json.loads(text)["colours"][0] for text in (done.stdout, run(*one).stdout))
    assert of_sample["L"] == pytest.approx(of_fit["L"], rel=1e-6)
    assert of_sample["standard_errors"] is None
    assert of_fit["standard_errors"]["L"] > 0
