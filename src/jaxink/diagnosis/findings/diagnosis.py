"""The outcome of a diagnosis, its file ``report.json``, its corrected sample file, its card in a notebook."""

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from jaxink.diagnosis.findings.candidates import CandidateRow
from jaxink.diagnosis.findings.consistency import Consistency
from jaxink.diagnosis.findings.further_measurements import FurtherMeasurement
from jaxink.diagnosis.findings.hidden import HiddenEffect
from jaxink.diagnosis.findings.judgement import fits_noise, significant_tests
from jaxink.diagnosis.findings.location import Location
from jaxink.diagnosis.findings.report_reading import REPORT_VERSION
from jaxink.diagnosis.findings.summary import Figures, Summary
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.diagnosis.search.deadline import TimeLimit
from jaxink.diagnosis.search.refit import Estimate
from jaxink.diagnosis.search.step import Step
from jaxink.diagnosis.statistics.structure import StructureResult
from jaxink.display.card import Card, CardTable, Presented
from jaxink.display.named_rows import NamedRows
from jaxink.effects import CATALOGUE_VERSION, Effect, Inapplicable
from jaxink.files.encoding import SavedInFolder, plain
from jaxink.files.result_folder import CORRECTED, DECLARED, DIAGNOSIS_HEAD, REPORT_FILE, SAMPLE_FILE
from jaxink.files.version import installed_version
from jaxink.fitting import Deviation, FitResult
from jaxink.measurement import GonioData
from jaxink.numerics.digits import percent, rounded, with_uncertainty
from jaxink.numerics.failures import Failure
from jaxink.residual import ResidualShape
from jaxink.sample import sample_text


