"""A joint fit has the minimum of the summed chi-square, and knows which measurement is wrong."""

import dataclasses

import jax
import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError
from jaxink.fitting import FitOptions, make_objective
from jaxink.fitting.joint_fit import decisions
from jaxink.fitting.joint_objective import CompiledJointObjective, JointObjective
from jaxink.fitting.minima import Minima, Minimum
from jaxink.measurement import noise_of
from jaxink.numerics.precision import computing
from jaxink.sample import Prior
from tests.projects.conftest import PROJECT, TRUTH, as_simulated, project_of
from tests.samples import edited

# It is 30 um thick.
_THIN = "changes.ink.thickness_um = 33"


@pytest.fixture(scope="module")
def objective(project):
    return JointObjective.of(project, [noise_of(one.data, one.sample.noise) for one in project.measurements])


def test_the_truth_is_found_within_three_standard_errors(fitted):
    assert fitted.converged
    assert 0.8 < fitted.reduced_chi_square < 1.2
    for name, true in TRUTH.items():
        found = fitted[name]
        assert abs(found.value - true) < 3 * found.standard_error, name


def test_standard_errors_are_smaller_than_those_of_each_measurement(project, fitted):
    for one in project.measurements:
        alone = jaxink.fit(one.data, one.sample)
        for name in TRUTH:
            assert fitted[name].standard_error < alone[name].standard_error


def test_the_residual_is_that_of_the_single_objectives(project, objective):
    unit = np.array([0.3, 0.2, 0.7])
    start = 0
    with computing():
        joint = CompiledJointObjective(objective).residual(unit)
        singles = [make_objective(one.data, one.sample) for one in project.measurements]
        residuals = [jax.jit(lambda u, s=single: s.residual(u))(unit)[0] for single in singles]
    for rows in residuals:
        np.testing.assert_allclose(joint.residual[start : start + len(rows)], rows, rtol=1e-10, atol=1e-12)
        start += len(rows)
    assert start == len(joint.residual)


def test_the_jacobian_is_the_derivative_of_the_residual(objective):
    programs, unit = CompiledJointObjective(objective), np.array([0.3, 0.2, 0.7])
    steps = 1e-5 * np.eye(3)
    with computing():
        jacobian = programs.linearised(unit).jacobian
        ends = [[programs.residual(unit + sign * step).residual for sign in (1, -1)] for step in steps]
    for i, (above, below) in enumerate(ends):
        difference = above - below
        np.testing.assert_allclose(jacobian[:, i], difference / 2e-5, rtol=2e-5, atol=1e-4)


def test_a_shared_prior_counts_once(project):
    prior = Prior(50.0, 5.0)
    known = dataclasses.replace(
        project,
        measurements=tuple(
            dataclasses.replace(
                one,
                sample=dataclasses.replace(
                    one.sample, parameters=one.sample.parameters.replace("ink.scattering_per_mm", prior=prior)
                ),
            )
            for one in project.measurements
        ),
    )
    noises = [noise_of(one.data, one.sample.noise) for one in known.measurements]
    made = JointObjective.of(known, noises)
    unit = np.array([0.3, 0.2, 0.7])
    with computing():
        point = CompiledJointObjective(made).linearised(unit)
    scattering = made.numbers(unit)["ink.scattering_per_mm"]
    assert made.n_rows == made.n_points + 1
    assert point.residual[-1] == pytest.approx((50.0 - scattering) / 5.0)
    slope = float(made.scale.slope(unit)[0])
    np.testing.assert_allclose(point.jacobian[-1], [-slope / 5.0, 0.0, 0.0])


def test_a_parameter_of_one_specimen_affects_its_measurements_only(project_folder):
    text = edited(
        (project_folder / "project.toml").read_text(),
        ("ink.thickness_um = 75", "ink.thickness_um = { free = true, min = 40, max = 120 }"),
    )
    project = project_of(text, project_folder)
    assert [p.name for p in project.free] == [*TRUTH, "thick/ink.thickness_um"]
    assert project.measured_in("thick/ink.thickness_um") == ("thick", "thick_lit_ink")
    result = jaxink.fit(project)
    found = result["thick/ink.thickness_um"]
    assert abs(found.value - 75) < 3 * found.standard_error
    assert result.of("thick").sample.parameters["ink.thickness_um"].value == found.value
    assert result.of("thin").sample.parameters["ink.thickness_um"].value == 30


