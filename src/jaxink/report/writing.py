"""Write the report of a diagnosis: JSON, HTML and figures."""

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path

from jaxink.diagnosis.findings.diagnosis import Diagnosis
from jaxink.files.netcdf import netcdf_bytes
from jaxink.files.result_folder import PAGE_FILE
from jaxink.files.writing import whole_folder
from jaxink.ink.comparison import TableComparison
from jaxink.ink.table import InkTable
from jaxink.numerics.failures import Failures
from jaxink.plots import FIGURE_FOLDER
from jaxink.plots.pictures import Page, pictures
from jaxink.plots.scan_views import overview_words
from jaxink.report import html, sections
from jaxink.report.fit_page import OVERVIEW, SPECTRUM
from jaxink.report.hidden import HiddenChange, hidden_changes
from jaxink.report.ink_table import inside_change
from jaxink.report.layer_sketch import layer_sketch
from jaxink.report.next_steps import next_steps
from jaxink.report.shape import shape

_LOG = logging.getLogger("jaxink")
INSIDE_FILES = ("inside_declared.nc", "inside_corrected.nc")
# Replaced as a whole, or removed: they would belong to an older diagnosis.
_SHOWN = (FIGURE_FOLDER, *INSIDE_FILES, PAGE_FILE)
# With more, the table of parameters is a detail.
_MOST_PARAMETERS = 15
OWNED = (*_SHOWN, *Diagnosis.owned)


def write_report(
    diagnosis: "Diagnosis",
    folder: str | Path,
    with_figures: bool = True,
    inputs: Sequence[str] = (),
    change: TableComparison | str | None = None,
    failures: Failures | None = None,
) -> list[Path]:
    """Write the answer, all of it or nothing; then the page with its figures and the ink's BSDF.

    The answer is in place before anything is drawn, and stays whatever fails then.

    These are ``report.json`` and ``report.html``; ``sample.toml``, the sample file of the corrected model;
    the results of both fits in the folders ``declared`` and ``corrected``; the ink's BSDF inside the plate by
    both models, if effects were found, as ``inside_declared.nc`` and ``inside_corrected.nc``; and the folder
    ``figures``.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    folder
        Created if it does not exist; figures of an older report are removed, other files stay.
    with_figures
        Whether to draw figures.
    inputs
        As of `next_steps`.
    change
        What `inside_change` returns, if it is known already.
    failures
        Takes note of figures, and tables of the ink, that fail; None: they are logged. The page names them.

    Raises
    ------
    InputRefusedError
        If the answer cannot be written.
    """
    if failures is None:
        failures = Failures()
        files = write_report(diagnosis, folder, with_figures, inputs, change, failures)
        for failure in failures.found:
            _LOG.warning("%s", failure.sentence)
        return files
    with whole_folder(folder, owned=OWNED) as part:
        diagnosis.write_into(part)
        files = _files_in(part)
    if change is None:
        change = "The ink's BSDF inside the plate is missing, see above."
        with failures.sparing("the tabulation of the ink's BSDF inside the plate", ""):
            change = inside_change(diagnosis)
    tables = None if isinstance(change, str) else change
    inside = {} if tables is None else dict(zip(INSIDE_FILES, (tables.before, tables.after), strict=True))
    captions = dict[str, str]()
    drawn = pictures(_pages(diagnosis, tables, captions), failures) if with_figures else {}
    embedded = {
        name: html.figure(drawn[f"{name}.png"], words)
        for name, words in captions.items()
        if f"{name}.png" in drawn
    }
    drawn.pop(f"{OVERVIEW}.png", None)
    hidden: list[HiddenChange] | str = []
    with failures.sparing("what hidden effects would do to the ink's BSDF inside the plate", ""):
        hidden = hidden_changes(diagnosis)
    text = _page(diagnosis, change, hidden, embedded, next_steps(diagnosis, folder, inputs), failures)
    with failures.sparing("the writing of the page and its figures", ""):
        files += _write_shown(folder, text, drawn, inside)
    return [Path(folder) / name for name in sorted(files)]


def _write_shown(
    folder: str | Path, text: str, drawn: dict[str, bytes], inside: dict[str, InkTable]
) -> list[Path]:
    """Write the page, its figures and the ink's BSDF, all or none, beside the answer."""
    with whole_folder(folder, owned=_SHOWN) as part:
        for name, table in inside.items():
            (part / name).write_bytes(netcdf_bytes(table.to_dataset()))
        (part / PAGE_FILE).write_text(text, encoding="utf-8")
        if drawn:
            (part / FIGURE_FOLDER).mkdir()
        for name, picture in drawn.items():
            (part / FIGURE_FOLDER / name).write_bytes(picture)
        files = _files_in(part)
    return files


def _files_in(folder: Path) -> list[Path]:
    return [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]


def _pages(diagnosis: Diagnosis, tables: TableComparison | None, captions: dict[str, str]) -> Iterator[Page]:
    """The figures, whose captions are put down in passing."""
    from jaxink.plots.diagnosis_pages import diagnosis_figures
    from jaxink.plots.overview import overview_figure

    which = "The corrected model. " if diagnosis.steps else ""
    captions[OVERVIEW] = f"{which}{overview_words(diagnosis.corrected)}"
    yield OVERVIEW, lambda: overview_figure(diagnosis.corrected)
    for one in diagnosis_figures(diagnosis, tables):
        captions[one.name] = one.caption
        yield one.name, one.draw


def _page(diagnosis, change, hidden, embedded, todo, failures) -> str:
    """At most four printed pages, then details: one picture of each kind comes before them."""

    def drawn(*stems: str) -> dict[str, str]:
        return {name: shown for name, shown in embedded.items() if name.startswith(stems)}

    def present(*parts: html.Section | None) -> list[html.Section]:
        return [part for part in parts if part is not None]

    residuals = drawn("residual", "cuts")
    first = [*drawn(OVERVIEW, SPECTRUM).values(), *list(drawn("residuals", "residual_discs").values())[:1]]
    others = [shown for shown in residuals.values() if shown not in first]
    parameters = sections.parameters(diagnosis)
    is_long = len(diagnosis.parameters_after) > _MOST_PARAMETERS
    shown = present(
        sections.added(diagnosis),
        sections.merit(diagnosis),
        None if is_long else parameters,
        sections.remains(diagnosis),
        sections.hidden(hidden),
        html.section("Measurement, model and residuals", *first) if first else None,
    )
    details = present(
        sections.steps(diagnosis),
        parameters if is_long else None,
        html.section("Residuals and scans", *others) if others else None,
        sections.tests(diagnosis),
        shape(diagnosis),
        sections.inside(diagnosis, change, *drawn("inside").values()),
        sections.candidates(diagnosis, *drawn("candidates").values()),
        sections.masked(diagnosis),
        sections.origin(diagnosis),
    )
    top = [
        sections.top(diagnosis, failures.found),
        layer_sketch(diagnosis.corrected.sample),
        html.commands((step.words, step.command) for step in todo),
    ]
    return html.document(sections.report_title(diagnosis), "".join(top), shown, details)
