"""The report of a batch: its page, its summary, and which measurements are far from the others."""

import csv
from collections.abc import Iterable
from contextlib import suppress
from html import escape
from statistics import NormalDist
from typing import Any

import numpy as np

from jaxink.batches.result import REPORT_PAGE, SUMMARY_CSV, SUMMARY_PARQUET, Batch
from jaxink.batches.row import Row, RowOutcome, RowParameter
from jaxink.batches.verdicts import standard_errors_hold, verdict_meaning, what_to_do
from jaxink.display.html import paragraph, table
from jaxink.files.spreadsheet import cell
from jaxink.files.writing import written_whole
from jaxink.numerics.digits import with_uncertainty
from jaxink.numerics.failures import Failures
from jaxink.report import html

_MOST_ROWS = 5000
# Behind a standard error that does not hold.
_MARK = "*"


_MARKED = (
    f"{_MARK} The standard error is meaningless: it assumes a model that fits, in a minimum, and this is a "
    "misfit or has not converged."
)
# Iglewicz and Hoaglin 1993, How to detect and handle outliers: the modified z-score and its limit.
_LIMIT = 3.5
_NORMAL = 1.4826
_FEWEST = 5
# Probability that noise alone brings any of the measurements as far as this from the median (Bonferroni).
_LEVEL = 0.05


def report_page(batch: Batch) -> str:
    """HTML: outcomes and verdicts counted, trends, maps, outliers, trouble, and a table of all with links."""
    far = outlying(batch.rows)
    parts = [
        _counts(batch),
        *_figures(batch, far),
        _outliers(batch, far),
        _trouble(batch),
        _misfits(batch),
        _absent(batch),
        _all(batch),
    ]
    top = "".join(paragraph(line) for line in batch.card().sentences)
    return html.document(batch.title, top, [part for part in parts if part is not None])


def _counts(batch: Batch) -> html.Section:
    outcomes = [
        [code.replace("_", " "), str(n), RowOutcome[code.upper()].meaning]
        for code, n in batch.outcomes.most_common()
    ]
    verdicts = [
        [code.replace("_", " "), str(n), verdict_meaning(code)] for code, n in batch.verdicts.most_common()
    ]
    effects: dict[str, int] = {}
    for row in batch:
        for effect in row.effects:
            effects[effect] = effects.get(effect, 0) + 1
    parts = [table(["outcome", "measurements", "meaning"], outcomes, (0, 2))]
    parts.append(table(["verdict", "measurements", "meaning"], verdicts, (0, 2)))
    if effects:
        counted = [[name, str(n)] for name, n in sorted(effects.items(), key=lambda one: -one[1])]
        parts.append(table(["effect that a diagnosis has added", "measurements"], counted))
    return html.section("Outcomes and verdicts", *parts)


def _figures(batch: Batch, far: dict[str, set[str]]) -> list[html.Section]:
    if not any(row.parameters for row in batch):
        return []
    words = (
        "Each point is a measurement, in the order of the plan, with its standard error; the line is the "
        "median. Filled red: an outlier; open: the fit misses the noise or has not converged, so that its "
        "standard error means little."
    )
    failures, trends, maps = Failures(), list[str](), list[str]()
    with failures.sparing("the drawing of figures", ""):
        from jaxink.batches.figures import map_figures, trend_figures

        for caption, figure in trend_figures(batch, far):
            trends.append(html.figure(figure.png(), caption))
        for caption, figure in map_figures(batch):
            maps.append(html.figure(figure.png(), caption))
    trends += [html.bullets(failure.sentence for failure in failures.found)] if failures.found else []
    sections = [html.section("Trends over the run", paragraph(words), *trends)]
    return [*sections, html.section("Maps", *maps)] if maps else sections


def _outliers(batch: Batch, far: dict[str, set[str]]) -> html.Section | None:
    rows = [
        [
            row.name,
            p.name,
            f"{_value(p, row)} {p.unit}".strip(),
            row.verdict or "",
        ]
        for row in batch
        for p in row.parameters
        if p.value is not None and row.name in far.get(p.name, ())
    ]
    words = (
        "Further from the median than 3.5 robust standard deviations (1.4826 times the median absolute "
        "deviation; Iglewicz and Hoaglin 1993), and than noise with its own standard error brings any of so "
        "many measurements with a probability of 5 %. A drift over the run widens the first scale."
    )
    if not rows:
        return html.section("Outliers", paragraph("None. " + words))
    shown = html.tables(["measurement", "parameter", "value(s.e.)", "verdict"], rows, (0, 1, 3))
    marked = [paragraph(_MARKED)] if any(_MARK in row[2] for row in rows) else []
    return html.section("Outliers", shown, *marked, paragraph(words))


def _trouble(batch: Batch) -> html.Section | None:
    if not batch.trouble:
        return None
    rows = [[row.name, row.outcome.replace("_", " "), row.sentence] for row in batch.trouble]
    return html.section(
        "Without a result", html.tables(["measurement", "outcome", "sentence"], rows, (0, 1, 2))
    )


