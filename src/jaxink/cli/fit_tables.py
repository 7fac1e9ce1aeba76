"""Tables of a fit result for the terminal."""

import dataclasses
import re
import sys
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.table import Table

from jaxink.display.card import CardTable
from jaxink.fitting import (
    compilation_sentence,
    correlation_lines,
    derived_table,
    named_lines,
    parameter_notes,
    points_words,
    rejected_table,
    rejection,
    scan_table,
    search_table,
    value_head,
)
from jaxink.numerics.digits import percent, plain, relative_error, with_uncertainty
from jaxink.plots import fit_wavelengths, used_wavelengths

if TYPE_CHECKING:
    from jaxink.fitting import FitResult, FittedParameter, JointResult
    from jaxink.report import NextStep

MOST_MISTAKES = 3
# ASCII if the terminal cannot show more.
DELTA_CHI_SQUARE = "Δχ²" if (sys.stdout.encoding or "").lower().startswith("utf") else "delta chi2"
# The strongest are listed.
MOST_CORRELATIONS = 10
_WIDTH_WITHOUT_TERMINAL = 120
# Heads are broken into lines of this width, if neither a cell nor a word is longer.
_HEAD_WIDTH = 10


def console() -> Console:
    """Console for results; wide enough for the tables if the output is not a terminal."""
    made = Console(markup=False, highlight=False, emoji=False)
    if not made.is_terminal:
        made.width = max(made.width, _WIDTH_WITHOUT_TERMINAL)
    return made


def show_result(
    to: Console, result: "FitResult", files: Iterable[Path] = (), todo: Iterable["NextStep"] = ()
) -> None:
    """Print a fit result, the files that were written, and what to do next."""
    show_verdict(to, result)
    show_outcome(to, result)
    show_parameters(to, result)
    if result.derived:
        to.print(card_table(derived_table(result)))
    show_lines(to, "Figures of merit (m measured, s predicted)", merit_lines(result))
    to.print(worst_scans(result))
    show_lines(to, "Correlations", correlation_lines(result, MOST_CORRELATIONS))
    if result.residual_shape is not None:
        show_lines(to, "Shape of the residual", [result.residual_shape.sentence])
    show_lines(to, "Noise", [result.noise_sentence])
    to.print(card_table(search_table(result.searches)))
    show_lines(to, "", [compilation_sentence(result)])
    show_minima(to, result)
    show_lines(to, "Notes", result.notes)
    show_mistakes(to, result)
    show_files(to, files)
    show_lines(to, "Next", [line for step in todo for line in step.lines()])


def show_parameters(to: Console, result: "FitResult | JointResult") -> None:
    """Print the parameters after a fit, with notes."""
    to.print(parameter_table(tuple(result.parameters.values()), result.verdict.standard_errors_hold))
    show_lines(to, "", parameter_notes(result))


def show_minima(to: Console, result: "FitResult | JointResult") -> None:
    """Print the minima that were found, if there is more to tell than the fit."""
    if result.minima is not None and result.minima.is_told:
        to.print(card_table(result.minima.table()))
        show_lines(to, "", [result.minima.sentence])


def show_mistakes(to: Console, result: "FitResult") -> None:
    """Print the mistakes that the data name; without any, the nearest of those that are rejected."""
    named, tried = named_lines(result), rejected_table(result.mistakes)
    show_lines(to, "Mistakes in the input", named)
    if named or not tried.rows:
        return
    rest = len(tried.rows) - MOST_MISTAKES
    to.print(card_table(dataclasses.replace(tried, rows=tried.rows[:MOST_MISTAKES])))
    before, is_misfit = result.verdict.reduced_chi_square, result.verdict.is_misfit
    more = [f"{rest} more are in result.json."] if rest > 0 else []
    show_lines(to, "", [*more, rejection(result.mistakes, before, is_misfit=is_misfit)])


def show_verdict(to: Console, result: "FitResult") -> None:
    """Print the verdict on the fit, as the first line."""
    verdict = result.verdict
    style = "bold red" if verdict.code.needs_warning else "bold"
    to.print(verdict.sentence, style=style, soft_wrap=True)


def show_outcome(to: Console, result: "FitResult") -> None:
    """Print what was fitted, and whether the fit converged."""
    from jaxink.measurement import mask_sentences

    data = result.data
    to.print(points_words(data))
    objective = "chi-square" if result.objective == "chi_square" else f"the {result.objective} RMSD"
    sentence = f"{result.method.capitalize().replace('_', '-')} fit of {objective} {result.outcome.value}."
    to.print(sentence, style="bold" if result.outcome.is_as_asked else "bold red", soft_wrap=True)
    for sentence in mask_sentences(data.mask)[:-1]:
        to.print(sentence, soft_wrap=True)


