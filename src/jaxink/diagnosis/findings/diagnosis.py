"""The outcome of a diagnosis, and its file ``report.json``."""

import dataclasses
from typing import Any, ClassVar

import numpy as np

from jaxink.diagnosis.findings.candidates import CandidateRow
from jaxink.diagnosis.findings.card import diagnosis_card
from jaxink.diagnosis.findings.consistency import Consistency
from jaxink.diagnosis.findings.corrected_file import corrected_text
from jaxink.diagnosis.findings.further_measurements import FurtherMeasurement
from jaxink.diagnosis.findings.hidden import HiddenEffect
from jaxink.diagnosis.findings.judgement import is_met, significant_tests
from jaxink.diagnosis.findings.location import Location
from jaxink.diagnosis.findings.report_reading import REPORT_VERSION
from jaxink.diagnosis.findings.report_rows import (
    candidate_row,
    figures_row,
    inapplicable_names,
    parameter_row,
    scan_rows,
    step_row,
    structure_row,
    time_limit_row,
)
from jaxink.diagnosis.findings.summary import Summary
from jaxink.diagnosis.findings.verdict import Verdict, VerdictCode
from jaxink.diagnosis.search.allowance import TimeLimit
from jaxink.diagnosis.search.refit import Estimate
from jaxink.diagnosis.search.step import Step
from jaxink.diagnosis.statistics.structure import StructureResult
from jaxink.display.card import Card, Presented
from jaxink.display.named_rows import NamedRows
from jaxink.effects import CATALOGUE_VERSION, Effect
from jaxink.files.encoding import SavedInFolder, plain
from jaxink.files.result_folder import CORRECTED, DECLARED, REPORT_FILE, SAMPLE_FILE
from jaxink.fitting import FitResult
from jaxink.numerics.failures import Failure
from jaxink.residual import ResidualShape


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
            return not is_met(self.after, self.structure_after, shape=self.shape)
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
