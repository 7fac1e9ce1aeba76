"""Write a report: for a program, for a reader, and its figures."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from jaxink.errors import InputRefusedError
from jaxink.files import written_whole
from jaxink.plots.diagnosis import Plate, diagnosis_figures
from jaxink.plots.sheet import DPI
from jaxink.report import page, sections
from jaxink.report.inside import inside_change

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis

FIGURES = "figures"
REPORT_PAGE = "report.html"


def write_report(
    diagnosis: "Diagnosis",
    folder: str | Path,
    with_figures: bool = True,
) -> list[Path]:
    """Write ``report.json``, ``report.html`` and ``figures``, each file whole or not at all.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    folder
        Made if it does not exist.
    with_figures
        Whether any are drawn.

    Returns
    -------
    list[Path]
        The files.

    Raises
    ------
    InputRefusedError
        The folder cannot be written.
    """
    folder = Path(folder)
    files = [diagnosis.save(folder)]
    change = inside_change(diagnosis)
    tables = None if isinstance(change, str) else change
    pictures, embedded = {}, {}
    for plate in diagnosis_figures(diagnosis, tables) if with_figures else ():
        pictures[plate.name] = _png(plate)
        embedded[plate.name] = page.figure(pictures[plate.name], plate.caption)
    text = _page(diagnosis, change, embedded)
    try:
        for name, picture in pictures.items():
            files.append(_write(folder / FIGURES / f"{name}.png", picture))
        files.append(_write(folder / REPORT_PAGE, text.encode("utf-8")))
    except OSError as problem:
        raise InputRefusedError(
            f"{folder}: the report cannot be written there ({problem.strerror or problem}); choose another "
            "folder."
        ) from None
    return files


def _page(diagnosis, change, embedded) -> str:
    def drawn(*stems: str) -> list[str]:
        return [html for name, html in embedded.items() if name.startswith(stems)]

    residuals = drawn("residual", "cuts")
    return page.document(
        sections.report_title(diagnosis),
        sections.top(diagnosis),
        sections.merit(diagnosis),
        sections.steps(diagnosis),
        sections.parameters(diagnosis),
        page.section("Residuals", *residuals) if residuals else "",
        sections.remains(diagnosis),
        sections.inside(diagnosis, change, *drawn("inside")),
        sections.candidates(diagnosis, *drawn("candidates")),
        sections.origin(diagnosis),
    )


def _png(plate: Plate) -> bytes:
    stream = BytesIO()
    plate.figure.savefig(stream, format="png", dpi=DPI)
    return stream.getvalue()


def _write(path: Path, content: bytes) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(path) as part:
        part.write_bytes(content)
    return path