def parameter_table(parameters: Sequence["FittedParameter"], errors_hold: bool = True) -> Table:
    """One row for each parameter, those that were not fitted without a range; unsound errors are marked."""
    rows = [_parameter_row(p) for p in parameters]
    heads = [
        "parameter",
        "nm",
        value_head(errors_hold),
        "rel.",
        "over minima",
        "start",
        "min",
        "max",
        "tie",
        "flag",
    ]
    words = ("parameter", "tie", "flag")
    at_times = ("nm", "over minima", "tie", "flag")
    shown = [i for i, head in enumerate(heads) if head not in at_times or any(r[i] for r in rows)]
    if not errors_hold:
        shown.remove(heads.index("rel."))
    table = plain_table("")
    for i in shown:
        add_column(table, heads[i], heads[i] in words, wraps=heads[i] in ("parameter", "tie", "flag"))
    for parameter, row in zip(parameters, rows, strict=True):
        table.add_row(*(row[i] for i in shown), style="" if parameter.free else "dim")
    return table


def _parameter_row(p: "FittedParameter") -> list[str]:
    name, _, wavelength_nm = p.name.partition("@")
    if not p.free:
        return [name, wavelength_nm, plain(p.value), "", "", "", "", "", p.tie or "", p.flag]
    errors = [f(p.value, p.standard_error) for f in (with_uncertainty, relative_error)]
    return [
        name,
        wavelength_nm,
        *errors,
        p.over_minima_words,
        *(plain(v) for v in (p.start, p.minimum, p.maximum)),
        "",
        p.flag,
    ]


def merit_lines(result: "FitResult") -> list[str]:
    """Figures of merit, each with its reference; m measured, s predicted."""
    m, deviation, lines = result.merit, result.deviation, list[str]()
    if m.chi_square is not None:
        line = f"chi-square {m.chi_square:.5g} with {m.degrees_of_freedom} degrees of freedom"
        if m.reduced_chi_square is not None:
            line += f" (reduced {m.reduced_chi_square:.3f}, p = {m.probability:.3g})"
        lines.append(line)
    lines += [
        f"absolute RMSD of pi f: {m.rmsd_absolute_pi:.4g} = {m.rmsd_absolute_pi_percent:.3g} % of the "
        "largest measured pi f",
        f"absolute RMSD of f cos(theta_o): {m.rmsd_absolute_intensity:.4g} /sr = "
        f"{m.rmsd_absolute_intensity_percent:.3g} % of the largest measured f cos(theta_o)",
    ]
    if m.rmsd_relative is None or m.rmsd_logarithmic is None:
        lines.append("relative and logarithmic RMSD: undefined, because some values are not positive")
        return lines
    return [
        *lines,
        f"relative RMSD: {percent(m.rmsd_relative)} of (m + s)/2 at each point",
        f"logarithmic RMSD: {percent(m.rmsd_logarithmic)} of (ln m + ln s)/2 at each point",
        f"rms of m/s - 1: {percent(deviation and deviation.rms)} of the predicted value at each point",
    ]


def worst_scans(result: "FitResult") -> Table:
    """Misfit by scan; of many wavelengths those that are fitted worst."""
    waves, shown = used_wavelengths(result.data), fit_wavelengths(result)
    table = scan_table(result, shown)
    some = f", at the {len(shown)} worst of {len(waves)} wavelengths" if len(shown) < len(waves) else ""
    return card_table(dataclasses.replace(table, title=f"{table.title}{some}"))


def card_table(table: CardTable) -> Table:
    """A table as a notebook shows it, with its heads in short lines and without empty columns."""
    made = plain_table(table.title)
    shown = [i for i in range(len(table.heads)) if any(row[i] for row in table.rows)]
    for i in shown:
        longest = max(map(cell_len, [*(row[i] for row in table.rows), *table.heads[i].split()]))
        # Names of parameters are long.
        parts = re.sub(r"\.(?=[a-z_]{2})", ".\n", table.heads[i]).split("\n")
        width = max(longest, _HEAD_WIDTH)
        lines = [line for part in parts for line in textwrap.wrap(part, width, break_on_hyphens=False)]
        is_text = i in table.text_columns
        add_column(made, "\n".join(lines), is_text, wraps=is_text)
    for row in table.rows:
        made.add_row(*(row[i] for i in shown))
    return made


def show_files(to: Console, files: Iterable[Path]) -> None:
    """Print the files that were written."""
    show_lines(to, "Written", [str(file) for file in files])


def show_lines(to: Console, title: str, lines: Iterable[str]) -> None:
    """Print lines below a title; nothing without lines."""
    lines = list(lines)
    if not lines:
        return
    if title:
        to.print(title, style="bold")
    for line in lines:
        to.print(f"  {line}" if title else line, soft_wrap=True)
    to.print()


def plain_table(title: str) -> Table:
    """An empty table with a rule below its header."""
    from rich.box import SIMPLE_HEAD

    return Table(
        title=title or None,
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )


def add_column(table: Table, head: str, is_text: bool, wraps: bool = False) -> None:
    """Add a column; on a narrow terminal those of words wrap, and no number is cut."""
    justify: JustifyMethod = "left" if is_text else "right"
    width = None if wraps else max(map(cell_len, head.split("\n")))
    table.add_column(head, justify=justify, no_wrap=not wraps, overflow="fold", min_width=width)
