"""``jaxink convert``: one tidy CSV file that reads back to the same measurement."""

import csv

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.measurement import write_csv
from tests.formats import files


@pytest.fixture
def run():
    return lambda *arguments: CliRunner().invoke(app, ["convert", *map(str, arguments)])


def test_the_values_stay_the_same(run, tmp_path, told):
    source, out = tmp_path / "both.bsdf", tmp_path / "tidy.csv"
    source.write_text(files.lighttools(faces=("Front", "Back")))
    done = run(source, "--face", "back", "--out", out)
    assert done.exit_code == 0
    told(done.stdout, "tidy.csv", "LightTools", "back")
    direct, again = jaxink.read(source, face="back"), jaxink.read(out)
    for name in ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "is_transmission", "bsdf_per_sr"):
        np.testing.assert_array_equal(getattr(again, name), getattr(direct, name))
    assert set(again.extra["lit_face"].tolist()) == {"back"}
    head = out.read_text().split("\n")
    assert head[0].startswith("# Converted by jaxink")
    assert "both.bsdf" in head[0]


def test_what_is_missing_is_asked_for(run, tmp_path, told):
    source, out = tmp_path / "R.bsdf", tmp_path / "tidy.csv"
    source.write_text(files.zemax())
    done = run(source, "--out", out)
    assert (done.exit_code, done.stdout) == (5, "")
    assert not out.exists()
    told(done.stderr, "--wavelength-nm")
    assert run(source, "--wavelength-nm", 550, "--out", out, "--quiet").stdout == ""
    assert len(jaxink.read(out)) > 40


def test_several_files_with_one_side_each(run, tmp_path):
    for name in "RT":
        (tmp_path / f"{name}.astm").write_text(files.astm(["550nm"], is_radian=False))
    names = [tmp_path / f"{name}.astm" for name in "RT"]
    done = run(*names, "--side", "R,T", "--out", tmp_path / "tidy.csv")
    assert done.exit_code == 0
    data = jaxink.read(tmp_path / "tidy.csv")
    assert np.bincount(data.is_transmission).tolist() == [len(data) // 2] * 2


def test_a_european_table_with_signed_angles_times_the_cosine(run, tmp_path):
    rows = ["theta_i_deg;theta_o_deg;wavelength_nm;bsdf_per_sr"]
    for t in (-40, 0, 40, 60):
        rows.append(f"20,0;{t};550;{0.2 * np.cos(np.deg2rad(t)):.9f}".replace(".", ","))
    (tmp_path / "a.csv").write_text("\n".join(rows))
    done = run(
        tmp_path / "a.csv",
        "--signed-angles",
        "--side",
        "R",
        "--cosine-weighted",
        "--out",
        tmp_path / "tidy.csv",
    )
    assert done.exit_code == 0
    data = jaxink.read(tmp_path / "tidy.csv")
    np.testing.assert_allclose(data.bsdf_per_sr, 0.2, rtol=1e-8)
    assert data.theta_o_deg.tolist() == [40, 0, 40, 60]
    assert data.phi_deg.tolist() == [0, 180, 180, 180]


def test_a_sheet_of_a_workbook(run, tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for name, value in (("R", 0.2), ("T", 0.1)):
        sheet = book.create_sheet(name)
        sheet.append(["theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "bsdf_per_sr"])
        for t in (0, 30, 60):
            sheet.append([20, t, 180, 550, value])
    book.save(tmp_path / "both.xlsx")
    done = run(tmp_path / "both.xlsx", "--sheet", "T", "--side", "T", "--out", tmp_path / "tidy.csv")
    assert done.exit_code == 0
    data = jaxink.read(tmp_path / "tidy.csv")
    assert (data.bsdf_per_sr.tolist(), set(data.side.tolist())) == ([0.1] * 3, {"T"})


@pytest.mark.parametrize("bad", [["--out", "tidy.txt"], ["--theta-i-deg", "a,b", "--out", "tidy.csv"]])
def test_options(bad, run, tmp_path, monkeypatch, told):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "R.bsdf").write_text(files.zemax())
    done = run("R.bsdf", *bad)
    assert done.exit_code == 5
    told(done.stderr, bad[1])


def test_a_file_is_not_replaced_by_its_own_result(run, tmp_path, told):
    path = written_table(tmp_path)
    before = path.read_text()
    done = run(path, "--side", "R", "--out", tmp_path / "." / "a.csv")
    assert done.exit_code == 5
    told(done.stderr, "a.csv")
    assert path.read_text() == before


def test_text_that_would_be_a_formula_is_not_one(tmp_path):
    data = jaxink.read(written_table(tmp_path), side="R")
    write_csv(data, tmp_path / "tidy.csv", ["=1+1, =2+2"])
    with (tmp_path / "tidy.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["# =1+1", "' =2+2"]
    assert rows[2][-1] == "'=1+1"


def written_table(folder):
    path = folder / "a.csv"
    path.write_text(
        "theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,bsdf_per_sr,remark\n20,30,180,550,0.2,=1+1\n"
    )
    return path
