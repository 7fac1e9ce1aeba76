"""Tables of a diagnosis for the terminal."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from jaxink.cli.fit_tables import (
    DELTA_CHI_SQUARE,
    add_column,
    plain_table,
    show_files,
    show_lines,
    show_outcome,
)
from jaxink.numerics.digits import percent, rounded, with_uncertainty

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis, Figures
    from jaxink.fitting import Deviation
    from jaxink.report import NextStep

MOST_CANDIDATES = 12
MOST_OVERLAPS = 3
_DELTAS = (f"{DELTA_CHI_SQUARE}\nscreen", f"{DELTA_CHI_SQUARE}\nrefit")
_TESTABLE = {"testable": "yes", "hardly_testable": "hardly", "not_testable": "no"}


def show_diagnosis(
    to: Console, diagnosis: "Diagnosis", files: Iterable[Path] = (), todo: Iterable["NextStep"] = ()
) -> None:
    """Print a diagnosis, the files that were written, and what to do next."""
    show_outcome(to, diagnosis.declared)
    to.print()
    to.print(diagnosis.verdict.sentence, style="bold", soft_wrap=True)
    to.print(f"Verdict: {diagnosis.verdict.code}")
    to.print(merit_table(diagnosis))
    if diagnosis.steps:
        show_lines(to, "Effects added", step_lines(diagnosis))
        to.print(step_table(diagnosis))
        to.print(change_table(diagnosis))
    if diagnosis.candidates:
        to.print(candidate_table(diagnosis))
    rest = len(diagnosis.candidates) - MOST_CANDIDATES
    show_lines(to, "", [f"The report lists {rest} more candidates."] if rest > 0 else [])
    limit = diagnosis.time_limit
    if limit is not None:
        show_lines(to, "Not done within the time limit", [o.described() for o in limit.not_done])
    failed = [failure.sentence for failure in diagnosis.failures]
    show_lines(to, "Parts of the diagnosis failed and are missing", failed)
    show_lines(to, "Remaining residual", [diagnosis.remainder, *_overlap_lines(diagnosis)])
    show_lines(to, "Noise", [diagnosis.declared.noise_sentence])
    show_files(to, files)
    show_lines(to, "Next", [line for step in todo for line in step.lines()])


def _overlap_lines(diagnosis: "Diagnosis") -> list[str]:
    leading = [f"{name} {value:+.2f}" for name, value in list(diagnosis.overlaps.items())[:MOST_OVERLAPS]]
    return (
        [f"Largest overlaps of effects that were not added with it: {', '.join(leading)}."] if leading else []
    )


def merit_table(diagnosis: "Diagnosis") -> Table:
    """Errors of the declared and the corrected model, for fitted and for held-out points."""
    table = plain_table("Error of each model")
    heads = ("", "points", "RMSD\nof pi f", "relative\nRMSD", "rms of\nm/s - 1")
    for i, head in enumerate((*heads, "chi-\nsquare", "reduced", "p")):
        add_column(table, head, i < 2)
    states = {"declared": diagnosis.before} | ({"corrected": diagnosis.after} if diagnosis.steps else {})
    measured = diagnosis.measured_per_sr
    for name, summary in states.items():
        for points, figures, deviation in summary.rows(measured):
            table.add_row(name, points, *_merit_cells(figures, deviation))
    return table


def _merit_cells(figures: "Figures", deviation: "Deviation | None") -> list[str]:
    return [
        f"{figures.rmsd_absolute:.4g}",
        percent(figures.rmsd_relative),
        percent(deviation and deviation.rms),
        _size(figures.chi_square),
        rounded(figures.reduced_chi_square, 4),
        "<1e-300" if figures.probability == 0 else rounded(figures.probability, 2),
    ]


def step_lines(diagnosis: "Diagnosis") -> list[str]:
    """Effects that were added, each in a sentence with its numbers."""
    lines = []
    for step in diagnosis.steps:
        rest = ", ".join(step.members[1:])
        others = f"; indistinguishable from {rest}" if rest else ""
        lines.append(f"{step.sentence[0].upper()}{step.sentence[1:]} ({step.effect}{others}).")
    return lines


def step_table(diagnosis: "Diagnosis") -> Table:
    """How much each added effect explains."""
    table = plain_table("")
    add_column(table, "effect", is_text=True)
    for head in (*_DELTAS, "gain in held-out\nlog density"):
        add_column(table, head, is_text=False)
    for s in diagnosis.steps:
        gain = with_uncertainty(s.held_out_gain.mean, s.held_out_gain.standard_error)
        deltas = (_size(s.predicted_delta_chi_square), _size(s.actual_delta_chi_square))
        table.add_row(s.effect, *deltas, gain)
    return table


def _size(chi_square: float | None) -> str:
    """Chi-square, or a change of it, without an exponent if it can be."""
    if chi_square is None or not 1e3 <= abs(chi_square) < 1e7:
        return rounded(chi_square, 4)
    return f"{chi_square:.0f}"


def change_table(diagnosis: "Diagnosis") -> Table:
    """Free parameters of the declared and the corrected model."""
    table = plain_table("Parameters")
    heads = ["parameter", "declared(s.e.)", "corrected(s.e.)", "difference/s.e."]
    if diagnosis.structure_remains:
        heads += ["possible shift by misfit", "determined"]
    for head in heads:
        wraps = head in ("parameter", "possible shift by misfit", "determined")
        add_column(table, head, head == "parameter", wraps)
    for name, (value, error) in diagnosis.parameters_after.items():
        first = diagnosis.parameters_before.get(name)
        before = "" if first is None else with_uncertainty(*first)
        bias = "" if first is None or not error else f"{(first.value - value) / error:+.3g}"
        cells = [name, before, with_uncertainty(value, error), bias]
        if diagnosis.structure_remains:
            cells.append(rounded(diagnosis.misfit_errors[name]))
            cells.append("no" if name in diagnosis.undetermined else "yes")
        table.add_row(*cells)
    return table


def candidate_table(diagnosis: "Diagnosis") -> Table:
    """The leading candidates of the first screen."""
    table = plain_table("Leading candidates of the first screen")
    add_column(table, "effect", is_text=True, wraps=True)
    for head in ("z", "adj.\np", *_DELTAS, "strength", "degen-\nerate"):
        add_column(table, head, is_text=False)
    add_column(table, "test-\nable", is_text=True)
    added = {step.effect for step in diagnosis.steps}
    for row in diagnosis.candidates[:MOST_CANDIDATES]:
        table.add_row(
            row.effect,
            rounded(row.z),
            rounded(row.p_adjusted, 2),
            _size(row.predicted_delta_chi_square),
            _size(row.refit_delta_chi_square),
            f"{rounded(row.strength)} {row.unit}".rstrip(),
            percent(row.degenerate_fraction, ".0f"),
            "added" if row.effect in added else _TESTABLE[row.status],
            style="bold" if row.effect in added else "",
        )
    return table
