"""Entries of ``report.json``; docs/manual/diagnosis.md describes them."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxink.diagnosis.findings.candidates import CandidateRow
from jaxink.diagnosis.findings.summary import Summary
from jaxink.diagnosis.search.allowance import TimeLimit
from jaxink.diagnosis.search.refit import Estimate
from jaxink.diagnosis.search.step import Step
from jaxink.diagnosis.statistics.structure import StructureResult
from jaxink.effects.kinds import Inapplicable
from jaxink.measurement import GonioData


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