def _misfits(batch: Batch) -> html.Section | None:
    if not batch.misfits:
        return None
    rows = [[row.name, (row.verdict or "").replace("_", " "), row.sentence] for row in batch.misfits]
    sentences, command = what_to_do(batch.misfits[0], str(batch.folder), batch.reading)
    todo = paragraph(" ".join(sentences)) + (f"<pre>{escape(command)}</pre>\n" if command else "")
    shown = html.tables(["measurement", "verdict", "sentence"], rows, (0, 1, 2))
    return html.section("Misfits", shown, todo)


def _absent(batch: Batch) -> html.Section | None:
    if not batch.absent:
        return None
    rows = [[name, sentence] for name, sentence in batch.absent.items()]
    return html.section(
        "Input missing or refused now", html.tables(["measurement", "sentence"], rows, (0, 1))
    )


def _all(batch: Batch) -> html.Section:
    heads = ["measurement", "outcome", "verdict", "reduced χ²", *batch.parameters, "effects", "s"]
    rows = (_linked(row, batch.parameters) for row in batch.rows[:_MOST_ROWS])
    head = "".join(f'<th class="text">{escape(text)}</th>' for text in heads)
    body = f"<table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{''.join(rows)}</tbody>\n</table>\n"
    left = len(batch) - _MOST_ROWS
    rest = [paragraph(f"{left} more are in {SUMMARY_CSV}.")] if left > 0 else []
    if any(row.parameters and not standard_errors_hold(row) for row in batch.rows[:_MOST_ROWS]):
        rest.append(paragraph(_MARKED))
    return html.section("All measurements", body, *rest)


def _linked(row: Row, parameters: Iterable[str]) -> str:
    name = (
        f'<a href="{escape(row.page, quote=True)}">{escape(row.name)}</a>' if row.page else escape(row.name)
    )
    found = {p.name: p for p in row.parameters}
    values = [_value(found.get(name), row) for name in parameters]
    texts = [row.outcome.replace("_", " "), (row.verdict or "").replace("_", " ")]
    texts += [html.number(row.reduced_chi_square), *values, ", ".join(row.effects), f"{row.seconds:.3g}"]
    cells = "".join(f'<td class="text">{escape(text)}</td>' for text in texts)
    return f'<tr><td class="text">{name}</td>{cells}</tr>\n'


def _value(parameter: RowParameter | None, row: Row) -> str:
    """Value and standard error, marked if the latter does not hold."""
    if parameter is None or parameter.value is None:
        return ""
    mark = "" if parameter.standard_error is None or standard_errors_hold(row) else _MARK
    return with_uncertainty(parameter.value, parameter.standard_error) + mark


def outlying(rows: Iterable[Row]) -> dict[str, set[str]]:
    """Names of the rows that are far from the median, by parameter; those without a minimum do not count.

    Far is a distance beyond the scatter of the others, and beyond what the standard error of the value itself
    allows among so many; one that does not hold allows nothing.
    """
    found: dict[str, dict[str, tuple[float, float]]] = {}
    for row in rows:
        for p in row.parameters:
            if p.value is not None and row.outcome == "done":
                error = (p.standard_error or 0.0) if standard_errors_hold(row) else 0.0
                found.setdefault(p.name, {})[row.name] = p.value, error
    return {name: _far(values) for name, values in found.items()}


def errors_allowed(n: int) -> float:
    """Distance in standard errors that noise alone exceeds in any of ``n`` values in 5 % of cases."""
    return NormalDist().inv_cdf(1 - _LEVEL / (2 * n))


def _far(found: dict[str, tuple[float, float]]) -> set[str]:
    if len(found) < _FEWEST:
        return set()
    numbers, errors = np.array(list(found.values())).T
    apart = np.abs(numbers - np.median(numbers))
    scale = _NORMAL * np.median(apart)
    # With a scale of 0, more than half are equal, and every other one is apart from them.
    least = np.maximum(_LIMIT * scale, errors_allowed(len(found)) * errors)
    return {name for name, distance, most in zip(found, apart, least, strict=True) if distance > most}


def write_batch(batch: Batch) -> None:
    """Write ``summary.csv``, ``summary.parquet`` if pandas and pyarrow are installed, and ``report.html``.

    Raises
    ------
    InputRefusedError
        If one of them cannot be written.
    """
    columns = batch.columns()
    with (
        written_whole(batch.folder / SUMMARY_CSV) as part,
        open(part, "w", encoding="utf-8", newline="") as file,
    ):
        table = csv.writer(file)
        table.writerow(map(cell, columns))
        table.writerows(map(_cells, zip(*columns.values(), strict=True)))
    (batch.folder / SUMMARY_PARQUET).unlink(missing_ok=True)
    with suppress(ImportError):
        import pyarrow  # noqa: F401

        frame = batch.to_frame()
        with written_whole(batch.folder / SUMMARY_PARQUET) as part:
            frame.to_parquet(part)
    with written_whole(batch.folder / REPORT_PAGE) as part:
        part.write_text(report_page(batch), encoding="utf-8")


def _cells(values: tuple[Any, ...]) -> list[Any]:
    return ["" if v is None else repr(v) if isinstance(v, float) else cell(v) for v in values]
