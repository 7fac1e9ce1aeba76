"""Figures of a diagnosis: residuals and scans of both models, candidates, and the ink's BSDF."""

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from jaxink.numerics.digits import rounded
from jaxink.plots.cuts import BEFORE, FITTED, ResidualRow, cut_page
from jaxink.plots.discs import DiscLayout, draw_discs
from jaxink.plots.figure import PageFigure, Style, blank_figure, set_angle_axis
from jaxink.plots.scan_views import (
    FROM_INSIDE,
    MOST_WAVELENGTHS,
    SIDES,
    ScanView,
    drawn_wavelengths,
    headed,
    in_sigma,
    residual_label,
    residual_limit,
    residual_words,
    used_wavelengths,
    views_of,
    wavelength_words,
)
from jaxink.plots.shape_page import shape_page
from jaxink.plots.spectra import spectrum_figure
from jaxink.plots.strips import StripLayout, draw_strips

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from jaxink.diagnosis import CandidateRow, Diagnosis, Summary
    from jaxink.ink import TableComparison


# Residuals after a correction are also drawn on their own scale if it is finer by this factor.
_FINER = 1.5
MOST_BARS = 12
PREDICTED: Style = {"color": "0.72"}
REFITTED: Style = {"color": "#c22f2f"}
# Smaller decreases do not count: noise gives 1 to any additional parameter.
_LEAST = 1.0
_BAR, _ROW = 0.36, 0.36
_LEFT, _RIGHT, _TOP, _BOTTOM = 1.9, 0.9, 0.6, 0.8
# In the plate; beyond the critical angle light is guided.
INCIDENCES_DEG = (0.0, 30.0, 50.0, 70.0)
_VIEW_DEG = np.linspace(-85.0, 85.0, 171)


@dataclasses.dataclass(frozen=True, eq=False)
class CaptionedFigure:
    """A figure with its caption and the name of its file, without suffix; drawn on first use."""

    name: str
    caption: str
    draw: Callable[[], PageFigure] = dataclasses.field(repr=False)

    @cached_property
    def figure(self) -> PageFigure:
        """The figure."""
        return self.draw()

    def _repr_png_(self) -> bytes:
        return self.figure.png()


def diagnosis_figures(
    diagnosis: "Diagnosis", change: "TableComparison | None" = None
) -> Iterator[CaptionedFigure]:
    """All figures of a diagnosis.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    change
        Tables of the ink by both models, at the wavelengths of `drawn_wavelengths`; None draws none.

    Yields
    ------
    CaptionedFigure
        ``residuals_550nm`` for data in the plane of incidence, ``residual_discs_R_550nm`` for data out of
        it, ``residual_shape_R_550nm`` if structure remains, ``cuts_R_550nm``, ``candidates`` and
        ``inside_550nm``; ``spectrum`` for more than three wavelengths.
    """
    if len(used_wavelengths(diagnosis.declared.data)) > MOST_WAVELENGTHS:
        yield _spectrum(diagnosis)
    for wavelength_nm in drawn_wavelengths(diagnosis):
        pages = _Pages(diagnosis, wavelength_nm)
        yield from pages.residuals()
        yield from pages.shapes()
        yield from pages.cuts()
    if diagnosis.candidates:
        yield _candidates(diagnosis)
    if change is not None:
        yield from _inside(diagnosis, change)


