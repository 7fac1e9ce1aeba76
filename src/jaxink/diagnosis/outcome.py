"""The outcome of a diagnosis, and its plain form for files."""

import dataclasses
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from jaxink.diagnosis.consistency import Consistency
from jaxink.diagnosis.cross_validation import HeldOutGain, Observations
from jaxink.diagnosis.location import Location
from jaxink.diagnosis.structure import StructureResult
from jaxink.effects import CATALOGUE_VERSION, Effect
from jaxink.files.encoding import SavedInFolder, plain
from jaxink.fitting import FitResult
from jaxink.fitting.merit import merit
from jaxink.measurement import GonioData
from jaxink.sample import Sample

if TYPE_CHECKING:
    from jaxink.diagnosis.further_measurements import Further
    from jaxink.diagnosis.stage import Refit, Stage

REPORT_VERSION = 1
REPORT_FILE = "report.json"


@dataclasses.dataclass(frozen=True)
class Figures:
    """Figures of merit of one set of predictions.

    Parameters
    ----------
    rmsd_absolute
        Root mean square of pi (measured - predicted).
    rmsd_relative
        Root mean square of the difference over the mean of both; None where a value is not positive.
    relative_rms
        Root mean square of predicted / measured - 1.
    chi_square, degrees_of_freedom, reduced_chi_square, probability
        Under the stated noise, residuals weighted as in the fits; of points held out, the number of points
        stands for the degrees of freedom.
    """

    rmsd_absolute: float
    rmsd_relative: float | None
    relative_rms: float | None
    chi_square: float
    degrees_of_freedom: int
    reduced_chi_square: float | None
    probability: float | None


@dataclasses.dataclass(frozen=True)
class Summary:
    """How well a model meets the measurement, and points that its fit did not see.

    Parameters
    ----------
    fitted, held_out
        Of the fit of all points, and of fits without each scan in turn.
    predicted_per_sr, whitened
        Of the fit of all points.
    held_out_per_sr
        Each point by the fit that did not see it.
    """

    fitted: Figures
    held_out: Figures
    predicted_per_sr: np.ndarray
    whitened: np.ndarray
    held_out_per_sr: np.ndarray


@dataclasses.dataclass(frozen=True)
class Step:
    """An effect that was added.

    Parameters
    ----------
    effect, form
        Its name and form.
    members
        Its class: effects whose refits differ by less than 4 in chi-square, the best first.
    predicted_drop, actual_drop
        Fall of chi-square by the screen and by the refit.
    held_out_gain
        Gain in the log density of held-out points.
    strength, standard_error, unit
        Distance of its first term from the declared model; the error is None where a bound holds it.
    terms, term_errors
        Values of all its terms and their standard errors.
    refit
        The refit.
    """

    effect: str
    form: Effect
    members: tuple[str, ...]
    predicted_drop: float
    actual_drop: float
    held_out_gain: HeldOutGain
    strength: float
    standard_error: float | None
    unit: str
    terms: dict[str, float]
    term_errors: dict[str, float | None]
    refit: "Refit"


