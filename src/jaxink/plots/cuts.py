"""In-plane scans of the measured and fitted BSDF, with the residuals below."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from jaxink.plots.figure import PageFigure, Style, set_angle_axis
from jaxink.plots.scan_views import FEWEST_IN_PLANE, ScanView

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MEASURED: Style = {
    "color": "black",
    "marker": "o",
    "markersize": 2.6,
    "markeredgewidth": 0.7,
    "linestyle": "none",
    "markerfacecolor": "none",
}
MASKED: Style = {"color": "0.45", "marker": "x", "markersize": 3.2, "linestyle": "none"}
FITTED: Style = {"color": "#c22f2f", "linewidth": 1.3}
BEFORE: Style = {"color": "#2f5fc2", "linewidth": 1.2, "linestyle": (0, (3, 1.5))}
PEAK: Style = {"color": "0.25", "linewidth": 0.9, "linestyle": (0, (4, 3))}
# The line is broken at gaps this many times wider than the usual step.
_GAP = 2.5
_MOST_COLUMNS = 5


@dataclasses.dataclass(frozen=True)
class CutLayout:
    """Positions of the panels in inches; fixed, because a layout engine takes longer than the drawing.

    ``states`` is the number of predictions, each with its own residuals.
    """

    scans: int
    states: int = 1

    _left, _right, _top, _bottom = 0.75, 0.2, 0.55, 0.5
    _panel, _beside = 2.3, 0.55
    _values, _residual, _between = (1.75, 1.75), 1.1, 0.13
    _above, _below = 0.3, 0.35

    @property
    def _heights(self) -> tuple[float, ...]:
        return self._values + (self._residual,) * self.states

    @property
    def bands(self) -> int:
        """Number of rows of incidences."""
        return -(-self.scans // _MOST_COLUMNS)

    @property
    def columns(self) -> int:
        """Number of incidences in a row; all rows are equally long."""
        return -(-self.scans // self.bands)

    @property
    def _band_height(self) -> float:
        return self._above + sum(self._heights) + (len(self._heights) - 1) * self._between + self._below

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the page."""
        width = self._left + self.columns * self._panel + (self.columns - 1) * self._beside + self._right
        return width, self._top + self.bands * self._band_height + self._bottom

    def axes(self, figure: PageFigure, scan: int, title: str) -> "tuple[Axes, ...]":
        """Panels of one incidence: logarithmic, linear, and the residual of each state."""
        band, column = divmod(scan, self.columns)
        x = self._left + column * (self._panel + self._beside)
        y = self.size[1] - self._top - band * self._band_height - self._above
        figure.write_panel_title(title, x + self._panel / 2, y)
        made = []
        for panel in self._heights:
            y -= panel
            made.append(figure.panel(x, y, self._panel, panel))
            y -= self._between
        return tuple(made)

    def write_labels(self, figure: PageFigure, title: str) -> None:
        """Title at the top and the common axis label at the bottom."""
        figure.write_title(title)
        figure.write_below("viewing angle [°], negative towards the source", self._bottom - 0.02)


def draw_cuts(
    figure: PageFigure,
    views: list[ScanView],
    title: str,
    limit: float,
    labels: tuple[str, ...],
    later: list[ScanView] | None = None,
) -> None:
    """Draw one column for each scan of one side and wavelength: logarithmic, linear, residual.

    The figure must have the size given by `CutLayout`. ``limit`` is the half-width of the residual axes,
    ``labels`` their labels; ``later`` are the same scans with a second prediction, drawn with its residuals.
    """
    states = [views] if later is None else [views, later]
    layout = CutLayout(len(views), len(states))
    layout.write_labels(figure, title)
    ends = _log_ends([view for state in states for view in state])
    for i, seen in enumerate(zip(*states, strict=True)):
        view = seen[0]
        axes = layout.axes(figure, i, f"incidence {view.theta_i_deg:g}°")
        if not view.has_cut:
            _say_absent(axes, view)
            continue
        _draw_values(axes[0], seen)
        _draw_values(axes[1], seen)
        styles = [FITTED] if later is None else [BEFORE, FITTED]
        for axis, state, style in zip(axes[2:], seen, styles, strict=True):
            _draw_residual(axis, state, limit, style)
        shown = view.in_plane & view.used
        largest = max(column[shown].max() for column in (view.measured, *(s.fitted for s in seen)))
        _set_axes(axes, ends, largest)
        if i % layout.columns == 0 or not views[i - 1].has_cut:
            for axis, text in zip(axes, ("BSDF [1/sr], log", "BSDF [1/sr], linear", *labels), strict=True):
                axis.set_ylabel(text, fontsize=9)
    _draw_legend(figure, views, later is not None)