class _Pages:
    """Pages of one wavelength."""

    def __init__(self, diagnosis: "Diagnosis", wavelength_nm: float):
        self.diagnosis, self.wavelength_nm = diagnosis, wavelength_nm
        has_steps = bool(diagnosis.steps)
        self.states = ("declared", "corrected") if has_steps else ("declared",)
        summaries = (diagnosis.before, diagnosis.after) if has_steps else (diagnosis.before,)
        views = {side: [self._views(summary, side) for summary in summaries] for side in SIDES}
        self.views = {side: states for side, states in views.items() if states[0]}

    def _views(self, summary: "Summary", side: str) -> list[ScanView]:
        declared, predicted = self.diagnosis.declared, summary.predicted_per_sr
        residual = in_sigma(declared.data, predicted, declared.sigma_per_sr)
        views = views_of(declared.data, predicted, residual, self.wavelength_nm, side)
        return [view for view in views if view.used.any()]

    def _limit(self, sides, in_plane: bool, first: int = 0) -> float:
        """Half-width of the scale of the residuals, from one of the states on."""
        views = [view for side in sides for state in self.views[side][first:] for view in state]
        return residual_limit(views, in_plane)

    def _own_limit(self, sides, in_plane: bool) -> float | None:
        """That of the residuals after the correction alone; None if it is hardly smaller."""
        own = self._limit(sides, in_plane, -1)
        return own if self._limit(sides, in_plane) > _FINER * own else None

    @property
    def _residual_words(self) -> str:
        return residual_words(self.diagnosis.declared)

    def _title(self, what: str) -> str:
        return _title(self.diagnosis, f"{what} at {self.wavelength_nm:g} nm")

    def _caption(self, text: str) -> str:
        return " ".join([text, *_spectrum_words(self.diagnosis), *_once_words(self.diagnosis)])

    def residuals(self) -> Iterator[CaptionedFigure]:
        """Strips for sides with in-plane data only, discs for the others; after a correction also alone."""
        flat = [s for s, states in self.views.items() if all(np.all(v.in_plane[v.used]) for v in states[0])]
        everything = range(len(self.states))
        if flat:
            yield self._strips(flat, everything, self._limit(flat, True))
            own = self._own_limit(flat, True)
            if own is not None:
                yield self._strips(flat, everything[-1:], own)
        for side in (s for s in self.views if s not in flat):
            yield self._discs(side, everything, self._limit([side], False))
            own = self._own_limit([side], False)
            if own is not None:
                yield self._discs(side, everything[-1:], own)

    def _strips(self, sides: list[str], shown: Sequence[int], limit: float) -> CaptionedFigure:
        rows = [[(f"{SIDES[s]}, {self.states[i]}", self.views[s][i]) for i in shown] for s in sides]
        layout = StripLayout(tuple(len(row[0][1]) for row in rows), len(shown))
        label = residual_label(self.diagnosis.declared)
        draw = _on_page(layout.size, draw_strips, rows, self._title("residuals"), limit, label)
        text = f"Residuals{self._of(shown)}: {self._residual_words}"
        name = f"residuals{self._tag(shown)}_{self.wavelength_nm:g}nm"
        return CaptionedFigure(name, self._caption(text), draw)

    def _discs(self, side: str, shown: Sequence[int], limit: float) -> CaptionedFigure:
        views = [scan[i] for scan in zip(*self.views[side], strict=True) for i in shown]
        title, label = self._title(f"residuals in {SIDES[side]}"), residual_label(self.diagnosis.declared)
        states = tuple(self.states[i] for i in shown)
        draw = _on_page(
            DiscLayout(len(views), len(states)).size, draw_discs, views, title, limit, label, states
        )
        text = (
            f"Residuals{self._of(shown)} in {SIDES[side]} over all viewing directions: {self._residual_words}"
        )
        name = f"residual_discs{self._tag(shown)}_{side}_{self.wavelength_nm:g}nm"
        return CaptionedFigure(name, self._caption(text), draw)

    def shapes(self) -> Iterator[CaptionedFigure]:
        """The remaining relative residual of each side, and the part of it that smooth modes carry."""
        diagnosis, shape = self.diagnosis, self.diagnosis.shape
        if shape is None or not shape.modes:
            return
        for side in self.views:
            title = self._title(f"shape of the residual in {SIDES[side]}")
            predicted = diagnosis.after.predicted_per_sr
            data = diagnosis.declared.data
            draw = partial(shape_page, data, predicted, shape, self.wavelength_nm, side, title)
            text = (
                f"Relative residual that remains in {SIDES[side]}, and the part of it that the modes of the "
                "table below carry."
            )
            name = f"residual_shape_{side}_{self.wavelength_nm:g}nm"
            yield CaptionedFigure(name, self._caption(text), draw)

    def _is_part(self, shown: Sequence[int]) -> bool:
        return len(shown) < len(self.states)

    def _of(self, shown: Sequence[int]) -> str:
        return " of the corrected model, on their own scale" if self._is_part(shown) else ""

    def _tag(self, shown: Sequence[int]) -> str:
        return "_after" if self._is_part(shown) else ""

    def cuts(self) -> Iterator[CaptionedFigure]:
        """In-plane scans of each side, on one residual scale, and after a correction also on its own."""
        cut = [side for side, states in self.views.items() if any(view.has_cut for view in states[0])]
        for side in cut:
            limit, own = self._limit(cut, True), self._own_limit(cut, True)
            rows = [ResidualRow(f"{state} [σ]", i, limit) for i, state in enumerate(self.states)]
            if own is not None:
                rows.append(ResidualRow("corrected, enlarged", len(self.states) - 1, own))
            title = self._title(f"in-plane scans in {SIDES[side]}")
            draw = partial(cut_page, self.views[side], rows, title)
            text = (
                f"Measured and modelled BSDF in {SIDES[side]}; a triangle marks a residual beyond the edge. "
                f"Below: {self._residual_words}"
            )
            if own is not None:
                text += " The last row shows the residuals of the corrected model on their own scale."
            yield CaptionedFigure(f"cuts_{side}_{self.wavelength_nm:g}nm", self._caption(text), draw)


