"""Write the report of a diagnosis: JSON, HTML and figures."""

from pathlib import Path
from typing import TYPE_CHECKING

from jaxink.diagnosis.findings.diagnosis import REPORT_FILE
from jaxink.files.writing import whole_folder
from jaxink.plots import FIGURE_FOLDER
from jaxink.plots.diagnosis_figures import diagnosis_figures
from jaxink.report import html, sections
from jaxink.report.ink_table import inside_change

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis

REPORT_PAGE = "report.html"


def write_report(diagnosis: "Diagnosis", folder: str | Path, with_figures: bool = True) -> list[Path]:
    """Write ``report.json``, ``report.html`` and the folder ``figures``; all of them or none.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    folder
        Created if it does not exist; figures of an older report are removed, other files stay.
    with_figures
        Whether to draw figures.

    Raises
    ------
    InputRefusedError
        If the folder cannot be written.
    """
    change = inside_change(diagnosis)
    tables = None if isinstance(change, str) else change
    pictures, embedded = {}, {}
    for drawn in diagnosis_figures(diagnosis, tables) if with_figures else ():
        pictures[drawn.name] = drawn.figure.png()
        embedded[drawn.name] = html.figure(pictures[drawn.name], drawn.caption)
    text = _page(diagnosis, change, embedded)
    with whole_folder(folder, owned=(FIGURE_FOLDER,)) as part:
        diagnosis.write_into(part)
        (part / REPORT_PAGE).write_text(text, encoding="utf-8")
        if pictures:
            (part / FIGURE_FOLDER).mkdir()
        for name, picture in pictures.items():
            (part / FIGURE_FOLDER / f"{name}.png").write_bytes(picture)
    files = [Path(FIGURE_FOLDER, f"{name}.png") for name in pictures]
    return [Path(folder) / file for file in (Path(REPORT_FILE), *files, Path(REPORT_PAGE))]


def _page(diagnosis, change, embedded) -> str:
    def drawn(*stems: str) -> list[str]:
        return [shown for name, shown in embedded.items() if name.startswith(stems)]

    residuals = drawn("residual", "cuts")
    return html.document(
        sections.report_title(diagnosis),
        sections.top(diagnosis),
        sections.merit(diagnosis),
        sections.steps(diagnosis),
        sections.parameters(diagnosis),
        html.section("Residuals", *residuals) if residuals else "",
        sections.remains(diagnosis),
        sections.inside(diagnosis, change, *drawn("inside")),
        sections.candidates(diagnosis, *drawn("candidates")),
        sections.origin(diagnosis),
    )
