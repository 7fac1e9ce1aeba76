"""What a diagnosis says of itself in a notebook."""

import numpy as np

from jaxink.diagnosis.findings.summary import Figures, Summary
from jaxink.diagnosis.findings.verdict import Verdict
from jaxink.diagnosis.search.refit import Estimate
from jaxink.diagnosis.search.step import Step
from jaxink.display.card import Card, CardTable
from jaxink.display.named_rows import NamedRows
from jaxink.fitting.deviation import Deviation
from jaxink.numerics.digits import percent, rounded, with_uncertainty


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
