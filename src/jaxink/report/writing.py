"""Write the report of a diagnosis: JSON, HTML and figures."""

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from jaxink.diagnosis import Diagnosis
from jaxink.display.html import paragraph, table
from jaxink.files.netcdf import netcdf_bytes
from jaxink.files.result_folder import PAGE_FILE
from jaxink.files.writing import whole_folder
from jaxink.ink import InkTable, TableComparison
from jaxink.numerics.digits import with_uncertainty
from jaxink.numerics.failures import Failures
from jaxink.plots import FIGURE_FOLDER, Page, overview_words, pictures
from jaxink.report import html, sections
from jaxink.report.fit_html import OVERVIEW, SPECTRUM
from jaxink.report.hidden import HiddenChange, hidden_changes
from jaxink.report.html import Section, chance, number, section, share, tables
from jaxink.report.ink_table import inside_change
from jaxink.report.layer_sketch import layer_sketch
from jaxink.report.suggestions import next_steps

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis
    from jaxink.residual import ModeShare


_LOG = logging.getLogger("jaxink")
INSIDE_FILES = ("inside_declared.nc", "inside_corrected.nc")
# Replaced as a whole, or removed: they would belong to an older diagnosis.
_SHOWN = (FIGURE_FOLDER, *INSIDE_FILES, PAGE_FILE)
# With more, the table of parameters is a detail.
_MOST_PARAMETERS = 15
OWNED = (*_SHOWN, *Diagnosis.owned)
_MODES = (
    "Amplitude: relative deviation of the measurement from the model where both directions graze. Modes: "
    "products of Zernike polynomials of the sines of both polar angles with the cosine of a multiple of phi "
    "(Legendre polynomials of the signed sines in the plane of incidence), symmetric in both directions in "
    "reflection. Δχ²: decrease when the mode was added to those above it."
)
_SYMMETRY = (
    "What no isotropic, reciprocal sample has: smooth differences between residuals at directions at which "
    "the model is equal (p: F test against the scatter of the other differences)."
)
_OVERLAPS = (
    "Overlap: cosine between the change that an effect causes and the modes above, both without what the "
    "free parameters reproduce; 1 if the effect has this shape."
)
_PAIRS = {"mirror": "+phi and -phi", "reciprocal": "source and detector exchanged"}


def write_report(
    diagnosis: "Diagnosis",
    folder: str | Path,
    with_figures: bool = True,
    inputs: Sequence[str] = (),
    change: TableComparison | str | None = None,
    failures: Failures | None = None,
    sample_file: str = "",
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
        See `next_steps`.
    change
        What `inside_change` returns, if it is known already.
    failures
        Takes note of figures, and tables of the ink, that fail; None: they are logged. The page names them.
    sample_file
        See `next_steps`.

    Raises
    ------
    InputRefusedError
        If the answer cannot be written.
    """
    if failures is None:
        failures = Failures()
        files = write_report(diagnosis, folder, with_figures, inputs, change, failures, sample_file)
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
    text = _page(
        diagnosis, change, hidden, embedded, next_steps(diagnosis, folder, inputs, sample_file), failures
    )
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
    from jaxink.plots import diagnosis_figures, overview_figure

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
        sections.masked(diagnosis.declared.data),
        sections.origin(diagnosis),
    )
    top = [
        sections.top(diagnosis, failures.found),
        layer_sketch(diagnosis.corrected.sample),
        html.commands((step.words, step.command) for step in todo),
    ]
    return html.document(sections.report_title(diagnosis), "".join(top), shown, details)


def shape(diagnosis: "Diagnosis") -> Section | None:
    """Smooth modes of the remaining residual, and the overlap of other effects with them."""
    found = diagnosis.shape
    if found is None:
        return None
    parts = list[str]()
    if found.modes:
        heads = ["side", "order in incidence", "order in view", "azimuth", "Δχ²", "amplitude(s.e.)"]
        parts += [table(heads, map(_mode_cells, found.modes), (0, 3)), paragraph(_MODES)]
    heads = ["modes up to order", "amplitudes", "χ² carried", "share of the excess over noise"]
    excess = max(found.excess, 1e-300)
    orders = (
        [str(o.order), str(o.amplitudes), number(o.chi_square), share((o.chi_square - o.amplitudes) / excess)]
        for o in found.orders
    )
    parts.append(table(heads, orders, ()))
    heads = ["side", "incidence", "wavelength", "points", "χ²", "χ² without the modes", "rms of the modes"]
    scans = (
        [s.side, f"{s.theta_i_deg:g}°", f"{s.wavelength_nm:g} nm", str(s.points), number(s.chi_square)]
        + [number(s.chi_square_left), share(s.relative_rms)]
        for s in found.scans
    )
    parts.append(tables(heads, scans))
    if found.asymmetries:
        heads = ["difference between", "pairs", "modes", "χ² carried", "p", "rms of a reading"]
        broken = (
            [_PAIRS[a.kind], str(a.pairs), str(a.modes), number(a.chi_square), chance(a.p_value)]
            + [share(a.relative_rms)]
            for a in found.asymmetries
        )
        parts += [paragraph(_SYMMETRY), table(heads, broken)]
    if diagnosis.overlaps:
        heads = ["effect that was not added", "overlap"]
        overlaps = ([name, f"{value:+.2f}"] for name, value in diagnosis.overlaps.items())
        parts += [paragraph(_OVERLAPS), tables(heads, overlaps)]
    return section("Shape of the remaining residual", *parts)


def _mode_cells(found: "ModeShare") -> list[str]:
    mode = found.mode
    azimuth = "in plane" if mode.azimuthal_order is None else f"cos {mode.azimuthal_order} phi"
    each = zip(found.wavelength_nm, found.amplitude, found.standard_error, strict=True)
    amplitudes = [(nm, with_uncertainty(float(a), float(error))) for nm, a, error in each]
    words = "; ".join(f"{nm:g} nm: {text}" for nm, text in amplitudes)
    if len(amplitudes) == 1:
        words = amplitudes[0][1]
    return [mode.side, str(mode.n), str(mode.m), azimuth, number(found.chi_square), words]
