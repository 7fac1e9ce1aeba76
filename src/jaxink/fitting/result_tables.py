"""What a fit says, as tables and sentences: the terminal and the page show the same."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from jaxink.display.brief import counted
from jaxink.display.card import CardTable
from jaxink.fitting.derived import OPTICAL_PROPERTIES
from jaxink.fitting.fitted_parameters import value_head
from jaxink.fitting.minima import OVER_MINIMA
from jaxink.fitting.mistake import Mistake, rejected
from jaxink.measurement import wavelength_words
from jaxink.numerics.digits import interval, percent, plain, rounded, with_uncertainty

if TYPE_CHECKING:
    from jaxink.fitting.joint_result import JointResult
    from jaxink.fitting.result import FitResult, SearchSummary
    from jaxink.measurement import GonioData

# Larger correlations are listed.
STRONG_CORRELATION = 0.9
# With more, derived quantities stand beside each other, one row for each wavelength.
_MOST_WAVELENGTHS = 3


def points_words(data: "GonioData") -> str:
    """How many points of which measurement were used."""
    waves = np.unique(data.wavelength_nm[data.used]).tolist()
    scans = counted(sum(scan.used > 0 for scan in data.scans), "scan")
    used = f"{int(data.used.sum())} of {len(data)} points used, {scans}, {wavelength_words(waves)}"
    return f"{data.source or 'measurement'}: {used}"


def parameter_notes(result: "FitResult | JointResult") -> list[str]:
    """Sentences below the parameter table."""
    lines, parameters = [], result.parameters.values()
    for p in parameters:
        if p.interval is not None:
            open_end = f" ({p.flag})" if p.flag.startswith("open ") else ""
            lines.append(
                f"{p.name}: {interval(*p.interval)}{open_end} by profile likelihood (chi-square higher by "
                "less than 1, all other parameters refitted)."
            )
    if any(p.over_minima for p in parameters):
        lines.append(OVER_MINIMA)
    if any(p.flag == "not determined" for p in parameters):
        lines.append("not determined: the data do not constrain the parameter within its range.")
    if any(p.standard_error is not None for p in parameters):
        lines.append("s.e.: standard error in units of the last digits, 1.234(5) = 1.234 +- 0.005.")
        if not result.verdict.standard_errors_hold:
            lines.append(
                "These standard errors are meaningless: they assume that the model fits, and it does not."
            )
    return lines


def derived_table(result: "FitResult") -> CardTable:
    """Optical properties of each layer at each wavelength; one row for each wavelength if they are many."""
    title, head = "Optical properties of the layers", value_head(result.verdict.standard_errors_hold)
    if len({d.wavelength_nm for d in result.derived}) > _MOST_WAVELENGTHS:
        return _derived_by_wavelength(result, f"{title}, {head}")
    rows = []
    for d in result.derived:
        value, words = with_uncertainty(d.value, d.standard_error), d.optical_property
        rows.append([d.layer, f"{d.wavelength_nm:g}", words.words, value, words.unit])
    return CardTable(["layer", "nm", "quantity", head, "unit"], rows, (0, 2, 4), title)


def _derived_by_wavelength(result: "FitResult", title: str) -> CardTable:
    values: dict[tuple[str, float], dict[str, str]] = {}
    for d in result.derived:
        of_row = values.setdefault((d.layer, d.wavelength_nm), {})
        of_row[d.quantity] = with_uncertainty(d.value, d.standard_error)
    shown = {key: p for key, p in OPTICAL_PROPERTIES.items() if any(key in row for row in values.values())}
    heads = [f"{p.symbol}, {p.unit}" if p.unit else p.symbol for p in shown.values()]
    rows = [
        [layer, f"{nm:g}", *(of_row.get(key, "") for key in shown)] for (layer, nm), of_row in values.items()
    ]
    return CardTable(["layer", "nm", *heads], rows, title=title)


def scan_table(result: "FitResult", wavelengths_nm: Sequence[float] | None = None) -> CardTable:
    """Misfit by scan, of all wavelengths or of these."""
    heads = ["side", "nm", "incidence in degrees", "points", "chi-square", "chi-square per point"]
    heads += ["rms of measured / model - 1", "mean of measured / model - 1"]
    rows = []
    for s in result.scans:
        if wavelengths_nm is not None and s.wavelength_nm not in wavelengths_nm:
            continue
        square = (
            ["", ""] if s.chi_square is None else [f"{s.chi_square:.1f}", f"{s.chi_square / s.points:.2f}"]
        )
        one = result.deviation_of(s)
        deviation = percent(one and one.rms, ".2f"), percent(one and one.mean, "+.2f")
        rows.append(
            [s.side, f"{s.wavelength_nm:g}", f"{s.theta_i_deg:g}", str(s.points), *square, *deviation]
        )
    return CardTable(heads, rows, title="Misfit by scan")


def correlation_lines(result: "FitResult", most: int | None = None) -> list[str]:
    """Pairs of free parameters whose correlation is strong, at most so many, the strongest first."""
    names, matrix = result.correlation_names, result.correlations
    pairs = [(float(matrix[i, j]), names[j], names[i]) for i in range(len(names)) for j in range(i)]
    strong = sorted((p for p in pairs if abs(p[0]) > STRONG_CORRELATION), key=lambda pair: -abs(pair[0]))
    if not names:
        return []
    lines = [f"{one} and {other}: {value:+.3f}" for value, one, other in strong[:most]]
    rest = len(strong) - len(lines)
    others = "other " if strong else ""
    return [
        *lines,
        *([f"and {rest} more"] if rest else []),
        f"No {others}correlation exceeds {STRONG_CORRELATION:g}.",
    ]


def named_lines(result: "FitResult") -> list[str]:
    """Mistakes that the data name, each with what to do."""
    before = result.verdict.reduced_chi_square
    return [mistake.sentence(before) for mistake in result.mistakes if mistake.is_named]


def rejected_table(mistakes: Sequence[Mistake]) -> CardTable:
    """Mistakes that were tried and rejected."""
    rows = [[one.supposition, rounded(one.reduced_chi_square, 4)] for one in rejected(mistakes)]
    return CardTable(["mistake", "reduced chi-square after"], rows, title="Tried and rejected")


def search_table(searches: Sequence["SearchSummary"]) -> CardTable:
    """Effort of each search, and of all."""
    heads = ["search", "outcome", "Jacobians", "evaluations", "initial misfit", "final misfit", "run time"]
    several, rows = sum(s.is_single for s in searches) > 1, []
    for i, s in enumerate(searches):
        start = f", start {i + 1}" if several and s.is_single else ""
        ends = [rounded(s.loss_start, 4), plain(s.loss)]
        rows.append([f"{s.method}{start}", s.outcome, *_counts([s]), *ends, f"{s.run_seconds:.2f} s"])
    if len(searches) > 1:
        seconds = sum(s.run_seconds for s in searches)
        rows.append(["in all", "", *_counts(searches), "", "", f"{seconds:.2f} s"])
    return CardTable(heads, rows, (0, 1), "Searches")


def compilation_sentence(result: "FitResult") -> str:
    """How long the searches waited for compilation."""
    return f"Compilation before these searches took {result.compile_seconds:.2f} s."


def _counts(searches: Iterable["SearchSummary"]) -> list[str]:
    return [str(sum(getattr(s, name) for s in searches)) for name in ("jacobians", "evaluations")]
