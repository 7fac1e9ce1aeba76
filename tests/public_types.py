"""What a user's type checker sees of the library; mypy reads this file, nothing runs it."""

from collections.abc import Iterator
from pathlib import Path
from typing import assert_type

import numpy as np
from jax import Array

import jaxink
from jaxink import export, plots
from jaxink.diagnosis import SavedDiagnosis
from jaxink.effects import AugmentedModel, Effect
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power
from jaxink.solver.plan import ChannelPlan


def measured() -> jaxink.GonioData:
    data = jaxink.read("measurement.csv")
    assert_type(data, jaxink.GonioData)
    assert_type(jaxink.read(["R.csv", "T.xlsx"], side=["R", "T"]), jaxink.GonioData)
    assert_type(len(data), int)
    assert_type(len(data.scans), int)
    assert_type(data.scans[0].wavelength_nm, float)
    assert_type(data.select(wavelength_nm=550.0), jaxink.GonioData)
    assert_type(data.with_masks(jaxink.MaskLimits()), jaxink.GonioData)
    assert_type(data.equals(data), bool)
    assert_type(jaxink.read_readings("totals.csv", wavelength_nm=550.0), jaxink.Readings)
    data.mask.sum(), data.used_directions[0].mean(), data.bsdf_per_sr.max(), data.used.sum()
    return data


def described() -> jaxink.Sample:
    sample = jaxink.load_sample("sample.toml")
    assert_type(sample, jaxink.Sample)
    assert_type(jaxink.load_sample(Path("sample.toml")), jaxink.Sample)
    assert_type(jaxink.parse_sample("schema_version = 1"), jaxink.Sample)
    assert_type(sample.parameters["ink.scattering_per_mm"], jaxink.Parameter)
    assert_type(sample.parameters.free, tuple[jaxink.Parameter, ...])
    assert_type(sample.wavelengths_nm, tuple[float, ...])
    return sample


def fitted(data: jaxink.GonioData, sample: jaxink.Sample) -> jaxink.FitResult:
    result = jaxink.fit(data, sample, jaxink.FitOptions(method="gradient", starts=3))
    assert_type(result, jaxink.FitResult)
    assert_type(jaxink.fit(["R.csv", "T.csv"], "sample.toml"), jaxink.FitResult)
    assert_type(jaxink.load_result("result"), jaxink.FitResult)
    assert_type(result.data, jaxink.GonioData)
    assert_type(result.sample, jaxink.Sample)
    assert_type(result.converged, bool)
    assert_type(result.values, dict[str, float])
    assert_type(result.merit.chi_square, float | None)
    assert_type(result.merit.points, int)
    assert_type(result.config, jaxink.SolverConfig)
    assert_type(result.parameters["ink.scattering_per_mm"].value, float)
    assert_type(result["ink.scattering_per_mm"].standard_error, float | None)
    assert_type(result.covariance.names, tuple[str, ...])
    assert_type(result.log_density.free, tuple[str, ...])
    assert_type(result.verdict.sentence, str)
    assert_type(result.notes, tuple[str, ...])
    assert_type(result.summary(), str)
    return result


def diagnosed(sample: jaxink.Sample) -> jaxink.Diagnosis:
    found = jaxink.diagnose("measurement.csv", sample, jaxink.DiagnosisOptions(max_effects=1))
    assert_type(found, jaxink.Diagnosis)
    saved = jaxink.load_diagnosis("diagnosis")
    assert_type(saved, SavedDiagnosis)
    assert_type(saved.corrected, jaxink.FitResult)
    assert_type(found.declared, jaxink.FitResult)
    assert_type(found.corrected, jaxink.FitResult)
    assert_type(found.effects, tuple[Effect, ...])
    assert_type(found.verdict.sentence, str)
    assert_type(found.verdict.effects, tuple[str, ...])
    assert_type(found.steps[0].effect, str)
    assert_type(found.steps[0].standard_error, float | None)
    assert_type(found.before.fitted.chi_square, float)
    assert_type(found.after.fitted.degrees_of_freedom, int)
    assert_type(found.candidates[0].effect, str)
    assert_type(found.candidates[0].refit_delta_chi_square, float | None)
    assert_type(found.structure_remains, bool)
    return found


