"""Totals over black and white and collimated light, alone and beside a BSDF."""

import inspect

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.errors import InputRefusedError
from jaxink.fitting import ReadingsResult
from jaxink.fitting.inputs import read_inputs
from jaxink.measurement import Readings
from jaxink.model.forward import evaluate
from jaxink.model.readings import ReadingsModel
from tests.projects.conftest import PROJECT, SAMPLE, TRUTH, project_of
from tests.samples import edited

THREE = """
schema_version = 1
title = "Simulated: over black, over white, collimated"
sample = "ink.toml"
[[measurements]]
name = "over_black"
readings = "over_black.csv"
changes.backing.reflectance = 0.04
[[measurements]]
name = "over_white"
readings = "over_white.csv"
changes.backing.reflectance = 0.85
[[measurements]]
name = "collimated"
readings = "collimated.csv"
"""
FIRST = 'readings = "over_black.csv"\n'


def written(folder, name, quantity, sample, rng) -> None:
    """A file of one reading of the true ink, with noise of 0.3 %."""
    at = Readings(
        np.array([quantity]),
        np.array([0.0 if quantity == "T_collimated" else 8.0]),
        np.array([np.nan]),
        np.array([np.nan]),
        np.array([550.0]),
        np.array([0.5]),
    )
    exact = float(evaluate(ReadingsModel(sample, at))[0])
    value = exact * (1 + 0.003 * rng.standard_normal())
    text = f"quantity,value,sigma,wavelength_nm\n{quantity},{value!r},{0.003 * exact!r},550\n"
    (folder / f"{name}.csv").write_text(text)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, project_folder):
    folder, rng = tmp_path_factory.mktemp("readings"), np.random.default_rng(7)
    thin = edited(SAMPLE, ("thickness_um = 30", "thickness_um = 20"))
    (folder / "ink.toml").write_text(thin)
    true = jaxink.parse_sample(thin).replace(TRUTH)
    for name, reflectance in (("over_black", 0.04), ("over_white", 0.85)):
        card = jaxink.parse_sample(f"{thin}[backing]\nreflectance = {reflectance}\n").replace(TRUTH)
        written(folder, name, "R_total", card, rng)
    written(folder, "collimated", "T_collimated", true, rng)
    return folder


@pytest.fixture(scope="module")
def fitted(folder):
    return jaxink.fit(project_of(THREE, folder))


def test_three_readings_determine_three_numbers(fitted):
    assert fitted.converged
    for name, true in TRUTH.items():
        found = fitted[name]
        assert abs(found.value - true) < 3 * found.standard_error, name
        assert found.standard_error < 0.5 * abs(true)


def test_readings_are_saved_and_loaded(fitted, tmp_path):
    fitted.save(tmp_path)
    loaded = jaxink.load_joint_result(tmp_path)
    assert loaded.to_dict() == fitted.to_dict()
    one = loaded.of("over_white")
    assert isinstance(one, ReadingsResult)
    np.testing.assert_allclose(one.predict(), one.predicted, rtol=1e-9)
    assert "R_total" in one.card().text()


def test_a_card_that_no_measurement_shares_is_its_own(folder):
    project = project_of(THREE, folder)
    assert project["over_white"].sample.parameters["backing.reflectance"].value == 0.85
    assert {"over_black/backing.reflectance", "over_white/backing.reflectance"} <= project.parameters.keys()
    assert project["collimated"].sample.backing is None


def test_a_reading_joins_a_bsdf(project_folder, tmp_path, project):
    for name in ("ink.toml", "thin.csv", "thick.csv", "thick_lit_ink.csv"):
        (tmp_path / name).write_bytes((project_folder / name).read_bytes())
    written(
        tmp_path,
        "total",
        "T_collimated",
        jaxink.parse_sample(SAMPLE).replace(TRUTH),
        np.random.default_rng(3),
    )
    text = PROJECT + '[[measurements]]\nname = "total"\nreadings = "total.csv"\n'
    result = jaxink.fit(project_of(text, tmp_path))
    assert not result.agreement.disagrees
    assert [part.points for part in result.agreement.parts] == [132, 132, 132, 1]
    for name, true in TRUTH.items():
        assert abs(result[name].value - true) < 3 * result[name].standard_error


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ((FIRST, FIRST + 'data = "thin.csv"\n'), ("data", "readings")),
        ((FIRST, "readings = 3\n"), ("readings",)),
        ((FIRST, 'readings = "absent.csv"\n'), ("absent.csv",)),
        ((FIRST, FIRST + 'reading.side = "R"\n'), ("side",)),
        ((FIRST, FIRST + "changes.wavelength_nm = 600\n"), ("over_black", "600")),
        ((FIRST, FIRST + "changes.effects.stray_light.level_per_sr = 0.1\n"), ("over_black", "stray_light")),
    ],
)
def test_bad_readings_are_refused(changes, named, folder, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.fit(project_of(edited(THREE, changes), folder))
    told(str(refused.value), *named)


def test_readings_are_predicted_without_a_fit_and_without_a_free_parameter(folder, fitted, tmp_path):
    sample = fitted.of("over_white").sample
    data = fitted.of("over_white").data
    expected = evaluate(ReadingsModel(sample, data))
    np.testing.assert_allclose(jaxink.predict(sample, data), expected, rtol=1e-12)
    fixed = SAMPLE.replace("free = true, ", "")
    (tmp_path / "ink.toml").write_text(fixed)
    (tmp_path / "collimated.csv").write_text((folder / "collimated.csv").read_text())
    project = tmp_path / "project.toml"
    project.write_text(THREE[: THREE.index("[[")] + THREE[THREE.rindex("[[") :])
    done = CliRunner().invoke(app, ["predict", str(project), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.stderr
    at = jaxink.read_readings(folder / "collimated.csv")
    (value,) = jaxink.read_readings(tmp_path / "out" / "collimated.csv").value
    assert value == pytest.approx(jaxink.predict(jaxink.parse_sample(fixed), at)[0], rel=1e-9)


def test_readings_of_one_wavelength_have_no_colour(fitted, told):
    with pytest.raises(InputRefusedError) as refused:
        fitted.of("over_white").colour()
    told(str(refused.value), "550 nm", "wavelengths")


def test_readings_are_fitted_in_a_project(fitted, told):
    one = fitted.of("over_white")
    with pytest.raises(InputRefusedError) as refused:
        # Without the check of types, which users do not have.
        inspect.unwrap(read_inputs)(one.data, one.sample)
    told(str(refused.value), "readings", "project")


def test_readings_of_a_joint_fit_are_predicted_and_their_ink_is_exported(fitted, tmp_path):
    fitted.save(tmp_path / "fit")
    run = CliRunner().invoke
    done = run(app, ["predict", str(tmp_path / "fit"), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.stderr
    for name, one in fitted.measurements.items():
        written = jaxink.read_readings(tmp_path / "out" / f"{name}.csv")
        np.testing.assert_allclose(written.value, one.predicted, rtol=1e-9)
    export = ["export", str(tmp_path / "fit"), "--measurement", "over_black", "--format", "netcdf"]
    done = run(app, [*export, "--n-theta", "31", "--n-phi", "19", "--out", str(tmp_path / "ink")])
    assert done.exit_code == 0, done.stderr
    written = jaxink.read_ink_table(tmp_path / "ink" / "ink.nc")
    options = jaxink.TableOptions(n_theta=31, n_phi=19)
    expected = jaxink.ink_table(fitted.of("over_black").sample, options=options)
    np.testing.assert_allclose(written.bsdf_per_sr, expected.bsdf_per_sr, rtol=1e-6)