def _draw_values(axes: "Axes", states: tuple[ScanView, ...]) -> None:
    view = states[0]
    plane = view.in_plane
    shown, hidden = plane & view.used, plane & ~view.used & (view.measured > 0)
    axes.axvline(view.theta_i_deg, **PEAK, zorder=1)
    order = np.argsort(view.signed_deg[shown], kind="stable")
    for state, style in zip(states[::-1], (FITTED, BEFORE), strict=False):
        x, y = (column[shown][order] for column in (state.signed_deg, state.fitted))
        axes.plot(*_with_gaps(x, y), **style, zorder=2)
    axes.plot(view.signed_deg[hidden], view.measured[hidden], **MASKED, zorder=1)
    axes.plot(view.signed_deg[shown], view.measured[shown], **MEASURED, zorder=3)


def _draw_residual(axes: "Axes", view: ScanView, limit: float, style: Style) -> None:
    """Residuals; a triangle at the edge marks a residual beyond it."""
    shown = view.in_plane & view.used
    x, y = view.signed_deg[shown], view.residual[shown]
    axes.axhline(0, color=style["color"], linewidth=1.0, zorder=2)
    axes.axvline(view.theta_i_deg, **PEAK, zorder=1)
    inside = np.abs(y) <= limit
    axes.plot(x[inside], y[inside], **MEASURED, zorder=3)
    for sign, marker in ((1, "^"), (-1, "v")):
        beyond = x[~inside & (np.sign(y) == sign)]
        edge = np.full(beyond.size, 0.93 * sign * limit)
        axes.plot(beyond, edge, color="black", marker=marker, markersize=4, linestyle="none", zorder=3)
    axes.set_ylim(-limit, limit)


def _with_gaps(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The line with breaks where points are missing, for example at the peaks."""
    step = np.diff(x)
    usual = np.median(step[step > 0]) if (step > 0).any() else np.inf
    after = np.flatnonzero(step > _GAP * usual) + 1
    return np.insert(x, after, np.nan), np.insert(y, after, np.nan)


def _log_ends(views: list[ScanView]) -> tuple[float, float]:
    """One logarithmic scale for all incidences, over the positive values."""
    shown = [(v, v.in_plane & v.used) for v in views if v.has_cut]
    values = np.concatenate([column[here] for v, here in shown for column in (v.measured, v.fitted)])
    values = values[values > 0]
    return (float(values.min()) / 1.25, float(values.max()) * 1.25) if values.size else (0.1, 1.0)


def _set_axes(axes: "tuple[Axes, ...]", log_ends: tuple[float, float], largest: float) -> None:
    log, linear, *_, lowest = axes
    for axis in axes:
        set_angle_axis(axis, axis is lowest)
    log.set_yscale("log")
    log.set_ylim(*log_ends)
    # Three or four labels in plain decimals, for any span.
    span = log_ends[1] / log_ends[0]
    subs = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if span < 8 else (1.0, 2.0, 5.0) if span < 300 else (1.0,)
    log.yaxis.set_major_locator(LogLocator(subs=subs))
    log.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    log.yaxis.set_minor_locator(NullLocator())
    linear.set_ylim(0, 1.08 * largest)


def _say_absent(axes: "tuple[Axes, ...]", view: ScanView) -> None:
    for axis in axes:
        axis.set_axis_off()
    count, points = int((view.in_plane & view.used).sum()), int(view.used.sum())
    text = f"{count} of {points} points are in the plane;\nan in-plane scan needs {FEWEST_IN_PLANE}"
    axes[0].text(0.5, 0.5, text, ha="center", va="center", transform=axes[0].transAxes, fontsize=9)


def _draw_legend(figure: PageFigure, views: list[ScanView], compares: bool) -> None:
    peak = "specular direction" if views[0].side == "R" else "undeviated beam"
    fits = [("before", BEFORE), ("after", FITTED)] if compares else [("fitted", FITTED)]
    entries = [("measured", MEASURED), *fits, (peak, PEAK)]
    if any((view.in_plane & ~view.used).any() for view in views):
        entries.append(("masked, not fitted", MASKED))
    figure.draw_line_legend(entries)
