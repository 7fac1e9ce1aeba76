"""What the command line says of the columns of a table reaches the reader."""

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.cli.session import ExitCode
from jaxink.data import simulated_example
from jaxink.measurement.columns import option_words
from jaxink.projects.schema import READING


@pytest.fixture
def run(monkeypatch, tmp_path):
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    monkeypatch.chdir(tmp_path)
    return lambda *arguments: CliRunner().invoke(app, arguments)


@pytest.fixture
def other_table(tmp_path):
    """The example with another header, and its values times the cosine; the names of both as options."""
    data = jaxink.read(simulated_example()[0])
    frame = data.to_frame()[["theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr"]]
    frame["bsdf_per_sr"] *= np.cos(np.deg2rad(frame["theta_o_deg"]))
    frame = frame.rename(columns={"theta_o_deg": "arm = 2", "bsdf_per_sr": "reading"})
    frame.to_csv(tmp_path / "other.csv", index=False)
    named = ("--columns", "theta_o_deg=arm = 2", "--columns", "bsdf_per_sr=reading")
    return data, (*named, "--cosine-weighted")


def test_columns_and_cosine_of_any_table_are_stated(run, other_table, tmp_path):
    data, options = other_table
    assert run("convert", "other.csv", "--out", "plain.csv", *options).exit_code == 0
    np.testing.assert_allclose(jaxink.read(tmp_path / "plain.csv").bsdf_per_sr, data.bsdf_per_sr, rtol=1e-12)
    result = run("init", "other.csv", "--out", "sample.toml", *options)
    assert result.exit_code == 0
    # The command that it proposes reads the same.
    assert "--cosine-weighted" in result.output
    assert "bsdf_per_sr=reading" in result.output


@pytest.mark.parametrize("given", [("arm",), ("theta_o_deg=",), ("=arm",), ("side=a", "side=b")])
def test_columns_need_a_name_and_a_header(given, run, other_table, told):
    options = [part for text in given for part in ("--columns", text)]
    result = run("convert", "other.csv", "--out", "plain.csv", *options)
    assert result.exit_code == ExitCode.REFUSED
    told(result.output, "--columns")


@pytest.mark.parametrize("command", ["fit", "diagnose", "predict", "init", "convert"])
def test_what_a_plan_or_project_states_every_command_that_reads_can_state(command):
    options = {o for p in typer.main.get_command(app).commands[command].params for o in p.opts}
    named = option_words(dict.fromkeys(READING, "x") | {"columns": {"side": "x"}, "rows": {"lit_side": "x"}})
    assert {word for word in named if word.startswith("--")} <= options


def test_the_next_command_states_the_same():
    stated = {"columns": {"phi_deg": "a b", "side": "s"}, "side": ["R", "T"], "sample": "x"}
    stated |= {"cosine_weighted": False, "signed_angles": True, "theta_i_deg": [0.0, 30.0], "phi_deg": 180.0}
    stated |= {"sheet": "A=R,B=T", "matrix": "theta_o_deg,phi_deg"}
    words = ["--columns", "phi_deg=a b", "--columns", "side=s", "--side", "R,T", "--which", "x"]
    words += ["--no-cosine-weighted", "--signed-angles", "--theta-i-deg", "0.0,30.0", "--phi-deg", "180.0"]
    assert option_words(stated) == [*words, "--sheet", "A=R,B=T", "--matrix", "theta_o_deg,phi_deg"]
