"""The diagnosis of several measurements names an effect, and where it is."""

import dataclasses
import html

import pytest

import jaxink
from jaxink.diagnosis import DiagnosisOptions, JointDiagnosis
from jaxink.diagnosis.joint.search import owners
from jaxink.effects import CATALOGUE, Case, Scene
from jaxink.files.encoding import json_text
from jaxink.numerics.digits import rounded
from jaxink.report import write_joint_diagnosis_page
from tests.projects.conftest import as_simulated

# Effects that fit what the others leave, and need no program of their own, so that all is fast.
_OF = {effect.name: effect for effect in CATALOGUE}
OPTIONS = DiagnosisOptions(catalogue=tuple(_OF[name] for name in ("gain", "stray_light", "plate_absorption")))


@pytest.fixture(scope="module")
def two(project):
    """The thick print from both sides, without the thin one."""
    return dataclasses.replace(project, measurements=project.measurements[1:])


def diagnosed(project) -> JointDiagnosis:
    with pytest.MonkeyPatch.context() as patch:
        # What a fit itself tries of an outlier is for tests/projects/test_joint_fit.py; each takes seconds.
        patch.setattr("jaxink.fitting.joint_fit.own_causes", lambda *_: ())
        return jaxink.diagnose(project, options=OPTIONS)


@pytest.fixture(scope="module")
def with_gain(project):
    return diagnosed(as_simulated(project, thick=1.03))


def test_a_gain_of_one_measurement_is_named_as_its_own(with_gain):
    (step,) = with_gain.steps
    assert (step.effect, step.measurements) == ("gain", ("thick",))
    name = step.parameters[0]
    assert name.startswith("thick/")
    found = with_gain.corrected[name]
    assert abs(found.value - 0.03) < 3 * found.standard_error
    assert with_gain.declared.agreement.disagrees
    assert not with_gain.structure_remains
    assert with_gain.sentence == "Explained by gain in 'thick' alone."
    assert with_gain.corrected.reduced_chi_square < 1.2 < with_gain.declared.reduced_chi_square


def test_an_effect_of_the_sample_is_one_in_all_measurements(project):
    def absorbing(one):
        sample = one.sample.replace({"plate.absorption_per_mm": 0.05})
        return dataclasses.replace(one, sample=sample)

    truth = dataclasses.replace(project, measurements=tuple(absorbing(one) for one in project.measurements))
    data = {one.name: one.data for one in as_simulated(truth).measurements}
    seen = (dataclasses.replace(one, data=data[one.name]) for one in project.measurements)
    found = diagnosed(dataclasses.replace(project, measurements=tuple(seen)))
    (step,) = found.steps
    assert (step.effect, step.where) == ("plate_absorption", "in all measurements")
    value = found.corrected["plate.absorption_per_mm"]
    assert abs(value.value - 0.05) < 3 * value.standard_error


def test_nothing_is_called_for_where_the_model_fits(two):
    found = diagnosed(two)
    assert found.steps == ()
    assert found.corrected is found.declared
    assert "fits all measurements as it is" in found.sentence


def test_it_is_saved_with_both_fits(with_gain, tmp_path):
    report = with_gain.save(tmp_path / "out")
    assert report.read_text() == json_text(with_gain.to_dict()) + "\n"
    loaded = jaxink.load_joint_result(tmp_path / "out" / "corrected")
    assert loaded.to_dict() == with_gain.corrected.to_dict()


def test_its_page_tells_effects_and_leads_to_both_fits(with_gain, tmp_path):
    with_gain.save(tmp_path)
    pages = write_joint_diagnosis_page(with_gain, tmp_path, formats=())
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert tmp_path / "report.html" in pages
    assert html.escape(with_gain.sentence) in page
    assert html.escape(with_gain.steps[0].sentence) in page
    for name, result in (("declared", with_gain.declared), ("corrected", with_gain.corrected)):
        assert f'href="{name}/report.html"' in page
        own = (tmp_path / name / "report.html").read_text(encoding="utf-8")
        assert html.escape(result.verdict.sentence) in own
        # Chi-square of both models stands side by side.
        for one in result.measurements.values():
            assert rounded(one.merit.chi_square, 5) in page


def test_owners_of_effects(project):
    names = [one.name for one in project.measurements]
    gain, absorption = _OF["gain"](), _OF["plate_absorption"]
    assert [owner for owner, _ in owners(project, names, gain)] == ["", *names]
    arm = ("thin", "thick")
    named = tuple(
        dataclasses.replace(one, instrument="arm" if one.name in arm else "other")
        for one in project.measurements
    )
    of_instruments = dataclasses.replace(project, measurements=named)
    assert dict(owners(of_instruments, names, gain))["arm"] == arm
    # An instrument with one measurement is that measurement, and no effect is of two instruments.
    assert [owner for owner, _ in owners(of_instruments, names, gain)] == ["arm", *names]
    sample, data = project.measurements[0].sample, project.measurements[0].data
    scene = Scene.of_used(data)
    case = Case(sample, scene, 0.005, 1e-3)
    (plate,) = absorption.forms(case)
    assert [owner for owner, _ in owners(of_instruments, names, plate)] == ["", *names]


def test_a_project_has_its_own_samples(project, told):
    with pytest.raises(jaxink.InputRefusedError) as refused:
        jaxink.diagnose(project, project.measurements[0].sample)
    told(str(refused.value), "leave out")