def test_measurements_of_one_ink_agree(fitted):
    assert not fitted.agreement.disagrees
    assert fitted.agreement.degrees_of_freedom == 6
    assert fitted.agreement.outlier is None
    own = sum(part.chi_square_alone for part in fitted.agreement.parts)
    assert fitted.loss == pytest.approx(own + fitted.agreement.chi_square)


def test_leverages_add_up_to_the_number_of_parameters(fitted):
    assert sum(part.leverage for part in fitted.agreement.parts) == pytest.approx(3, rel=1e-6)


def test_what_is_held_out_deviates_as_the_fit_of_the_others_predicts(project, fitted, objective):
    """The same by a fit of the others: their parameters, covariance and prediction."""
    others = tuple(one for one in project.measurements if one.name != "thin")
    fit = jaxink.fit(dataclasses.replace(project, measurements=others))
    unit = objective.scale.to_unit(np.array([fit.values[name] for name in objective.free]))
    with computing():
        at = CompiledJointObjective(objective).linearised(unit)
    first = objective.parts[0].n_points
    slopes = at.jacobian[:first] / objective.scale.slope(unit)
    covariance = np.eye(first) + slopes @ fit.covariance.matrix @ slopes.T
    expected = at.residual[:first] @ np.linalg.solve(covariance, at.residual[:first])
    found = fitted.misfit_of("thin").chi_square_held_out
    assert found == pytest.approx(expected, rel=0.01)
    assert found > fitted.misfit_of("thin").chi_square


def test_nothing_is_held_out_of_a_parameter_of_its_own(project_folder):
    gain = "changes.effects.gain.relative = { free = true, value = 0, min = -0.2, max = 0.2 }"
    text = edited(PROJECT, ('data = "thin.csv"', f'data = "thin.csv"\n{gain}'))
    fitted = jaxink.fit(project_of(text, project_folder))
    assert fitted.misfit_of("thin").chi_square_held_out is None
    assert fitted.misfit_of("thick").chi_square_held_out is not None


@pytest.mark.parametrize("wrong", ["thin", "thick", "thick_lit_ink"])
def test_the_measurement_with_a_gain_error_is_named(project, wrong, monkeypatch):
    if wrong != "thin":
        # Each cause is a program of its own, compiled for seconds; all of them are tried once.
        monkeypatch.setattr("jaxink.fitting.joint_fit._EFFECTS", ("gain",))
    result = jaxink.fit(as_simulated(project, **{wrong: 1.03}))
    assert result.agreement.disagrees
    outlier = result.agreement.outlier
    assert outlier.name == wrong
    assert outlier.offset == pytest.approx(0.03, abs=0.01)
    assert wrong in result.agreement.sentence
    # A thickness of its own or stray light would not make it agree.
    gain, *others = outlier.causes
    assert gain.parameter == f"{wrong}/gain.relative"
    assert abs(gain.value - 0.03) < 3 * gain.standard_error
    assert all(cause.parameter.endswith("side_gain.relative") for cause in others)
    assert not [note for note in result.notes if "failed" in note]


def test_a_wrong_thickness_of_one_measurement_is_offered_as_its_cause(project_folder, monkeypatch):
    monkeypatch.setattr("jaxink.fitting.joint_fit._EFFECTS", ("gain",))
    text = edited(
        (project_folder / "project.toml").read_text(), ('data = "thin.csv"', 'data = "thin.csv"\n' + _THIN)
    )
    result = jaxink.fit(project_of(text, project_folder))
    outlier = result.agreement.outlier
    assert outlier.name == "thin"
    assert outlier.causes[0].parameter == "thin/ink.thickness_um"
    assert abs(outlier.causes[0].value - 30) < 3 * outlier.causes[0].standard_error


