"""One picture of a fit: measurement and model of all incidences, and their residuals."""

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D

from jaxink.plots.cuts import FITTED, MEASURED, with_gaps
from jaxink.plots.figure import PageFigure, Style, blank_figure, set_angle_axis
from jaxink.plots.scan_views import (
    SIDES,
    ScanView,
    headed,
    residual_label,
    residual_limit,
    scan_views,
    used_wavelengths,
    worst_wavelength,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from jaxink.fitting import FitResult

# Of the incidences, from the smallest to the largest angle; also distinct in grey and for the colour-blind.
_COLOURS = ("#1b2a6b", "#2f6fb5", "#2a9d8f", "#d18a1b", "#c22f2f", "#7b2d6b")
# Width of the panel of one side, and of each of two.
_PANELS = {1: 6.4, 2: 3.6}
_LEFT, _BESIDE, _RIGHT = 0.8, 0.75, 0.2
_TOP, _VALUES, _BETWEEN, _RESIDUALS, _BOTTOM = 0.65, 2.5, 0.15, 1.15, 0.8
# Values are drawn on a logarithmic axis if they span more than this factor.
_DECADE = 10.0
_MOST_INCIDENCES = len(_COLOURS)


def overview_figure(result: "FitResult", wavelength_nm: float | None = None) -> PageFigure:
    """Measured and fitted BSDF in the plane of incidence with the residuals below, one column for each side.

    Without five points in the plane at any incidence, the fitted BSDF of all points against the measured one.

    Parameters
    ----------
    result
        The fit.
    wavelength_nm
        Which wavelength; None for the one that is fitted worst.
    """
    wave = worst_wavelength(result) if wavelength_nm is None else wavelength_nm
    sides = {side: _shown(scan_views(result, wave, side)) for side in SIDES}
    sides = {side: views for side, views in sides.items() if views}
    at = f" at {wave:g} nm" if len(used_wavelengths(result.data)) > 1 else ""
    title = headed(result, f"measurement and model{at}")
    return _in_plane(result, sides, title) if sides else _all_points(result, title)


def _shown(views: list[ScanView]) -> list[ScanView]:
    """Incidences in the plane; of many, some from the smallest to the largest."""
    flat = [view for view in views if view.has_cut]
    if len(flat) <= _MOST_INCIDENCES:
        return flat
    return [flat[i] for i in np.linspace(0, len(flat) - 1, _MOST_INCIDENCES).round().astype(int)]


def _in_plane(result: "FitResult", sides: dict[str, list[ScanView]], title: str) -> PageFigure:
    limit = residual_limit([view for views in sides.values() for view in views], True)
    angles = sorted({view.theta_i_deg for views in sides.values() for view in views})
    colours = dict(zip(angles, _spread(len(angles)), strict=True))
    panel = _PANELS[len(sides)]
    width = _LEFT + len(sides) * panel + (len(sides) - 1) * _BESIDE + _RIGHT
    height = _TOP + _VALUES + _BETWEEN + _RESIDUALS + _BOTTOM
    with blank_figure(width, height) as figure:
        figure.write_title(title)
        for i, (side, views) in enumerate(sides.items()):
            x = _LEFT + i * (panel + _BESIDE)
            values = figure.panel(x, _BOTTOM + _RESIDUALS + _BETWEEN, panel, _VALUES)
            residuals = figure.panel(x, _BOTTOM, panel, _RESIDUALS)
            figure.write_panel_title(SIDES[side], x + panel / 2, height - _TOP)
            set_angle_axis(values, False)
            set_angle_axis(residuals, True)
            for view in views:
                _draw(values, residuals, view, colours[view.theta_i_deg], limit)
            _scale(values, views)
            residuals.set_ylim(-limit, limit)
            residuals.axhline(0, color="0.4", linewidth=0.8, zorder=1)
            if i == 0:
                values.set_ylabel("BSDF [1/sr]", fontsize=9)
                residuals.set_ylabel(residual_label(result), fontsize=9)
        figure.write_below("viewing angle [°], negative towards the source", 0.5)
        figure.draw_legend(
            [
                Line2D([], [], color=colour, linewidth=1.3, label=f"{angle:g}°")
                for angle, colour in colours.items()
            ]
            + [Line2D([], [], **MEASURED, label="measured")]
        )
    return figure


def _spread(count: int) -> list[str]:
    """Colours that are as distinct as so many can be."""
    if count == 1:
        return [str(FITTED["color"])]
    at = np.linspace(0, _MOST_INCIDENCES - 1, count).round().astype(int)
    return [_COLOURS[i] for i in at]


def _draw(values: "Axes", residuals: "Axes", view: ScanView, colour: str, limit: float) -> None:
    shown = view.in_plane & view.used
    order = np.argsort(view.signed_deg[shown], kind="stable")
    x, measured, fitted, residual = (
        column[shown][order] for column in (view.signed_deg, view.measured, view.fitted, view.residual)
    )
    dots: Style = {**MEASURED, "color": colour}
    values.plot(*with_gaps(x, fitted), color=colour, linewidth=1.2, zorder=2)
    values.plot(x, measured, **dots, zorder=3)
    beyond = np.abs(residual) > limit
    residuals.plot(x[~beyond], residual[~beyond], **dots, zorder=3)
    for sign, marker in ((1, "^"), (-1, "v")):
        out = x[beyond & (np.sign(residual) == sign)]
        edge = np.full(out.size, 0.93 * sign * limit)
        residuals.plot(out, edge, color=colour, marker=marker, markersize=4, linestyle="none", zorder=3)


def _scale(axes: "Axes", views: list[ScanView]) -> None:
    """Logarithmic if the values span much, and from 0 otherwise."""
    seen = np.concatenate(
        [c[v.in_plane & v.used] for v in views for c in (v.measured, v.fitted)],
    )
    positive = seen[seen > 0]
    if positive.size and positive.max() > _DECADE * positive.min():
        axes.set_yscale("log")
        axes.set_ylim(positive.min() / 1.25, positive.max() * 1.25)
    elif positive.size:
        axes.set_ylim(0, 1.08 * positive.max())


def _all_points(result: "FitResult", title: str) -> PageFigure:
    """Fitted against measured BSDF."""
    measured, fitted = result.data.bsdf_per_sr[result.data.used], result.predicted_per_sr
    with blank_figure(6.8, 5.2) as figure:
        figure.write_title(title)
        axes = figure.panel(1.4, 0.9, 4.0, 3.6)
        ends = np.array([min(measured.min(), fitted.min()), max(measured.max(), fitted.max())])
        axes.plot(ends, ends, **FITTED, zorder=1)
        axes.plot(measured, fitted, **MEASURED, zorder=2)
        if ends[0] > 0 and ends[1] > _DECADE * ends[0]:
            axes.set_xscale("log")
            axes.set_yscale("log")
        axes.set_xlabel("measured BSDF [1/sr]", fontsize=9)
        axes.set_ylabel("fitted BSDF [1/sr]", fontsize=9)
        axes.tick_params(labelsize=8)
        axes.spines[["top", "right"]].set_visible(False)
        figure.draw_line_legend([("points", MEASURED), ("fitted = measured", FITTED)])
    return figure
