"""Tables of a fit result for the terminal."""

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.cells import cell_len
from rich.console import Console, JustifyMethod
from rich.table import Table

from jaxink.fitting import OVER_MINIMA, rejected, rejection
from jaxink.numerics.digits import interval, percent, plain, relative_error, rounded, with_uncertainty
from jaxink.plots import MOST_WAVELENGTHS, fit_wavelengths, used_wavelengths

if TYPE_CHECKING:
    from jaxink.fitting import FitResult, FittedParameter, JointResult, Minima, SearchSummary
    from jaxink.report import NextStep

# ASCII if the terminal cannot show more.
MOST_MISTAKES = 3
DELTA_CHI_SQUARE = "Δχ²" if (sys.stdout.encoding or "").lower().startswith("utf") else "delta chi2"
# Larger correlations are listed.
NAMED_CORRELATION = 0.9
# The strongest are listed.
MOST_CORRELATIONS = 10
_WIDTH_WITHOUT_TERMINAL = 120
_QUANTITIES = {
    "scattering_per_mm": ("scattering mu_s", "1/mm"),
    "absorption_per_mm": ("absorption mu_a", "1/mm"),
    "asymmetry_parameter": ("asymmetry g", ""),
    "reduced_scattering_per_mm": ("reduced scattering mu_s' = mu_s (1 - g)", "1/mm"),
    "reduced_optical_thickness": ("reduced optical thickness mu_s (1 - g) d", ""),
}
# Heads of columns, of a table with one row for each wavelength.
_COLUMNS = {
    "scattering_per_mm": "mu_s\n[1/mm]",
    "absorption_per_mm": "mu_a\n[1/mm]",
    "asymmetry_parameter": "g",
    "reduced_scattering_per_mm": "mu_s (1 - g)\n[1/mm]",
    "reduced_optical_thickness": "mu_s\n(1 - g) d",
}


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
    to.print(parameter_table(tuple(result.parameters.values()), result.verdict.standard_errors_hold))
    show_lines(to, "", parameter_notes(result))
    if result.derived:
        to.print(derived_table(result))
    show_lines(to, "Figures of merit (m measured, s predicted)", merit_lines(result))
    to.print(scan_table(result))
    show_lines(to, "", _correlation_lines(result))
    if result.residual_shape is not None:
        show_lines(to, "Shape of the residual", [result.residual_shape.sentence])
    show_lines(to, "Noise", [result.noise_sentence])
    show_lines(to, "Searches", search_lines(result))
    if result.minima is not None and result.minima.is_told:
        to.print(minima_table(result.minima))
        show_lines(to, "", [result.minima.sentence])
    show_lines(to, "Notes", result.notes)
    show_lines(to, "Mistakes in the input", mistake_lines(result))
    show_files(to, files)
    show_lines(to, "Next", [line for step in todo for line in step.lines()])


def show_verdict(to: Console, result: "FitResult") -> None:
    """Print the verdict on the fit, as the first line."""
    verdict = result.verdict
    style = "bold red" if verdict.code.needs_warning else "bold"
    to.print(verdict.sentence, style=style, soft_wrap=True)


def show_outcome(to: Console, result: "FitResult") -> None:
    """Print what was fitted, and whether the fit converged."""
    from jaxink.measurement import mask_sentences, wavelength_words

    data = result.data
    spectrum = wavelength_words(sorted(set(data.wavelength_nm.tolist())))
    scans = len(result.scans)
    to.print(
        f"{data.source or 'measurement'}: {int(data.used.sum())} of {len(data)} points used, {scans} "
        f"scan{'s' * (scans != 1)}, {spectrum}"
    )
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
        _value_head(errors_hold),
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


def _value_head(errors_hold: bool) -> str:
    return "value(s.e.)" if errors_hold else "value(meaningless s.e.)"


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


def parameter_notes(result: "FitResult | JointResult") -> list[str]:
    """Sentences below the parameter table."""
    lines = []
    for p in result.parameters.values():
        if p.interval is not None:
            low, high = p.interval
            open_end = {"open below": " (open below)", "open above": " (open above)"}.get(p.flag, "")
            lines.append(
                f"{p.name}: {interval(low, high)}{open_end} by profile likelihood "
                f"({DELTA_CHI_SQUARE} < 1, all other parameters refitted)."
            )
    if any(p.over_minima for p in result.parameters.values()):
        lines.append(OVER_MINIMA)
    if any(p.flag == "not determined" for p in result.parameters.values()):
        lines.append("not determined: the data do not constrain the parameter within its range.")
    if any(p.standard_error is not None for p in result.parameters.values()):
        lines.append("s.e.: standard error in units of the last digits, 1.234(5) = 1.234 +- 0.005.")
        if not result.verdict.standard_errors_hold:
            lines.append(
                "These standard errors are meaningless: they assume that the model fits, and it does not."
            )
    return lines