def predicted(sample: jaxink.Sample, data: jaxink.GonioData) -> None:
    assert_type(jaxink.predict(sample, data), np.ndarray)
    model = jaxink.ForwardModel(sample, [30.0], [0.0], [180.0], [550.0], [False])
    assert_type(model.wavelengths_nm, tuple[float, ...])
    assert_type(model.bsdf({"ink.scattering_per_mm": 60.0}), Array)
    assert_type(model.tabulated(), jaxink.ForwardModel)
    assert_type(jaxink.forward_model(sample, data), jaxink.ForwardModel | AugmentedModel)


def solved() -> None:
    ink = jaxink.ScatteringLayer(1.5, 2.0, 0.9, jaxink.HenyeyGreenstein(0.6))
    stack = jaxink.Stack((jaxink.ClearLayer(1.5, 0.0), ink), 1.0, 1.0)
    assert_type(stack.scattering, dict[int, jaxink.ScatteringLayer])
    directions = jaxink.Directions.from_degrees([30.0], [0.0], [180.0], [False])
    plan = jaxink.plan_channels(stack)
    assert_type(plan, ChannelPlan)
    config = jaxink.choose_sizes(stack, plan=plan)
    assert_type(config, jaxink.SolverConfig)
    assert_type(jaxink.SolverConfig(nodes_escaping=8), jaxink.SolverConfig)
    assert_type(diffuse_bsdf(stack, directions, config, plan), Array)
    assert_type(jaxink.diffuse_bsdf(stack, directions), Array)
    assert_type(hemispherical_power(stack, np.array([0.0, 0.5])), tuple[Array, Array])
    assert_type(jaxink.regular_power(stack, np.array([0.0, 0.5])), tuple[Array, Array])


def tabulated(result: jaxink.FitResult) -> None:
    table = jaxink.ink_table(result)
    assert_type(table, jaxink.InkTable)
    assert_type(jaxink.ink_table(result, options=jaxink.TableOptions()), jaxink.InkTable)
    assert_type(jaxink.read_ink_table("ink.nc"), jaxink.InkTable)
    assert_type(table.interpolation_error(), dict[str, float])
    assert_type(table.to_netcdf("ink.nc"), Path)
    assert_type(export.write(table, "mitsuba", "scene", export.ExportOptions()), list[Path])


def drawn(result: jaxink.FitResult, found: jaxink.Diagnosis) -> None:
    for name, figure in plots.figures(result):
        assert_type(name, str)
        figure.savefig(f"{name}.png")
    plots.overview_figure(result).savefig("overview.png")
    plots.cut_figure(result, 550.0, "R").savefig("cut.png")
    plots.corner_figure(result, ["ink.scattering_per_mm"]).savefig("corner.png")
    assert_type(plots.diagnosis_figures(found), Iterator[plots.CaptionedFigure])


def in_batches() -> None:
    assert_type(jaxink.load_plan("plan.toml").files, frozenset[Path])
    found = jaxink.batch("plan.toml", "folder", workers=2)
    assert_type(found, jaxink.Batch)
    assert_type(len(found), int)
    assert_type([row.name for row in found], list[str])


def of_several_measurements() -> None:
    project = jaxink.load_project("project.toml")
    assert_type(project, jaxink.Project)
    result = jaxink.fit(project)
    assert_type(result, jaxink.JointResult)
    assert_type(result["ink.thickness_um"].value, float)
    assert_type(result.reduced_chi_square, float | None)
    assert_type(jaxink.load_joint_result("folder"), jaxink.JointResult)
    plan = jaxink.plan_measurement(result, targets=["ink.thickness_um"])
    assert_type(plan, jaxink.MeasurementPlan)
    assert_type(plan.best.gain, float)


def refused(sample: jaxink.Sample) -> None:
    jaxink.fit("measurement.csv", sample, method="simplex")  # type: ignore[call-overload]
    jaxink.load_sample(3)  # type: ignore[arg-type]
    sample.title = "frozen"  # type: ignore[misc]
