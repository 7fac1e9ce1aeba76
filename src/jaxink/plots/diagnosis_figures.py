"""Figures of a diagnosis: residuals and cuts before and after, candidates, and what it changes in the ink."""

import dataclasses
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from jaxink.plots.candidates import MOST_BARS, candidates_size, draw_candidates
from jaxink.plots.cuts import CutLayout, draw_cuts
from jaxink.plots.discs import DiscLayout, draw_discs
from jaxink.plots.figure import PageFigure, blank_figure
from jaxink.plots.ink_table import InsideLayout, draw_inside
from jaxink.plots.scan_views import (
    SIDES,
    ScanView,
    measurement_name,
    residual_label,
    residual_limit,
    views_of,
)
from jaxink.plots.strips import StripLayout, draw_strips

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis, Summary
    from jaxink.ink.comparison import TableComparison

# Beyond as many, a report would be a catalogue of pages.
MOST_WAVELENGTHS = 3


@dataclasses.dataclass(frozen=True, eq=False)
class CaptionedFigure:
    """A figure with what is to be said of it.

    Parameters
    ----------
    name
        Of its file, without suffix.
    caption
        One or two sentences.
    figure
        The figure.
    """

    name: str
    caption: str
    figure: PageFigure


def drawn_wavelengths(diagnosis: "Diagnosis") -> tuple[float, ...]:
    """Wavelengths that are drawn: all, or those where the declared model fails most.

    Parameters
    ----------
    diagnosis
        The diagnosis.

    Returns
    -------
    tuple[float, ...]
        Ascending, at most `MOST_WAVELENGTHS`.
    """
    data = diagnosis.result.data
    of_point = data.wavelength_nm[data.used]
    wavelengths = np.unique(of_point)
    misfit = [np.mean(diagnosis.before.whitened[of_point == w] ** 2) for w in wavelengths]
    worst = np.argsort(misfit)[::-1][:MOST_WAVELENGTHS]
    return tuple(sorted(wavelengths[worst].tolist()))


def diagnosis_figures(
    diagnosis: "Diagnosis", change: "TableComparison | None" = None
) -> Iterator[CaptionedFigure]:
    """All figures of a diagnosis, drawn one after the other.

    Parameters
    ----------
    diagnosis
        The diagnosis.
    change
        Tables of the ink before and after, at the wavelengths of `drawn_wavelengths`; None draws none.

    Yields
    ------
    CaptionedFigure
        ``residuals_550nm`` where data lie in the plane of incidence, ``residual_discs_R_550nm`` where they
        leave it, ``cuts_R_550nm``, ``candidates``, ``inside_550nm``. Where nothing was added, what would be
        drawn twice is drawn once.
    """
    for wavelength_nm in drawn_wavelengths(diagnosis):
        pages = _Pages(diagnosis, wavelength_nm)
        yield from pages.residuals()
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
        self.states = ("before", "after") if has_steps else ("as declared",)
        summaries = (diagnosis.before, diagnosis.after) if has_steps else (diagnosis.before,)
        views = {side: [self._views(summary, side) for summary in summaries] for side in SIDES}
        self.views = {side: states for side, states in views.items() if states[0]}

    def _views(self, summary: "Summary", side: str) -> list[ScanView]:
        data = self.diagnosis.result.data
        views = views_of(data, summary.predicted_per_sr, summary.whitened, self.wavelength_nm, side)
        return [view for view in views if view.used.any()]

    def _limit(self, sides, in_plane: bool) -> float:
        views = [view for side in sides for state in self.views[side] for view in state]
        return residual_limit(views, in_plane)

    def _title(self, what: str) -> str:
        return _title(self.diagnosis, f"{what} at {self.wavelength_nm:g} nm")

    def _caption(self, text: str) -> str:
        return " ".join([text, *_spectrum_words(self.diagnosis), *_once_words(self.diagnosis)])

    def residuals(self) -> Iterator[CaptionedFigure]:
        """Strips of the sides whose points lie in the plane, discs of the others."""
        flat = [s for s, states in self.views.items() if all(np.all(v.in_plane[v.used]) for v in states[0])]
        if flat:
            yield self._strips(flat)
        for side in (s for s in self.views if s not in flat):
            yield self._discs(side)

    def _strips(self, sides: list[str]) -> CaptionedFigure:
        rows = [
            [(f"{SIDES[s]}, {name}", views) for name, views in zip(self.states, self.views[s], strict=True)]
            for s in sides
        ]
        layout = StripLayout(tuple(len(row[0][1]) for row in rows), len(self.states))
        limit, label = self._limit(sides, True), residual_label(self.diagnosis.result)
        with blank_figure(*layout.size) as page:
            draw_strips(page, rows, self._title("residuals"), limit, label)
        text = "Residuals, measured minus model in standard deviations of the noise, on one colour scale."
        return CaptionedFigure(f"residuals_{self.wavelength_nm:g}nm", self._caption(text), page)

    def _discs(self, side: str) -> CaptionedFigure:
        views = [view for scan in zip(*self.views[side], strict=True) for view in scan]
        limit, label = self._limit([side], False), residual_label(self.diagnosis.result)
        title = self._title(f"residuals in {SIDES[side]}")
        with blank_figure(*DiscLayout(len(views), len(self.states)).size) as page:
            draw_discs(page, views, title, limit, label, self.states)
        text = f"Residuals in {SIDES[side]} over all directions of view, on one colour scale."
        return CaptionedFigure(f"residual_discs_{side}_{self.wavelength_nm:g}nm", self._caption(text), page)

    def cuts(self) -> Iterator[CaptionedFigure]:
        """Cuts of each side, all on one residual scale."""
        cut = [side for side, states in self.views.items() if any(view.has_cut for view in states[0])]
        for side in cut:
            first, *later = self.views[side]
            limit = self._limit(cut, True)
            labels = tuple(f"{state} [σ]" for state in self.states)
            title = self._title(f"{SIDES[side]} in the plane of incidence")
            with blank_figure(*CutLayout(len(first), len(self.states)).size) as page:
                draw_cuts(page, first, title, limit, labels, later[0] if later else None)
            text = (
                f"Measured and modelled BSDF in {SIDES[side]}, below it the residuals in standard deviations "
                "of the noise; a triangle at the edge stands for one beyond it."
            )
            yield CaptionedFigure(f"cuts_{side}_{self.wavelength_nm:g}nm", self._caption(text), page)