@dataclasses.dataclass(frozen=True, repr=False)
class Diagnosis(SavedInFolder, Presented):
    """The outcome of a diagnosis.

    Parameters
    ----------
    declared
        Fit of the declared model.
    corrected
        Fit of the corrected model: its sample declares the effects found, with their values. It is
        ``declared`` if none was found.
    verdict, steps, before, after, candidates
        As in ``report.json``.
    not_testable
        Effects that cannot be tested in this case, with the reason.
    structure_before, structure_after
        Tests for structure in the residual of the first and of the last model.
    location
        Where the residual of the last model is large.
    parameters_before, parameters_after
        Value and standard error of each free parameter.
    misfit_errors
        Standard deviation by which the remaining misfit may have biased each parameter; None if it is at a
        bound.
    undetermined
        Parameters that the remaining misfit may have moved to a bound of their range.
    effects
        The effects accepted.
    remaining
        Candidates of the last screen.
    settings
        Level, number of draws and seed of the screen, and the largest number of effects and parameters.
    further
        Measurements that would distinguish the first two members of an ambiguous class.
    consistency
        Agreement of readings that must be equal.
    time_limit
        The limit of time and what it left out; None if there was no limit.
    failures
        Parts of the diagnosis that failed and are missing, such as candidates, refits and folds.
    imitations
        Effects added whose values do not mean what the effect says, with the reason.
    shape
        Smooth modes of the remaining residual; None if it has no structure.
    overlaps
        Overlap of each effect that was not added with the shape: the cosine between the two, -1 to 1, without
        what the free parameters reproduce.
    hidden
        What effects that are too weak to be seen may do to the parameters, those that do most first; empty if
        the final model does not fit the data.
    """

    json_file: ClassVar[str] = REPORT_FILE
    owned: ClassVar[tuple[str, ...]] = (DECLARED, CORRECTED)

    declared: FitResult
    corrected: FitResult
    verdict: Verdict
    steps: tuple[Step, ...]
    before: Summary
    after: Summary
    candidates: tuple[CandidateRow, ...]
    not_testable: dict[str, str]
    structure_before: StructureResult
    structure_after: StructureResult
    location: Location
    parameters_before: NamedRows[Estimate]
    parameters_after: NamedRows[Estimate]
    misfit_errors: dict[str, float | None]
    undetermined: tuple[str, ...]
    effects: tuple[Effect, ...]
    remaining: tuple[CandidateRow, ...]
    settings: dict[str, float | int]
    further: tuple[FurtherMeasurement, ...] = ()
    consistency: tuple[Consistency, ...] = ()
    time_limit: TimeLimit | None = None
    failures: tuple[Failure, ...] = ()
    imitations: dict[str, str] = dataclasses.field(default_factory=dict)
    shape: ResidualShape | None = None
    overlaps: dict[str, float] = dataclasses.field(default_factory=dict)
    hidden: tuple[HiddenEffect, ...] = ()

    @property
    def structure_remains(self) -> bool:
        """Whether the final model does not fit the data."""
        if self.verdict.code is VerdictCode.UNFINISHED:
            return not fits_noise(self.after, self.structure_after, shape=self.shape)
        return self.verdict.code.structure_remains

    @property
    def remainder(self) -> str:
        """What is left in the residual of the last model, where, and how much of it is smooth; sentences."""
        where, shape = self.location, self.shape
        if shape is None and not where.is_found:
            return f"{where.sentence[0].upper()}{where.sentence[1:]}."
        if shape is None:
            return (
                "No structure passes the tests below. The most likely smooth part, which noise has with a "
                f"probability of {where.smooth.p_value:.2g}: {where.sentence}."
            )
        place = f"The residual is {where.sentence}." if where.is_found else ""
        if shape.modes and shape.excess > 0:
            return f"{place} {shape.sentence}".lstrip()
        # Neither large enough nor broad enough for modes: the tests that it fails say what it has.
        failed = significant_tests(self.structure_after, shape)
        tests = " and ".join(f"{name} (p = {p:.2g})" for name, p in failed)
        return f"{place} It has structure by {tests}, but no broad mode stands out of the noise.".lstrip()

    @property
    def parameters(self) -> NamedRows[Estimate]:
        """Free parameters of the final model; `parameters_after` by another name."""
        return self.parameters_after

    @property
    def measured_per_sr(self) -> np.ndarray:
        """Measured BSDF at the used points."""
        return self.declared.data.bsdf_per_sr[self.declared.data.used]

    def card(self) -> Card:
        """Verdict, errors and parameters before and after, and effects added."""
        return diagnosis_card(
            self.declared.data.source,
            self.measured_per_sr,
            self.verdict,
            self.steps,
            (self.before, self.after),
            (self.parameters_before, self.parameters_after),
        )

    def files_beside(self) -> dict[str, bytes]:
        """Both fits, and the sample file of the corrected model."""
        text = corrected_text(self.corrected, self.verdict, self.steps)
        fits = {DECLARED: self.declared, CORRECTED: self.corrected}
        inside = {
            f"{folder}/{name}": content
            for folder, fit in fits.items()
            for name, content in fit.files().items()
        }
        return {SAMPLE_FILE: text.encode(), **inside}

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in ``report.json``; see docs/manual/diagnosis.md."""
        return plain(
            {
                "schema_version": REPORT_VERSION,
                "catalogue_version": CATALOGUE_VERSION,
                "source": self.declared.data.source,
                "noise": self.declared.noise,
                "settings": self.settings,
                "verdict": self.verdict,
                "steps": [step_row(step) for step in self.steps],
                "before": figures_row(self.before),
                "after": figures_row(self.after),
                "parameters": [
                    parameter_row(
                        name,
                        self.parameters_before[name],
                        estimate,
                        self.misfit_errors[name],
                        is_determined=name not in self.undetermined,
                    )
                    for name, estimate in self.parameters_after.items()
                    if name in self.parameters_before
                ],
                "scans": scan_rows(self.declared.data, self.before, self.after),
                "candidates": [candidate_row(row) for row in self.candidates],
                "remaining_candidates": [candidate_row(row) for row in self.remaining],
                "not_testable": self.not_testable,
                "inapplicable": inapplicable_names(self.not_testable),
                "further_measurements": self.further,
                "data_consistency": self.consistency,
                "structure": {
                    "before": structure_row(self.structure_before),
                    "after": structure_row(self.structure_after),
                },
                "residual": self.location.to_dict()
                | {
                    "shape": None if self.shape is None else self.shape.to_dict(),
                    "overlaps": self.overlaps,
                },
                "imitations": self.imitations,
                "hidden_effects": self.hidden,
                "time_limit": time_limit_row(self.time_limit),
                "failures": [failure._asdict() for failure in self.failures],
                "versions": self.declared.versions,
            }
        )


def corrected_text(corrected: FitResult, verdict: Verdict, steps: tuple[Step, ...]) -> str:
    """Text of the sample file of the corrected model of a diagnosis."""
    head = [
        f"{DIAGNOSIS_HEAD} {corrected.data.source or 'a measurement'} by jaxink {installed_version()}.",
        verdict.sentence,
        "The declared sample with the effects that were found. Values are those of the fit; what was free is",
        "still free.",
        "",
    ]
    return sample_text(corrected.sample, _remarks(corrected, steps), head)


def _remarks(corrected: FitResult, steps: tuple[Step, ...]) -> dict[str, str]:
    """A comment for each effect that was added, by its table or by its first parameter."""
    declared = {effect.name for effect in corrected.sample.effects}
    remarks = {}
    for step in steps:
        place = f"effects.{step.effect}" if step.effect in declared else step.form.strength.name
        rows = [corrected[name] for name in step.terms if name in corrected.parameters]
        found = ", ".join(
            f"{p.name} = {with_uncertainty(p.value, p.standard_error)} {p.unit}".rstrip() for p in rows
        )
        lines = [
            f"Added by the diagnosis: {step.form.statement}.",
            f"Chi-square decreased by {step.actual_delta_chi_square:.1f}; {found}.",
        ]
        if others := [name for name in step.members if name != step.effect]:
            lines.append(f"These data cannot distinguish it from: {', '.join(others)}.")
        remarks[place] = "\n".join(lines)
    return remarks


def step_row(step: Step) -> dict[str, Any]:
    """An effect that was added."""
    return {
        "effect": step.effect,
        "class": list(step.members),
        "predicted_delta_chi_square": step.predicted_delta_chi_square,
        "actual_delta_chi_square": step.actual_delta_chi_square,
        "held_out_gain": step.held_out_gain.mean,
        "held_out_gain_standard_error": step.held_out_gain.standard_error,
        "strength": step.strength,
        "standard_error": step.standard_error,
        "unit": step.unit,
        "terms": step.terms,
        "term_standard_errors": step.term_errors,
    }


def parameter_row(
    name: str, before: Estimate, after: Estimate, misfit_error: float | None, *, is_determined: bool
) -> dict[str, Any]:
    """A parameter before and after."""
    error = after.standard_error
    return {
        "name": name,
        "before": before.value,
        "before_standard_error": before.standard_error,
        "after": after.value,
        "after_standard_error": error,
        "bias_in_standard_errors": (before.value - after.value) / error if error else None,
        "misfit_error": misfit_error,
        "is_determined": is_determined,
    }


def scan_rows(data: GonioData, before: Summary, after: Summary) -> list[dict[str, Any]]:
    """Misfit of each scan."""
    used = data.used
    measured, index = data.bsdf_per_sr[used], data.scan_index[used]
    rows = []
    for scan in data.scans:
        here = index == scan.index
        if not here.any():
            continue
        row = {"theta_i_deg": scan.theta_i_deg, "wavelength_nm": scan.wavelength_nm, "side": scan.side}
        for when, summary in (("before", before), ("after", after)):
            for what, predicted in (("", summary.predicted_per_sr), ("held_out_", summary.held_out_per_sr)):
                row[f"{what}relative_rms_{when}"] = _relative_rms(predicted, measured, here)
            row[f"chi_square_{when}"] = float(np.sum(summary.whitened[here] ** 2))
        rows.append({**row, "points": int(here.sum())})
    return rows


def _relative_rms(predicted: np.ndarray | None, measured: np.ndarray, here: np.ndarray) -> float | None:
    if predicted is None:
        return None
    rms = float(np.sqrt(np.mean((predicted[here] / measured[here] - 1) ** 2)))
    # The fit without this scan may have failed.
    return rms if np.isfinite(rms) else None


def figures_row(summary: Summary) -> dict[str, Any]:
    """Figures of merit, including those of held-out points."""
    held_out = None if summary.held_out is None else dataclasses.asdict(summary.held_out)
    return dataclasses.asdict(summary.fitted) | {"held_out": held_out}


def candidate_row(row: CandidateRow) -> dict[str, Any]:
    """A candidate; `members` is called ``class``."""
    return {"class" if key == "members" else key: value for key, value in dataclasses.asdict(row).items()}


def inapplicable_names(reasons: Mapping[str, str]) -> list[str]:
    """The effects whose reason lies in the sample, which text alone would not keep."""
    return [name for name, reason in reasons.items() if isinstance(reason, Inapplicable)]


def structure_row(structure: StructureResult) -> dict[str, Any]:
    """Tests for structure in a residual."""
    return {
        "p_value": structure.p_value,
        "leading": structure.leading,
        "statistics": {s.name: {"value": s.value, "p_value": s.p_value} for s in structure.statistics},
    }


def time_limit_row(limit: TimeLimit | None) -> dict[str, Any] | None:
    """A time limit and what was not done; None if there was no limit."""
    if limit is None:
        return None
    not_done = [{"task": o.task.value, "names": list(o.names)} for o in limit.not_done]
    return {"limit_s": limit.limit_s, "elapsed_s": limit.elapsed_s, "not_done": not_done}


def diagnosis_card(
    source: str,
    measured_per_sr: np.ndarray,
    verdict: Verdict,
    steps: tuple[Step, ...],
    figures: tuple[Summary, Summary],
    parameters: tuple[NamedRows[Estimate], NamedRows[Estimate]],
) -> Card:
    """Card of a diagnosis; ``figures`` and ``parameters`` of the declared and the corrected model."""
    title = f"Diagnosis of {source or 'a measurement'}: {verdict.code.value}"
    tables = (
        _figures_table(measured_per_sr, figures, bool(steps)),
        _step_table(steps),
        _parameter_table(*parameters),
    )
    return Card(title, (verdict.sentence,), tables)


def _figures_table(
    measured_per_sr: np.ndarray, figures: tuple[Summary, Summary], has_steps: bool
) -> CardTable:
    states = dict(zip(("declared", "corrected"), figures[: 1 + has_steps], strict=False))
    rows = [
        [name, points, *_cells(found, deviation)]
        for name, summary in states.items()
        for points, found, deviation in summary.rows(measured_per_sr)
    ]
    heads = [
        "model",
        "points",
        "chi-square",
        "reduced chi-square",
        "relative RMSD",
        "rms of measured / model - 1",
    ]
    return CardTable(heads, rows, (0, 1))


def _cells(figures: Figures, deviation: Deviation | None) -> list[str]:
    shares = (percent(share) for share in (figures.rmsd_relative, deviation and deviation.rms))
    return [rounded(figures.chi_square, 5), rounded(figures.reduced_chi_square, 4), *shares]


def _step_table(steps: tuple[Step, ...]) -> CardTable:
    rows = [
        [step.effect, with_uncertainty(step.shown, step.standard_error), step.unit]
        + [f"{step.actual_delta_chi_square:.4g}", ", ".join(step.members[1:])]
        for step in steps
    ]
    heads = ["effect added", "strength(s.e.)", "unit", "decrease in chi-square", "indistinguishable from"]
    return CardTable(heads, rows, (0, 2, 4))


def _parameter_table(before: NamedRows[Estimate], after: NamedRows[Estimate]) -> CardTable:
    rows = [
        [name, with_uncertainty(*before[name]) if name in before else "", with_uncertainty(*estimate)]
        for name, estimate in after.items()
    ]
    return CardTable(["parameter", "declared(s.e.)", "corrected(s.e.)"], rows)