def _spectrum(diagnosis: "Diagnosis") -> CaptionedFigure:
    fits = {"declared": diagnosis.declared}
    if diagnosis.steps:
        fits = {"corrected": diagnosis.corrected, **fits}
    text = (
        "Optical properties and other free parameters against the wavelength, with standard errors where "
        "they hold, and the misfit at each wavelength."
    )
    return CaptionedFigure("spectrum", text, partial(spectrum_figure, fits))


def _candidates(diagnosis: "Diagnosis") -> CaptionedFigure:
    rows = diagnosis.candidates[:MOST_BARS]
    added = [step.effect for step in diagnosis.steps]
    title = _title(diagnosis, "candidate effects")
    draw = _on_page(candidates_size(len(rows)), draw_candidates, rows, added, title)
    text = (
        f"Decrease in chi-square by each of the {len(rows)} leading of {len(diagnosis.candidates)} effects "
        "alone, predicted by the first screen and, if there was a refit, obtained by it."
    )
    return CaptionedFigure("candidates", text, draw)


def _inside(diagnosis: "Diagnosis", change: "TableComparison") -> Iterator[CaptionedFigure]:
    for i, wavelength_nm in enumerate(change.before.wavelength_nm):
        title = _title(diagnosis, f"the ink's BSDF inside the plate at {wavelength_nm:g} nm")
        draw = _on_page(InsideLayout().size, draw_inside, change, i, title)
        index = float(change.before.index_inside[i])
        text = (
            f"BSDF of the ink alone for light from inside the plate (index {index:g}), in the plane of "
            "incidence, by the declared and by the corrected model."
        )
        caption = " ".join([text, *_spectrum_words(diagnosis)])
        yield CaptionedFigure(f"inside_{wavelength_nm:g}nm", caption, draw)


def _on_page(
    size_inch: tuple[float, float], fill: Callable[..., None], *content: Any
) -> Callable[[], PageFigure]:
    def draw() -> PageFigure:
        with blank_figure(*size_inch) as page:
            fill(page, *content)
        return page

    return draw


def _title(diagnosis: "Diagnosis", what: str) -> str:
    declared, corrected = (
        rounded(summary.fitted.reduced_chi_square, 4, "undefined")
        for summary in (diagnosis.before, diagnosis.after)
    )
    line = f"reduced χ² {declared} declared"
    if diagnosis.steps:
        line += f", {corrected} corrected by {', '.join(step.effect for step in diagnosis.steps)}"
    return f"{headed(diagnosis.declared, what)}\n{line}"


def _once_words(diagnosis: "Diagnosis") -> list[str]:
    return [] if diagnosis.steps else ["No effect was added."]


def _spectrum_words(diagnosis: "Diagnosis") -> list[str]:
    words = wavelength_words(diagnosis.declared.data)
    return [words] if words else []


def candidates_size(n_rows: int) -> tuple[float, float]:
    """Width and height of the page in inches."""
    return 8.2, _TOP + _ROW * max(n_rows, 2) + _BOTTOM


