"""``jaxink predict`` with other values, and under other conditions than those of the fit."""

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.cli.predict import other_conditions


@pytest.fixture
def run(monkeypatch, coarse, example_result, tmp_path):
    """Run the command on a saved fit."""
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    example_result.save(tmp_path / "fit")
    return lambda *words: CliRunner().invoke(app, ["predict", str(tmp_path / "fit"), *map(str, words)])


def predicted(file):
    return jaxink.read(file).bsdf_per_sr


def test_a_value_is_set_and_said(run, example_result, tmp_path):
    thickness = example_result.values["ink.thickness_um"]
    plain, same, thin = (tmp_path / f"{name}.csv" for name in ("plain", "same", "thin"))
    assert run("--out", plain).exit_code == 0
    assert run("--out", same, "--set", f"ink.thickness_um={thickness / 1000} mm").exit_code == 0
    done = run("--out", thin, "--set", f"ink.thickness_um={thickness / 2}", "--set", "plate.thickness_mm=2")
    assert done.exit_code == 0
    assert f"ink.thickness_um = {thickness / 2:g} um" in done.stdout
    assert "plate.thickness_mm = 2 mm" in done.stdout
    np.testing.assert_allclose(predicted(same), predicted(plain), rtol=1e-9)
    # Half of the ink reflects less and transmits more.
    transmits = example_result.data.is_transmission
    assert (predicted(thin)[~transmits] < predicted(plain)[~transmits]).mean() > 0.9
    assert (predicted(thin)[transmits] > predicted(plain)[transmits]).mean() > 0.9


def test_a_name_that_does_not_exist_gets_near_ones(run, tmp_path, told):
    done = run("--out", tmp_path / "out.csv", "--set", "ink.thicknes_um=60")
    assert done.exit_code == 5
    told(done.stderr, "ink.thickness_um")
    assert not (tmp_path / "out.csv").exists()


def test_other_conditions_are_said(example_result, told):
    data = example_result.data
    assert other_conditions(data, data) == []
    steep = data.replace(theta_i_deg=np.where(data.theta_i_deg == 60, 75.0, data.theta_i_deg))
    (line,) = other_conditions(steep, data)
    told(line, "75", "0 to 60")
    (line,) = other_conditions(data.replace(wavelength_nm=np.full(len(data), 600.0)), data)
    told(line, "600", "550")
    reflects = data.replace(is_transmission=np.zeros(len(data), bool))
    assert other_conditions(reflects, data) == []
    (line,) = other_conditions(data, reflects)
    told(line, "transmission")
