"""A joint result is saved, loaded, shown and used like that of one measurement."""

import json

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from tests.projects.conftest import PROJECT, SAMPLE, TRUTH, project_of


@pytest.fixture(scope="module")
def saved(fitted, tmp_path_factory):
    folder = tmp_path_factory.mktemp("joint")
    fitted.save(folder)
    return folder


def test_what_is_loaded_is_what_was_saved(fitted, saved):
    loaded = jaxink.load_joint_result(saved)
    assert loaded.to_dict() == fitted.to_dict()
    assert loaded.agreement == fitted.agreement
    for name, one in fitted.measurements.items():
        np.testing.assert_array_equal(loaded.of(name).predicted_per_sr, one.predicted_per_sr)


def test_each_measurement_has_a_result_of_its_own(fitted, saved):
    one = jaxink.load_result(saved / "measurements" / "thick_lit_ink")
    assert [layer.name for layer in one.sample.layers] == ["ink", "plate"]
    assert one.values["ink.thickness_um"] == 75
    for name in TRUTH:
        assert one[name].value == fitted[name].value
        assert one[name].standard_error == pytest.approx(fitted[name].standard_error, rel=1e-9)
    np.testing.assert_allclose(one.predict()[one.data.used], one.predicted_per_sr, rtol=1e-9)


def test_chi_square_is_the_sum_over_the_measurements(fitted):
    parts = [one.merit.chi_square for one in fitted.measurements.values()]
    assert fitted.chi_square == pytest.approx(sum(parts))
    assert fitted.chi_square == pytest.approx(fitted.loss)
    assert fitted.degrees_of_freedom == fitted.points - 3


def test_the_summary_names_every_measurement_and_parameter(fitted):
    text = fitted.card().text()
    for name in (*fitted.measurements, *TRUTH):
        assert name in text


def test_a_joint_fit_is_no_result_of_one_measurement(saved, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.load_result(saved)
    told(str(refused.value), "measurements", "load_joint_result")


def test_files_of_two_fits_are_not_mixed(saved, tmp_path, fitted, told):
    fitted.save(tmp_path)
    file = tmp_path / "joint.json"
    changed = json.loads(file.read_text())
    changed["loss"] += 1
    file.write_text(json.dumps(changed))
    with pytest.raises(InputRefusedError) as refused:
        jaxink.load_joint_result(tmp_path)
    told(str(refused.value), "joint.json")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("outcome", "fine"),
        ("schema_version", 99),
        ("correlations", [[1.0]]),
        ("measurements", 3),
        ("seed", None),
    ],
)
def test_a_damaged_file_is_refused_by_its_key(fitted, tmp_path, key, value, told):
    fitted.save(tmp_path)
    file = tmp_path / "joint.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {key: value}))
    with pytest.raises(InputRefusedError) as refused:
        jaxink.load_joint_result(tmp_path)
    told(str(refused.value), "joint.json", key)


def test_a_folder_without_a_joint_fit_is_refused(tmp_path, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.load_joint_result(tmp_path)
    told(str(refused.value), "jaxink fit")


def test_a_fit_with_estimated_noise_is_loaded_too(project_folder, tmp_path):
    """Repeated readings without a sigma: the noise is an estimate, with its degrees of freedom."""
    for name in ("thin", "thick"):
        lines = (project_folder / f"{name}.csv").read_text().splitlines()
        head, *rows = [line.rpartition(",")[0] for line in lines]
        rng, again = np.random.default_rng(4), []
        for row in rows:
            directions, _, value = row.rpartition(",")
            again.append(f"{directions},{float(value) * (1 + 0.007 * rng.standard_normal())!r}")
        (tmp_path / f"{name}.csv").write_text("\n".join([head, *rows, *again]) + "\n")
    sample = SAMPLE[: SAMPLE.index("[noise]")]
    (tmp_path / "ink.toml").write_text(sample)
    text = PROJECT[: PROJECT.index('[[measurements]]\nname = "thick_lit_ink"')]
    project = project_of(text, tmp_path)
    result = jaxink.fit(project, options=jaxink.FitOptions(profile="none"))
    assert result.noise_freedom is not None
    for one in result.measurements.values():
        for name, p in one.parameters.items():
            assert p.standard_error == result[name].standard_error
    result.save(tmp_path / "out")
    assert jaxink.load_joint_result(tmp_path / "out").to_dict() == result.to_dict()
