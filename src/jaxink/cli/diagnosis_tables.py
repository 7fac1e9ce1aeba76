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
    from jaxink.report import NextStep

MOST_CANDIDATES = 12
MOST_OVERLAPS = 3
_DELTAS = (f"{DELTA_CHI_SQUARE} predicted", f"{DELTA_CHI_SQUARE} refit")


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
    """Errors before and after, for fitted and for held-out points."""
    table = plain_table("Error before and after")
    heads = ("", "points", "RMSD of pi f", "relative RMSD", "rms s/m - 1", "chi-square", "reduced", "p")
    for i, head in enumerate(heads):
        table.add_column(head, justify="left" if i < 2 else "right", no_wrap=True)
    states = {"before": diagnosis.before} | ({"after": diagnosis.after} if diagnosis.steps else {})
    for name, summary in states.items():
        table.add_row(name, "fitted", *_merit_cells(summary.fitted))
        if summary.held_out is not None:
            table.add_row(name, "held out", *_merit_cells(summary.held_out))
    return table


def _merit_cells(figures: "Figures") -> list[str]:
    return [
        f"{figures.rmsd_absolute:.4g}",
        percent(figures.rmsd_relative),
        percent(figures.relative_rms),
        f"{figures.chi_square:.5g}",
        rounded(figures.reduced_chi_square, 4),
        rounded(figures.probability),
    ]


def step_table(diagnosis: "Diagnosis") -> Table:
    """Effects that were added."""
    table = plain_table("Effects added")
    words = ("effect", "unit", "indistinguishable from")
    for head in ("effect", "strength(s.e.)", "unit", *_DELTAS, "held-out gain", words[-1]):
        add_column(table, head, head in words, wraps=head in words or head in _DELTAS)
    for s in diagnosis.steps:
        strength = with_uncertainty(s.shown, s.standard_error)
        gain = with_uncertainty(s.held_out_gain.mean, s.held_out_gain.standard_error)
        deltas = (f"{s.predicted_delta_chi_square:.4g}", f"{s.actual_delta_chi_square:.4g}")
        table.add_row(s.effect, strength, s.unit, *deltas, gain, ", ".join(s.members[1:]))
    return table


def change_table(diagnosis: "Diagnosis") -> Table:
    """Free parameters before and after."""
    table = plain_table("Parameters")
    heads = ["parameter", "before(s.e.)", "after(s.e.)", "bias/s.e."]
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
    deltas = (f"{DELTA_CHI_SQUARE} screen", f"{DELTA_CHI_SQUARE} refit")
    for head in ("effect", "z", "adj. p", *deltas, "strength", "unit", "degenerate", "status"):
        words = head in ("effect", "unit", "status")
        add_column(table, head, words, wraps=words or head in (*deltas, "degenerate"))
    added = {step.effect for step in diagnosis.steps}
    for row in diagnosis.candidates[:MOST_CANDIDATES]:
        table.add_row(
            row.effect,
            rounded(row.z),
            rounded(row.p_adjusted, 2),
            rounded(row.predicted_delta_chi_square, 4),
            rounded(row.refit_delta_chi_square, 4),
            rounded(row.strength, 4),
            row.unit,
            percent(row.degenerate_fraction),
            "added" if row.effect in added else row.status.replace("_", " "),
            style="bold" if row.effect in added else "",
        )
    return table
