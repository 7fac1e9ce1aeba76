"""Write the page of a fit and its figures."""

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from jaxink.files.result_folder import PAGE_FILE
from jaxink.files.writing import whole_folder
from jaxink.numerics.failures import Failures
from jaxink.plots import FIGURE_FOLDER, Page, fit_pages, pictures
from jaxink.report.fit_html import OVERVIEW, fit_page
from jaxink.report.suggestions import fit_next_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from jaxink.fitting import FitResult

_LOG = logging.getLogger("jaxink")
_PNG = ".png"


def write_fit_page(
    result: "FitResult",
    folder: str | Path,
    formats: Sequence[str] = ("png",),
    inputs: Sequence[str] = (),
    sample_file: str = "",
    wavelengths_nm: Sequence[float] | None = None,
    failures: Failures | None = None,
) -> list[Path]:
    """Write ``report.html``, one page without links to other files, and the folder ``figures``.

    Parameters
    ----------
    result
        The fit.
    folder
        Created if it does not exist; a page and figures of an older fit are removed, other files stay.
    formats
        Of the figures: any of ``png``, ``pdf`` and ``svg``; empty: neither figures nor a picture.
    inputs
        Words of a command for the measurement, as in `next_steps`.
    sample_file
        The sample file of the fit, for the commands on the page; empty: that of the result.
    wavelengths_nm
        Whose scans are drawn, as in `jaxink.plots.figures`.
    failures
        Takes note of figures that fail; None: they are logged. The page names them.

    Returns
    -------
    list
        Paths of the files.
    """
    if failures is None:
        failures = Failures()
        files = write_fit_page(result, folder, formats, inputs, sample_file, wavelengths_nm, failures)
        for failure in failures.found:
            _LOG.warning("%s", failure.sentence)
        return files
    drawn, picture = fit_drawings(result, formats, wavelengths_nm, failures)
    todo = fit_next_steps(result, folder, inputs, sample_file)
    text = fit_page(result, picture, todo, failures.found)
    files = list[Path]()
    with failures.sparing("the writing of the page and its figures", ""):
        with whole_folder(folder, owned=(FIGURE_FOLDER, PAGE_FILE)) as part:
            (part / PAGE_FILE).write_text(text, encoding="utf-8")
            if drawn:
                (part / FIGURE_FOLDER).mkdir()
            for name, content in drawn.items():
                (part / FIGURE_FOLDER / name).write_bytes(content)
        files = [Path(folder) / PAGE_FILE, *(Path(folder) / FIGURE_FOLDER / name for name in drawn)]
    return sorted(files)


def fit_drawings(
    result: "FitResult",
    formats: Sequence[str],
    wavelengths_nm: Sequence[float] | None,
    failures: Failures,
) -> tuple[dict[str, bytes], dict[str, bytes]]:
    """Files of the figures by their names, and the figures of the page without suffix."""
    if not formats:
        return {}, {}
    wanted = tuple(dict.fromkeys(("png", *formats)))
    found = pictures(_pages(result, wavelengths_nm), failures, wanted)
    picture = {name.removesuffix(_PNG): png for name, png in found.items() if name.endswith(_PNG)}
    kept = {
        name: content
        for name, content in found.items()
        if Path(name).stem != OVERVIEW and Path(name).suffix[1:] in formats
    }
    return kept, picture


def _pages(result: "FitResult", wavelengths_nm: Sequence[float] | None) -> Iterator[Page]:
    def overview() -> "Figure":
        from jaxink.plots import overview_figure

        return overview_figure(result)

    yield OVERVIEW, overview
    yield from fit_pages(result, wavelengths_nm)