def _candidates(diagnosis: "Diagnosis") -> CaptionedFigure:
    rows = diagnosis.candidates[:MOST_BARS]
    added = [step.effect for step in diagnosis.steps]
    title = _title(diagnosis, "effects that would lower the misfit")
    with blank_figure(*candidates_size(len(rows))) as page:
        draw_candidates(page, rows, added, title)
    text = (
        f"Fall of chi-square by each of the {len(rows)} leading of {len(diagnosis.candidates)} effects "
        "alone, as the first screen predicts it and as a refit with the effect gives it, where there was one."
    )
    return CaptionedFigure("candidates", text, page)


def _inside(diagnosis: "Diagnosis", change: "TableComparison") -> Iterator[CaptionedFigure]:
    for i, wavelength_nm in enumerate(change.before.wavelength_nm):
        title = _title(diagnosis, f"the ink for light from inside the plate at {wavelength_nm:g} nm")
        with blank_figure(*InsideLayout().size) as page:
            draw_inside(page, change, i, title)
        index = float(change.before.index_inside[i])
        text = (
            f"BSDF of the ink alone for light that arrives from inside the plate (index {index:g}), in the "
            "plane of incidence, by the fit of the declared model and by that with what was found."
        )
        yield CaptionedFigure(
            f"inside_{wavelength_nm:g}nm", " ".join([text, *_spectrum_words(diagnosis)]), page
        )


def _title(diagnosis: "Diagnosis", what: str) -> str:
    def misfit(summary):
        reduced = summary.fitted.reduced_chi_square
        return "not defined" if reduced is None else f"{reduced:.4g}"

    line = f"reduced chi-square {misfit(diagnosis.before)} as declared"
    if diagnosis.steps:
        line += f", {misfit(diagnosis.after)} with {', '.join(step.effect for step in diagnosis.steps)}"
    return f"{measurement_name(diagnosis.result)}: {what}\n{line}"


def _once_words(diagnosis: "Diagnosis") -> list[str]:
    return [] if diagnosis.steps else ["No effect was added, so there is one state and no second to compare."]


def _spectrum_words(diagnosis: "Diagnosis") -> list[str]:
    data = diagnosis.result.data
    count = len(np.unique(data.wavelength_nm[data.used]))
    if count <= MOST_WAVELENGTHS:
        return []
    return [
        f"Of {count} wavelengths, the {MOST_WAVELENGTHS} at which the declared model fails most are drawn."
    ]