def draw_candidates(
    figure: PageFigure, rows: Sequence["CandidateRow"], added: Sequence[str], title: str
) -> None:
    """Draw two bars for each candidate on a logarithmic axis; names of those in ``added`` are bold.

    The figure must have the size given by `candidates_size`.
    """
    width, height = candidates_size(len(rows))
    figure.write_title(title)
    axes = figure.panel(_LEFT, _BOTTOM, width - _LEFT - _RIGHT, height - _TOP - _BOTTOM)
    axes.set_xscale("log")
    largest = 10 * _LEAST
    for i, row in enumerate(rows):
        predicted, refitted = row.predicted_delta_chi_square, row.refit_delta_chi_square
        _draw_bar(axes, i - _BAR / 2, predicted, PREDICTED)
        _draw_bar(axes, i + _BAR / 2, refitted, REFITTED)
        largest = max(largest, predicted, refitted or 0)
    axes.set_xlim(_LEAST, largest * 2)
    axes.set_ylim(len(rows) - 0.4, -0.6)
    axes.set_yticks(range(len(rows)), [row.effect for row in rows])
    axes.yaxis.set_minor_locator(NullLocator())
    axes.tick_params(labelsize=8)
    for label, row in zip(axes.get_yticklabels(), rows, strict=True):
        label.set_fontweight("bold" if row.effect in added else "normal")
    axes.grid(True, axis="x", color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("Δχ² (decrease)", fontsize=9)
    _draw_legend(figure, any(row.effect in added for row in rows))


def _draw_bar(axes: Axes, y: float, drop: float | None, style: Style) -> None:
    if drop is None:
        return
    axes.barh(y, max(drop - _LEAST, 0), _BAR, left=_LEAST, **style, zorder=2)
    text = f"below {_LEAST:g}" if drop < _LEAST else f"{drop:.3g}" if drop < 100 else f"{drop:.0f}"
    axes.annotate(text, (max(drop, _LEAST), y), (3, 0), textcoords="offset points", va="center", fontsize=7)


def _draw_legend(figure: PageFigure, has_added: bool) -> None:
    handles = [Patch(**PREDICTED, label="predicted by the screen"), Patch(**REFITTED, label="by refit")]
    if has_added:
        handles.append(Patch(color="none", label="bold: added to the model"))
    figure.draw_legend(handles)


@dataclasses.dataclass(frozen=True)
class InsideLayout:
    """Positions of the panels in inches: for each component a row of curves and a row of changes."""

    _left, _right, _top, _bottom = 0.8, 0.2, 0.5, 0.6
    _panel, _beside, _above, _between, _below = 2.3, 0.55, 0.3, 0.13, 0.3
    _curve, _change = 1.75, 1.1

    @property
    def _block(self) -> float:
        return self._above + self._curve + self._between + self._change + self._below

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the page."""
        n = len(INCIDENCES_DEG)
        width = self._left + n * self._panel + (n - 1) * self._beside + self._right
        return width, self._top + len(FROM_INSIDE) * self._block + self._bottom

    def axes(self, figure: PageFigure, row: int, column: int, title: str) -> "tuple[Axes, Axes]":
        """Curves and change of one component at one incidence."""
        x = self._left + column * (self._panel + self._beside)
        y = self.size[1] - self._top - row * self._block - self._above
        figure.write_panel_title(title, x + self._panel / 2, y, 9.5)
        below = y - self._curve - self._between - self._change
        above = figure.panel(x, y - self._curve, self._panel, self._curve)
        return above, figure.panel(x, below, self._panel, self._change)


def draw_inside(figure: PageFigure, change: "TableComparison", wavelength: int, title: str) -> None:
    """Draw the in-plane BSDF of both tables at a wavelength, given by its index, and the change below.

    The figure must have the size given by `InsideLayout`.
    """
    layout = InsideLayout()
    figure.write_title(title)
    view, phi = np.abs(_VIEW_DEG), np.where(_VIEW_DEG < 0, 0.0, 180.0)
    for row, (component, where) in enumerate(FROM_INSIDE.items()):
        curves = [change.at(component, theta, view, phi, wavelength) for theta in INCIDENCES_DEG]
        relative = [_change_percent(before, after) for before, after in curves]
        limit = _limit(relative)
        for column, theta in enumerate(INCIDENCES_DEG):
            above, below = layout.axes(figure, row, column, f"{theta:g}° inside, {where}")
            for values, style in zip(curves[column], (BEFORE, FITTED), strict=True):
                above.plot(_VIEW_DEG, values, **style)
            above.set_ylim(0, 1.08 * max(float(np.max(values)) for values in curves[column]) or 1.0)
            below.axhline(0, color=BEFORE["color"], linewidth=1.0)
            below.plot(_VIEW_DEG, relative[column], **FITTED)
            below.set_ylim(-limit, limit)
            set_angle_axis(above, False)
            set_angle_axis(below, True)
            if column == 0:
                above.set_ylabel(f"{component} [1/sr]", fontsize=9)
                below.set_ylabel("change [%]", fontsize=9)
    figure.write_below("exit angle in the medium of the exit side [°], negative towards the source", 0.54)
    figure.draw_line_legend([("declared", BEFORE), ("corrected", FITTED)])


def _change_percent(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return 100 * np.where(before > 0, after / before - 1, np.nan)


def _limit(relative: list[np.ndarray]) -> float:
    """Half-width of the common axis of all incidences."""
    sizes = np.abs(np.concatenate(relative))
    sizes = sizes[np.isfinite(sizes)]
    return 1.1 * max(float(sizes.max()), 1e-3) if sizes.size else 1.0
