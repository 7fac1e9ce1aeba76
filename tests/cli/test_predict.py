"""``jaxink predict`` with other values, and under other conditions than those of the fit."""

import csv
import re
from importlib import resources

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


@pytest.fixture
def by_wavelength(tmp_path):
    """A sample file with scattering and absorption at 450 and 550 nm, and directions at these and 400 nm."""
    text = resources.files("jaxink.data").joinpath("simulated_plate_and_ink.toml").read_text()
    wave = "wavelength_nm = 550"
    assert wave in text
    text = text.replace(wave, "wavelength_nm = [450, 550]")
    for key in ("scattering_per_mm", "absorption_per_mm"):
        text = re.sub(rf"({key} = \{{)", r"\1 per_wavelength = true,", text)
    sample, table = tmp_path / "spectral.toml", tmp_path / "angles.csv"
    sample.write_text(text)
    rows = [f"30,{theta},180,{wave},R" for wave in (400, 450, 550) for theta in (0, 20)]
    table.write_text("\n".join(["theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side", *rows]) + "\n")
    return sample, table


def test_rows_at_unknown_wavelengths_are_blank_and_said(monkeypatch, by_wavelength, tmp_path, told):
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    sample, table = by_wavelength
    words = ["predict", str(sample), str(table), "--out"]
    done = CliRunner().invoke(app, [*words, str(tmp_path / "out.csv")])
    assert done.exit_code == 0, done.stderr
    told(done.stderr, "400", "2 rows")
    rows = list(csv.DictReader((tmp_path / "out.csv").read_text().splitlines()))
    assert [row["bsdf_per_sr"] == "" for row in rows] == [True] * 2 + [False] * 4
    assert [bool(row["not_predicted"]) for row in rows] == [True] * 2 + [False] * 4
    # A table of directions has nothing measured.
    assert "measured_per_sr" not in rows[0]
    # Python alike, and each value is that of the direction by itself.
    values = jaxink.predict(sample, table)
    assert np.isnan(values[:2]).all()
    alone = jaxink.predict_at(sample, 30.0, 20.0, wavelength_nm=450.0)
    assert float(rows[3]["bsdf_per_sr"]) == pytest.approx(values[3]) == pytest.approx(alone.bsdf_per_sr[0])
    done = CliRunner().invoke(app, [*words, str(tmp_path / "out.nc")])
    assert done.exit_code == 5
    told(done.stderr, "400", ".csv")
    assert not (tmp_path / "out.nc").exists()


def test_directions_without_values_are_for_predictions_only(by_wavelength):
    _, table = by_wavelength
    assert len(jaxink.read(table, needs_values=False)) == 6
    with pytest.raises(jaxink.InputRefusedError, match="bsdf_per_sr"):
        jaxink.read(table)


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
