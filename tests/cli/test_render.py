"""``jaxink render``."""

import json

import pytest
from typer.testing import CliRunner

from jaxink.cli.app import app
from tests.render.inks import PRINTED

FEW = "--batches", "2", "--paths", "1", "--no-volume"


@pytest.fixture
def run(monkeypatch, tmp_path):
    monkeypatch.setattr("jaxink.cli.session.prepare_jax", lambda: None)
    (tmp_path / "ink.toml").write_text(PRINTED, encoding="utf-8")

    def of(*words, source="ink.toml"):
        given = ["render", str(tmp_path / source), "--out", str(tmp_path / "out"), *map(str, words)]
        return CliRunner().invoke(app, given)

    return of


def test_numbers_and_picture_are_written(run, tmp_path):
    done = run(*FEW)
    assert done.exit_code == 0, done.output
    assert "flux out / flux in" in done.stdout
    numbers = json.loads((tmp_path / "out" / "render.json").read_text())
    assert numbers["guide"]["dots"] >= 200
    flux = numbers["lights"]["sheet"]["flux_out_over_flux_in"]
    assert 0.1 < flux["value"] < 0.6
    assert (tmp_path / "out" / "lightguide.png").exists()
    # The same command again takes the batches that are there.
    before = {p.name: p.stat().st_mtime_ns for p in (tmp_path / "out" / "batches").iterdir()}
    again = run(*FEW, "--json")
    assert json.loads(again.stdout) == numbers
    assert before == {p.name: p.stat().st_mtime_ns for p in (tmp_path / "out" / "batches").iterdir()}


def test_a_sphere_in_a_booth(run, tmp_path):
    pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'jaxink[render]'")
    done = run("--scene", "sphere", "--batches", "2", "--paths", "160", "--no-volume")
    assert done.exit_code == 0, done.output
    assert "sheet against solid" in done.stdout
    numbers = json.loads((tmp_path / "out" / "render.json").read_text())
    assert set(numbers["lights"]) == {"sheet", "solid"}
    for light in numbers["lights"].values():
        assert 0.2 < light["luminance_over_white_body"]["value"] < 0.9
    assert (tmp_path / "out" / "sphere.png").exists()


def test_a_booth_has_all_bodies(run, tmp_path):
    pytest.importorskip("mitsuba", reason="needs mitsuba: pip install 'jaxink[render]'")
    done = run("--scene", "booth", "--batches", "2", "--paths", "16", "--no-volume")
    assert done.exit_code == 0, done.output
    for body in ("sphere", "plate", "torus"):
        assert (tmp_path / "out" / body / f"{body}.png").exists()
        assert "sheet" in json.loads((tmp_path / "out" / body / "render.json").read_text())["lights"]


def test_wrong_options(run, told, tmp_path):
    (tmp_path / "clear.toml").write_text(PRINTED[: PRINTED.rindex("[[layers]]")], encoding="utf-8")
    for words, source, named in (
        (("--scene", "moon"), "ink.toml", "--scene"),
        (("--scene", "sphere", "--plate-index", "1.6"), "ink.toml", "--plate-index"),
        (("--scene", "sphere", "--uncorrected", "other"), "ink.toml", "--uncorrected"),
        (("--scene", "booth", "--uncorrected", "other"), "ink.toml", "--uncorrected"),
        (("--scene", "booth", "--json"), "ink.toml", "--json"),
        (("--batches", "1"), "ink.toml", "batches"),
        (("--layer", "plate"), "ink.toml", "plate"),
        (FEW, "clear.toml", "clear.toml"),
        (FEW, "none", "none"),
    ):
        done = run(*words, source=source)
        assert done.exit_code == 5, done.output
        told(done.stderr, named)