def derived_table(result: "FitResult") -> Table:
    """Scattering and absorption of each layer at each wavelength; one row for each if they are many."""
    if len(used_wavelengths(result.data)) > MOST_WAVELENGTHS:
        return _derived_by_wavelength(result)
    table = plain_table("Derived optical properties")
    for head in ("layer", "nm", "quantity"):
        add_column(table, head, is_text=True, wraps=head != "nm")
    head = _value_head(result.verdict.standard_errors_hold)
    table.add_column(head, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for d in result.derived:
        text, unit = _QUANTITIES.get(d.quantity, (d.quantity, ""))
        value = with_uncertainty(d.value, d.standard_error)
        table.add_row(d.layer, f"{d.wavelength_nm:g}", text, value, unit)
    return table


def _derived_by_wavelength(result: "FitResult") -> Table:
    errors_hold = result.verdict.standard_errors_hold
    table = plain_table("Derived optical properties" + ("" if errors_hold else " (s.e. are meaningless)"))
    rows: dict[tuple[str, float], dict[str, str]] = {}
    for d in result.derived:
        value = with_uncertainty(d.value, d.standard_error)
        rows.setdefault((d.layer, d.wavelength_nm), {})[d.quantity] = value
    shown = [quantity for quantity in _COLUMNS if any(quantity in row for row in rows.values())]
    add_column(table, "layer", is_text=True, wraps=True)
    add_column(table, "nm", is_text=False)
    for quantity in shown:
        add_column(table, _COLUMNS[quantity], is_text=False)
    for (layer, wavelength_nm), row in rows.items():
        table.add_row(layer, f"{wavelength_nm:g}", *(row.get(quantity, "") for quantity in shown))
    return table


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


def scan_table(result: "FitResult") -> Table:
    """Misfit by scan; of many wavelengths those that are fitted worst."""
    known = result.merit.chi_square is not None
    waves, shown = used_wavelengths(result.data), fit_wavelengths(result)
    some = f", at the {len(shown)} worst of {len(waves)} wavelengths" if len(shown) < len(waves) else ""
    table = plain_table(f"Misfit by scan{some}")
    heads = ["side", "nm", "theta_i", "points"]
    heads += ["chi-\nsquare", "per\npoint"] if known else []
    for head in (*heads, "rms of\nm/s - 1", "mean\nm/s - 1"):
        add_column(table, head, head == "side")
    for s in result.scans:
        if s.wavelength_nm not in shown:
            continue
        one = result.deviation_of(s)
        row = [s.side, f"{s.wavelength_nm:g}", f"{s.theta_i_deg:g}", str(s.points)]
        if s.chi_square is not None:
            row += [f"{s.chi_square:.1f}", f"{s.chi_square / s.points:.2f}"]
        table.add_row(*row, percent(one and one.rms, ".2f"), percent(one and one.mean, "+.2f"))
    return table


def _correlation_lines(result: "FitResult") -> list[str]:
    names, matrix = result.correlation_names, result.correlations
    strong = [
        (float(matrix[i, j]), names[i], names[j])
        for i in range(len(names))
        for j in range(i)
        if abs(matrix[i, j]) > NAMED_CORRELATION
    ]
    strong.sort(key=lambda entry: -abs(entry[0]))
    if not names:
        return []
    if not strong:
        return [f"No correlation exceeds {NAMED_CORRELATION:g}."]
    listed = [f"  {b} - {a}: {value:+.3f}" for value, a, b in strong[:MOST_CORRELATIONS]]
    rest = len(strong) - len(listed)
    return [f"Correlations above {NAMED_CORRELATION:g}:", *listed, *([f"  and {rest} more"] if rest else [])]


def mistake_lines(result: "FitResult") -> list[str]:
    """Mistakes that the data name, with what to do; without any, the nearest of those that are rejected."""
    before = result.verdict.reduced_chi_square
    named = [mistake.sentence(before) for mistake in result.mistakes if mistake.is_named]
    tried = rejected(result.mistakes)
    if named or not tried:
        return named
    words = rejection(result.mistakes, before, is_misfit=result.verdict.is_misfit)
    shown, rest = tried[:MOST_MISTAKES], len(tried) - MOST_MISTAKES
    return [
        f"Tried and rejected: {words}",
        *(
            f"  {one.supposition}: reduced chi-square {rounded(one.reduced_chi_square, 4)} after"
            for one in shown
        ),
        *([f"  and {rest} more, see result.json"] if rest > 0 else []),
    ]


def search_lines(result: "FitResult") -> list[str]:
    """Effort of each search."""
    lines, several = [], sum(s.is_single for s in result.searches) > 1
    for i, s in enumerate(result.searches):
        start = f"start {i + 1}, " if several and s.is_single else ""
        lines.append(
            f"{start}{s.method}: {s.jacobians} Jacobians, {s.evaluations} evaluations, misfit "
            f"{s.loss_start:.5g} -> {s.loss:.6g}; {_seconds(s)}"
        )
    if len(result.searches) > 1:
        jacobians = sum(s.jacobians for s in result.searches)
        evaluations = sum(s.evaluations for s in result.searches)
        lines.append(f"in all: {jacobians} Jacobians, {evaluations} evaluations; {_seconds(result)}")
    return lines


def minima_table(minima: "Minima") -> Table:
    """The lowest minima that were found."""
    rows = minima.table()
    table = plain_table(rows.title)
    for i, head in enumerate(rows.heads):
        # Names of parameters are long.
        add_column(table, head.replace(".", ".\n").replace(" this", "\nthis"), i in rows.text_columns)
    for row in rows.rows:
        table.add_row(*row)
    return table


def _seconds(effort: "FitResult | SearchSummary") -> str:
    return f"compilation {effort.compile_seconds:.2f} s, run time {effort.run_seconds:.2f} s"


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