def test_two_measurements_that_disagree_blame_neither(project):
    pair = dataclasses.replace(project, measurements=project.measurements[:2])
    result = jaxink.fit(as_simulated(pair, thin=1.05))
    assert result.agreement.disagrees
    assert result.agreement.outlier is None


def test_a_gain_of_the_instrument_is_shared_by_its_measurements(project_folder, project):
    text = edited(
        (project_folder / "project.toml").read_text(),
        (
            "[specimens.thick]",
            "[instruments.arm]\neffects.gain.relative = { free = true, min = -0.2, max = 0.2, value = 0 }\n"
            "[specimens.thick]",
            'data = "thick.csv"',
            'data = "thick.csv"\ninstrument = "arm"',
            'data = "thick_lit_ink.csv"',
            'data = "thick_lit_ink.csv"\ninstrument = "arm"',
        ),
    )
    declared = project_of(text, project_folder)
    assert declared.measured_in("arm/gain.relative") == ("thick", "thick_lit_ink")
    wrong = as_simulated(project, thick=1.03, thick_lit_ink=1.03)
    measurements = [
        dataclasses.replace(one, data=simulated.data)
        for one, simulated in zip(declared.measurements, wrong.measurements, strict=True)
    ]
    result = jaxink.fit(dataclasses.replace(declared, measurements=tuple(measurements)))
    gain = result["arm/gain.relative"]
    assert abs(gain.value - 0.03) < 3 * gain.standard_error
    assert gain.standard_error < 0.005
    assert not result.agreement.disagrees


def test_the_simplex_ends_in_the_same_minimum(project, fitted):
    simplex = jaxink.fit(project, options=FitOptions(method="simplex"))
    assert simplex.loss == pytest.approx(fitted.loss, abs=0.05)


def test_other_objectives_average_over_all_points(project):
    single = dataclasses.replace(project, measurements=project.measurements[:1])
    one = project.measurements[0]
    alone = jaxink.fit(one.data, one.sample, FitOptions(objective="relative"))
    joint = jaxink.fit(single, options=FitOptions(objective="relative"))
    assert joint.loss == pytest.approx(alone.searches[0].loss, rel=1e-6)
    both = jaxink.fit(project, options=FitOptions(objective="relative"))
    misfits = [r.merit.rmsd_relative**2 * r.merit.points for r in both.measurements.values()]
    assert both.loss == pytest.approx(sum(misfits) / both.points, rel=1e-6)


def test_a_method_that_compiles_one_program_is_refused(project, told):
    with pytest.raises(InputRefusedError) as refused:
        jaxink.fit(project, options=FitOptions(method="optimistix_dogleg"))
    told(str(refused.value), "optimistix_dogleg", "gradient")


def test_the_measurement_that_decides_between_minima_is_named(project, fitted):
    thin, thick, *_ = project.measurements
    # The thick print is measured so badly that it excludes nothing.
    vague = dataclasses.replace(thick, data=thick.data.replace(sigma_per_sr=100 * thick.data.sigma_per_sr))
    pair = dataclasses.replace(project, measurements=(thin, vague))
    noises = [noise_of(one.data, one.sample.noise) for one in pair.measurements]
    best = {name: fitted[name].value for name in TRUTH}
    other = best | {"ink.scattering_per_mm": 1.05 * best["ink.scattering_per_mm"]}
    entries = [
        Minimum(values, loss=300.0 + rise, rise=rise, weight=weight, starts=1, is_searched=True)
        for values, rise, weight in ((best, 0.0, 1.0), (other, 100.0, 0.0))
    ]
    minima = Minima(starts=2, unfinished=0, noise_scale=1.0, left_out=0, found=tuple(entries))
    with computing():
        (sentence,) = decisions(JointObjective.of(pair, noises), ["thin", "thick"], minima)
    assert "'thin' decides against the minimum" in sentence
    both = dataclasses.replace(project, measurements=(thin, thick))
    noises = [noise_of(one.data, one.sample.noise) for one in both.measurements]
    with computing():
        assert not list(decisions(JointObjective.of(both, noises), ["thin", "thick"], minima))
