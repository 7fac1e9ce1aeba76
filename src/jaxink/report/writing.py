"""Write the report of a diagnosis: JSON, HTML and figures."""

from collections.abc import Sequence
from pathlib import Path

from jaxink.diagnosis.findings.diagnosis import Diagnosis
from jaxink.files.netcdf import netcdf_bytes
from jaxink.files.writing import whole_folder
from jaxink.ink.comparison import TableComparison
from jaxink.plots import FIGURE_FOLDER
from jaxink.plots.diagnosis_pages import diagnosis_figures
from jaxink.report import html, sections
from jaxink.report.ink_table import inside_change
from jaxink.report.next_steps import next_steps
from jaxink.report.shape import shape

REPORT_PAGE = "report.html"
INSIDE_FILES = ("inside_declared.nc", "inside_corrected.nc")
# Replaced as a whole, or removed: they would belong to an older diagnosis.
OWNED = (FIGURE_FOLDER, *Diagnosis.owned, *INSIDE_FILES)


def write_report(
    diagnosis: "Diagnosis",
    folder: str | Path,
    with_figures: bool = True,
    inputs: Sequence[str] = (),
    change: TableComparison | str | None = None,
) -> list[Path]:
    """Write the report, the corrected model and the figures; all of them or none.

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

    Raises
    ------
    InputRefusedError
        If the folder cannot be written.
    """
    change = inside_change(diagnosis) if change is None else change
    tables = None if isinstance(change, str) else change
    inside = {} if tables is None else dict(zip(INSIDE_FILES, (tables.before, tables.after), strict=True))
    pictures, embedded = {}, {}
    for drawn in diagnosis_figures(diagnosis, tables) if with_figures else ():
        pictures[drawn.name] = drawn.figure.png()
        embedded[drawn.name] = html.figure(pictures[drawn.name], drawn.caption)
    text = _page(diagnosis, change, embedded, next_steps(diagnosis, folder, inputs))
    with whole_folder(folder, owned=OWNED) as part:
        diagnosis.write_into(part)
        for name, table in inside.items():
            (part / name).write_bytes(netcdf_bytes(table.to_dataset()))
        (part / REPORT_PAGE).write_text(text, encoding="utf-8")
        if pictures:
            (part / FIGURE_FOLDER).mkdir()
        for name, picture in pictures.items():
            (part / FIGURE_FOLDER / f"{name}.png").write_bytes(picture)
        return [Path(folder) / p.relative_to(part) for p in sorted(part.rglob("*")) if p.is_file()]


def _page(diagnosis, change, embedded, todo) -> str:
    def drawn(*stems: str) -> list[str]:
        return [shown for name, shown in embedded.items() if name.startswith(stems)]

    residuals = drawn("residual", "cuts")
    parts = (
        sections.merit(diagnosis),
        sections.steps(diagnosis),
        sections.parameters(diagnosis),
        html.section("Residuals", *residuals) if residuals else None,
        sections.remains(diagnosis),
        shape(diagnosis),
        sections.inside(diagnosis, change, *drawn("inside")),
        sections.candidates(diagnosis, *drawn("candidates")),
        sections.origin(diagnosis),
    )
    shown = [part for part in parts if part is not None]
    top = sections.top(diagnosis) + html.commands((step.words, step.command) for step in todo)
    return html.document(sections.report_title(diagnosis), top, shown)