@dataclasses.dataclass(frozen=True)
class CandidateRow:
    """What the first screen says of an effect, and its refit where there was one."""

    effect: str
    z: float
    p_raw: float
    p_adjusted: float
    absorbed_fraction: float
    detection_limit: float
    detection_limit_unit: str
    strength: float
    unit: str
    members: tuple[str, ...]
    predicted_drop: float
    refit_drop: float | None
    status: str
    reason: str


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What is the case.

    Parameters
    ----------
    code
        Of `jaxink.diagnosis.verdict.CODES`.
    effects
        Names, best first.
    sentence
        In words.
    """

    code: str
    effects: tuple[str, ...]
    sentence: str


@dataclasses.dataclass(frozen=True)
class Diagnosis(SavedInFolder):
    """The outcome of a diagnosis.

    Parameters
    ----------
    result
        Fit of the declared model.
    verdict, steps, before, after, candidates
        As in ``report.json``.
    not_testable
        Effects of the catalogue about which the case says nothing, with the reason.
    structure_before, structure_after
        Whether anything is left.
    location
        Where, after the last step.
    parameters_before, parameters_after
        Value and standard error of each free parameter.
    misfit_errors
        Standard deviation by which what remains of the misfit may have shifted each parameter; None where a
        bound holds it.
    undetermined
        Parameters that what remains of the misfit may shift to a bound of their range.
    refined
        The sample with what was found of it.
    effects
        Those accepted.
    remaining
        Candidates of the last screen.
    settings
        Level, bootstrap and seed of the screen, and the most effects.
    further
        Measurements that would tell the first two members of an ambiguous class apart.
    consistency
        Whether the readings agree with each other where they must.
    """

    json_file: ClassVar[str] = REPORT_FILE

    result: FitResult
    verdict: Verdict
    steps: tuple[Step, ...]
    before: Summary
    after: Summary
    candidates: tuple[CandidateRow, ...]
    not_testable: dict[str, str]
    structure_before: StructureResult
    structure_after: StructureResult
    location: Location
    parameters_before: dict[str, tuple[float, float | None]]
    parameters_after: dict[str, tuple[float, float | None]]
    misfit_errors: dict[str, float | None]
    undetermined: tuple[str, ...]
    refined: Sample
    effects: tuple[Effect, ...]
    remaining: tuple[CandidateRow, ...]
    settings: dict[str, float | int]
    further: "tuple[Further, ...]" = ()
    consistency: tuple[Consistency, ...] = ()

    @property
    def structure_remains(self) -> bool:
        """Whether the model that was ended with misses the data."""
        return self.verdict.code in ("partly_explained", "unexplained_structure")

    def to_dict(self) -> dict[str, Any]:
        """Plain data, as in ``report.json``; see docs/diagnosis.md."""
        return plain(
            {
                "schema_version": REPORT_VERSION,
                "catalogue_version": CATALOGUE_VERSION,
                "source": self.result.data.source,
                "noise": self.result.noise,
                "settings": self.settings,
                "verdict": dataclasses.asdict(self.verdict),
                "steps": [
                    {
                        "effect": s.effect,
                        "class": list(s.members),
                        "predicted_drop": s.predicted_drop,
                        "actual_drop": s.actual_drop,
                        "held_out_gain": s.held_out_gain.mean,
                        "held_out_gain_standard_error": s.held_out_gain.standard_error,
                        "strength": s.strength,
                        "standard_error": s.standard_error,
                        "unit": s.unit,
                        "terms": s.terms,
                        "term_standard_errors": s.term_errors,
                    }
                    for s in self.steps
                ],
                "before": _figures(self.before),
                "after": _figures(self.after),
                "parameters": [
                    {
                        "name": name,
                        "before": self.parameters_before[name][0],
                        "before_standard_error": self.parameters_before[name][1],
                        "after": after,
                        "after_standard_error": error,
                        "bias_in_standard_errors": None
                        if not error
                        else (self.parameters_before[name][0] - after) / error,
                        "misfit_error": self.misfit_errors[name],
                        "is_determined": name not in self.undetermined,
                    }
                    for name, (after, error) in self.parameters_after.items()
                    if name in self.parameters_before
                ],
                "scans": _scans(self.result.data, self.before, self.after),
                "candidates": [_row(row) for row in self.candidates],
                "remaining_candidates": [_row(row) for row in self.remaining],
                "not_testable": self.not_testable,
                "further_measurements": [dataclasses.asdict(f) for f in self.further],
                "data_consistency": [
                    dataclasses.asdict(c) | {"is_broken": c.is_broken} for c in self.consistency
                ],
                "structure": {
                    "before": _structure(self.structure_before),
                    "after": _structure(self.structure_after),
                },
                "residual": self.location.to_dict(),
                "versions": self.result.versions,
            }
        )


def _scans(data: GonioData, before: Summary, after: Summary) -> list[dict[str, Any]]:
    """Misfit scan by scan."""
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
                ratio = predicted[here] / measured[here] - 1
                row[f"{what}relative_rms_{when}"] = float(np.sqrt(np.mean(ratio**2)))
            row[f"chi_square_{when}"] = float(np.sum(summary.whitened[here] ** 2))
        rows.append({**row, "points": int(here.sum())})
    return rows


def _figures(summary: Summary) -> dict[str, Any]:
    return dataclasses.asdict(summary.fitted) | {"held_out": dataclasses.asdict(summary.held_out)}


def _row(row: CandidateRow) -> dict[str, Any]:
    plain = dataclasses.asdict(row)
    return {"class" if key == "members" else key: value for key, value in plain.items()}


def _structure(structure: StructureResult) -> dict[str, Any]:
    return {
        "p_value": structure.p_value,
        "leading": structure.leading,
        "statistics": {s.name: {"value": s.value, "p_value": s.p_value} for s in structure.statistics},
    }


def summary_of(
    data: GonioData, observations: Observations, stage: "Stage", held_out: np.ndarray, folds: np.ndarray
) -> Summary:
    """Figures of merit of a stage.

    Parameters
    ----------
    data, observations
        The measurement.
    stage
        Its fit of all points.
    held_out
        Predictions of all points by the fit without each fold.
    folds
        Which points each fold left out.
    """
    n = len(observations.measured_per_sr)
    predicted, whitened = stage.solution.predicted_per_sr, stage.residual[:n]
    unseen = np.sum(np.where(folds, held_out, 0.0), axis=0) / np.maximum(np.sum(folds, axis=0), 1)
    left = stage.bench.whiten(unseen, observations.measured_per_sr - unseen)[:n]
    return Summary(
        _merit(data, predicted, whitened, len(stage.free)),
        _merit(data, unseen, left, 0),
        predicted,
        whitened,
        unseen,
    )


def _merit(data, predicted, whitened, n_parameters) -> Figures:
    found = merit(data, predicted, whitened, n_parameters)
    return Figures(
        found.rmsd_absolute_pi,
        found.rmsd_relative,
        found.relative_rms,
        found.chi_square,
        found.degrees_of_freedom,
        found.reduced_chi_square,
        found.probability,
    )
