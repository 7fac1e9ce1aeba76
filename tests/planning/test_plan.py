"""The plan knows what a further measurement determines, and says it before it is made."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.numerics.precision import computing
from jaxink.planning import next_project
from jaxink.planning import plan as plan_module
from jaxink.planning import rivals as rivals_module
from jaxink.planning.forecast import Planned
from jaxink.planning.known import KnownFit
from jaxink.planning.menu import menu
from jaxink.planning.valley import valley
from jaxink.projects import Measurement, Project, parse_project
from tests.projects.conftest import SAMPLE, TRUTH, measured
from tests.samples import edited

# Scattering and thickness act as their product, as do absorption and thickness.
UNKNOWN_THICKNESS = edited(
    SAMPLE, ("thickness_um = 30", "thickness_um = { free = true, min = 15, max = 60, value = 30 }")
)
THICK_UM = 60.0


@pytest.fixture(scope="module")
def result():
    sample = jaxink.parse_sample(UNKNOWN_THICKNESS)
    return jaxink.fit(measured(sample.replace(TRUTH), 5), sample, jaxink.FitOptions(profile="none"))


@pytest.fixture(scope="module")
def plan(result):
    return jaxink.plan_measurement(result)


def test_what_is_not_determined_is_said(plan):
    assert "ink.thickness_um" in plan.undetermined
    assert "ink.asymmetry_parameter" not in plan.undetermined
    assert "ink.thickness_um" in plan.card().text()


def test_a_print_of_known_thickness_comes_first(plan):
    assert plan.best.name.startswith("thickness_")
    now, then = plan.targets["ink.thickness_um"], plan.best.standard_errors["ink.thickness_um"]
    assert then < 0.2 * now


def test_no_measurement_makes_anything_worse(plan):
    for one in plan.forecasts:
        assert one.gain >= 1
        for name, error in one.standard_errors.items():
            assert error <= plan.targets[name] * (1 + 1e-9)


def test_more_of_the_same_print_does_not_determine_its_thickness(plan):
    (other,) = (one for one in plan.forecasts if one.name == "incidence_45")
    assert other.standard_errors["ink.thickness_um"] > 0.9 * plan.targets["ink.thickness_um"]


def test_simulated_fits_confirm_the_forecast(plan):
    check = next(check for check in plan.checks if check.name == plan.best.name)
    for name, error in plan.best.standard_errors.items():
        assert check.standard_errors[name] == pytest.approx(error, rel=0.25), name


def test_the_forecast_holds_when_the_measurement_is_made(plan, result):
    candidate = plan.candidates[plan.best.name]
    sample = candidate.measurement.sample
    table = sample.parameters.replace("ink.thickness_um", value=sample.parameters["ink.thickness_um"].value)
    sample = dataclasses.replace(sample, parameters=table)
    free = {p: result.values[p] for p in TRUTH}
    present = Measurement("present", result.data, result.sample, {n: n for n in result.sample.parameters})
    points = candidate.measurement.data
    exact = jaxink.predict(sample.replace(free), points)
    sigma = plan.noise[0] * exact * np.sqrt(len(points) / plan.readings)
    noisy = exact + sigma * np.random.default_rng(1).standard_normal(len(exact))
    made = dataclasses.replace(
        candidate.measurement, data=points.replace(bsdf_per_sr=noisy, sigma_per_sr=sigma), sample=sample
    )
    joint = jaxink.fit(Project((present, made)), options=jaxink.FitOptions(profile="none"))
    for name, error in plan.best.standard_errors.items():
        assert joint[name].standard_error == pytest.approx(error, rel=0.25), name


def test_where_the_thickness_is_not_determined_the_forecast_covers_what_it_may_be(plan, result):
    known = KnownFit.of(result)
    with computing():
        points = valley(known, plan.undetermined)
    thickness, scattering, asymmetry = (
        np.array([known.objective.numbers(unit)[f"ink.{name}"] for unit in points])
        for name in ("thickness_um", "scattering_per_mm", "asymmetry_parameter")
    )
    assert thickness.max() > 1.5 * thickness.min()
    np.testing.assert_allclose(thickness * scattering, (thickness * scattering)[0], rtol=0.01)
    np.testing.assert_allclose(asymmetry, asymmetry[0], atol=0.005)
    best = plan.best
    for name, (least, largest) in best.ranges.items():
        assert least <= best.standard_errors[name] <= largest, name
    least, largest = best.ranges["ink.thickness_um"]
    assert largest > 1.2 * least
    assert f"({least:.2g} to {largest:.2g})" in plan.card().text()


def test_targets_choose_what_counts(result):
    plan = jaxink.plan_measurement(result, targets=["ink.asymmetry_parameter"])
    assert list(plan.targets) == ["ink.asymmetry_parameter"]
    assert plan.best.standard_errors.keys() == {"ink.asymmetry_parameter"}
    # It is determined by what there is.
    assert all(not one.ranges for one in plan.forecasts)
    with_all = [one.name for one in plan.forecasts]
    assert len(with_all) >= 9


def test_the_menu_leaves_out_what_was_measured(result):
    names = {n: n for n in result.sample.parameters}
    present = Measurement("present", result.data, result.sample, names)
    items = {one.name for one in menu(present, Project((present,)))}
    # Measured at 0, 30 and 60 degrees.
    assert {"incidence_15", "incidence_45", "incidence_75", "other_side", "over_black"} <= items
    assert not {"incidence_0", "incidence_30", "incidence_60", "no_card"} & items


def test_the_next_project_can_be_read_once_it_is_filled_in(plan, result, tmp_path):
    for one in plan.forecasts:
        candidate = plan.candidates[one.name]
        texts = next_project(candidate, {"present": "present.csv"}, "sample.toml")
        folder = tmp_path / one.name
        folder.mkdir()
        for name, text in texts.items():
            filled = text.replace(",,,550", ",0.5,0.01,550") if "quantity" in text else text
            lines = filled.splitlines()
            if lines[0].endswith("sigma_per_sr"):
                filled = "\n".join([lines[0], *(f"{line[:-2]},0.1,0.001" for line in lines[1:])])
            (folder / name).write_text(filled)
        jaxink.measurement.write_csv(result.data, folder / "present.csv")
        (folder / "sample.toml").write_text(UNKNOWN_THICKNESS)
        if candidate.measurement.sample.wavelengths_nm != result.sample.wavelengths_nm:
            continue
        project = parse_project((folder / "next.toml").read_text(), folder=folder)
        assert [m.name for m in project.measurements] == ["present", one.name]
        given, planned = project[one.name].sample, candidate.measurement.sample
        assert [layer.name for layer in given.layers] == [layer.name for layer in planned.layers]
        assert (given.backing is None) == (planned.backing is None)


OVER_A_CARD = """
schema_version = 1
sample = "sample.toml"
[specimens.thick]
ink.thickness_um = { free = true, min = 40, max = 90, value = 60 }
[instruments.arm]
noise.relative = 0.02
[[measurements]]
name = "over_card"
data = "present.csv"
specimen = "thick"
instrument = "arm"
lit_side = "ink"
changes.backing.reflectance = 0.3
changes.plate.thickness_mm = 2
"""


@pytest.fixture
def over_a_card(tmp_path):
    """A project with a measurement whose specimen, instrument, side and card are its own."""
    sample = jaxink.parse_sample(UNKNOWN_THICKNESS)
    (tmp_path / "sample.toml").write_text(UNKNOWN_THICKNESS)
    jaxink.measurement.write_csv(measured(sample.replace(TRUTH), 5), tmp_path / "present.csv")
    return parse_project(OVER_A_CARD, folder=tmp_path)


def test_the_next_measurement_is_as_the_present_one_but_for_the_changes(over_a_card, tmp_path):
    project = over_a_card
    candidates = {one.name: one for one in menu(project["over_card"], project)}
    assert {"incidence_45", "other_side", "no_card", "thickness_30_um"} <= candidates.keys()
    for name in ("incidence_45", "other_side", "no_card", "thickness_30_um", "totals"):
        one = candidates[name]
        text = next_project(one, {}, "", OVER_A_CARD)["next.toml"].replace(f"{name}.csv", "present.csv")
        text = text.replace("readings = ", "data = ")
        given, planned = parse_project(text, folder=tmp_path)[one.name].sample, one.measurement.sample
        assert [layer.name for layer in given.layers] == [layer.name for layer in planned.layers], name
        assert given.backing == planned.backing, name
        assert given.parameters.keys() == planned.parameters.keys(), name
        for parameter in given.parameters.values():
            same = planned.parameters[parameter.name]
            assert (parameter.value, parameter.free) == (same.value, same.free), (name, parameter.name)
        if name != "totals":
            assert given.noise == planned.noise, name


def test_without_its_table_the_next_measurement_names_the_one_it_is_like(over_a_card, told):
    one = next(iter(menu(over_a_card["over_card"], over_a_card)))
    told(next_project(one, {}, "")["next.toml"], "As 'over_card' was", "lit_side", "changes")


def test_a_target_that_is_not_free_is_refused(result, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.plan_measurement(result, targets=["plate.thickness_mm"])
    told(str(refused.value), "plate.thickness_mm", "ink.scattering_per_mm")


def test_a_fit_without_a_minimum_is_refused(result, told):
    stopped = dataclasses.replace(result, outcome=jaxink.fitting.Outcome.STALLED)
    with pytest.raises(InputRefusedError) as refused:
        jaxink.plan_measurement(stopped)
    told(str(refused.value), "minimum")


def test_the_measurement_that_decides_whichever_minimum_is_right_comes_first(monkeypatch):
    present, likely, unlikely = np.array([0.5]), np.array([0.2]), np.array([0.8])
    # Least chi-square of a wrong minimum, by the measurement and by the minimum that is right.
    apart = {("a", 0.5): 30.0, ("a", 0.2): 2.0, ("b", 0.5): 12.0, ("b", 0.2): 15.0}
    programs = {name: object.__new__(Planned) for name in "ab"}
    names = {id(planned): name for name, planned in programs.items()}
    known = object.__new__(KnownFit)
    vars(known)["unit"] = present
    monkeypatch.setattr(rivals_module, "simulated", lambda known, planned, right: names[id(planned)])
    monkeypatch.setattr(rivals_module, "_starts", lambda known, objective: [])
    monkeypatch.setattr(
        rivals_module, "_minima", lambda name, right, starts: [(present, apart[name, float(right[0])])]
    )
    forecasts = [plan_module.Forecast(name, name, {}, 1.0, apart[name, 0.5]) for name in "ab"]
    rivals = [(likely, 1.0), (unlikely, 20.0)]
    first, second = plan_module._ranked(known, rivals, forecasts, programs, lambda *told: None)
    assert (first.name, first.chance) == ("b", 1.0)
    # The present minimum is right, or the likely one, whose chi-square is 1 higher.
    assert second.chance == pytest.approx(1 / (1 + np.exp(-0.5)))
