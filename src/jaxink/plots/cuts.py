"""In-plane scans of the measured and fitted BSDF, with the residuals below."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from jaxink.plots.figure import PageFigure, Style, blank_figure, set_angle_axis
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
BEYOND: Style = {"color": "black", "marker": "^", "markersize": 4, "linestyle": "none"}
# The line is broken at gaps this many times wider than the usual step.
_GAP = 2.5
_MOST_COLUMNS = 4
# Width of a page with one scan, for its title and legend.
_NARROWEST = 6.8
# A logarithmic panel is drawn if the values span more than this factor.
_DECADE = 10.0


@dataclasses.dataclass(frozen=True)
class ResidualRow:
    """A row of residual panels: its label, which of the predictions, and the half-width of its axes."""

    label: str
    state: int
    limit: float


@dataclasses.dataclass(frozen=True)
class CutLayout:
    """Positions of the panels in inches; fixed, because a layout engine takes longer than the drawing.

    Parameters
    ----------
    scans
        Number of incidences.
    residuals
        Number of rows of residuals.
    has_log
        Whether there is a logarithmic panel above the linear one.
    """

    scans: int
    residuals: int = 1
    has_log: bool = True

    _left, _right, _top, _bottom = 0.75, 0.2, 0.55, 0.5
    _panel, _beside = 2.3, 0.55
    _value, _residual, _between = 1.75, 1.1, 0.13
    _above, _below = 0.3, 0.35

    @property
    def _heights(self) -> tuple[float, ...]:
        return (self._value,) * (1 + self.has_log) + (self._residual,) * self.residuals

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
        return max(width, _NARROWEST), self._top + self.bands * self._band_height + self._bottom

    def axes(self, figure: PageFigure, scan: int, title: str) -> "tuple[Axes, ...]":
        """Panels of one incidence: logarithmic if there is one, linear, and the rows of residuals."""
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


def cut_page(
    states: Sequence[list[ScanView]],
    rows: Sequence[ResidualRow],
    title: str,
    styles: Mapping[str, Style] | None = None,
) -> PageFigure:
    """One column for each scan of one side and wavelength: values, and rows of residuals below.

    Values of all incidences have one scale; the logarithmic panel is left out if they span less than a
    decade.

    Parameters
    ----------
    states
        The scans with one prediction, or with several.
    rows
        The rows of residuals.
    title
        Of the page.
    styles
        Name and style of the line of each prediction; None: one is fitted, two are of the declared and the
        corrected model.
    """
    views = states[0]
    if styles is None:
        styles = {"fitted": FITTED} if len(states) == 1 else {"declared": BEFORE, "corrected": FITTED}
    low, high = _log_ends([view for state in states for view in state])
    layout = CutLayout(len(views), len(rows), high > _DECADE * low)
    with blank_figure(*layout.size) as figure:
        layout.write_labels(figure, title)
        for i, seen in enumerate(zip(*states, strict=True)):
            axes = layout.axes(figure, i, f"incidence {seen[0].theta_i_deg:g}°")
            if not seen[0].has_cut:
                _say_absent(axes, seen[0])
                continue
            _draw_column(axes, layout, seen, rows, (low, high), tuple(styles.values()))
            if i % layout.columns == 0 or not views[i - 1].has_cut:
                values = ["BSDF [1/sr], log", "BSDF [1/sr], linear"] if layout.has_log else ["BSDF [1/sr]"]
                for axis, text in zip(axes, (*values, *(row.label for row in rows)), strict=True):
                    axis.set_ylabel(text, fontsize=9)
        _draw_legend(figure, states, rows, styles)
    return figure


def _draw_column(
    axes,
    layout: CutLayout,
    seen: tuple[ScanView, ...],
    rows,
    ends: tuple[float, float],
    styles: tuple[Style, ...],
) -> None:
    """Panels of one incidence; ``ends`` are those of the positive values of all incidences."""
    for axis in axes:
        set_angle_axis(axis, axis is axes[-1])
    *logarithmic, linear = axes[: 1 + layout.has_log]
    for axis in (*logarithmic, linear):
        _draw_values(axis, seen, styles)
    for axis in logarithmic:
        _set_log_axis(axis, ends)
    linear.set_ylim(0, 1.08 * ends[1])
    for axis, row in zip(axes[1 + layout.has_log :], rows, strict=True):
        _draw_residual(axis, seen[row.state], row.limit, styles[row.state])


def _draw_values(axes: "Axes", states: tuple[ScanView, ...], styles: tuple[Style, ...]) -> None:
    view = states[0]
    plane = view.in_plane
    shown, hidden = plane & view.used, plane & ~view.used & (view.measured > 0)
    axes.axvline(view.theta_i_deg, **PEAK, zorder=1)
    order = np.argsort(view.signed_deg[shown], kind="stable")
    for state, style in zip(states[::-1], styles[::-1], strict=True):
        x, y = (column[shown][order] for column in (state.signed_deg, state.fitted))
        axes.plot(*with_gaps(x, y), **style, zorder=2)
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
        axes.plot(beyond, edge, **{**BEYOND, "marker": marker}, zorder=3)
    axes.set_ylim(-limit, limit)


def with_gaps(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A line with breaks where points are missing, for example at the peaks."""
    step = np.diff(x)
    usual = np.median(step[step > 0]) if (step > 0).any() else np.inf
    after = np.flatnonzero(step > _GAP * usual) + 1
    return np.insert(x, after, np.nan), np.insert(y, after, np.nan)


def _log_ends(views: list[ScanView]) -> tuple[float, float]:
    """Least and largest positive value of all incidences."""
    shown = [(v, v.in_plane & v.used) for v in views if v.has_cut]
    values = np.concatenate([column[here] for v, here in shown for column in (v.measured, v.fitted)])
    values = values[values > 0]
    return (float(values.min()), float(values.max())) if values.size else (0.1, 1.0)


def _set_log_axis(axes: "Axes", ends: tuple[float, float]) -> None:
    axes.set_yscale("log")
    axes.set_ylim(ends[0] / 1.25, ends[1] * 1.25)
    # Three or four labels in plain decimals, for any span.
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if ends[1] / ends[0] < 200 else (1.0,)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())


def _say_absent(axes: "tuple[Axes, ...]", view: ScanView) -> None:
    for axis in axes:
        axis.set_axis_off()
    count, points = int((view.in_plane & view.used).sum()), int(view.used.sum())
    text = f"{count} of {points} points are in the plane;\nan in-plane scan needs {FEWEST_IN_PLANE}"
    axes[0].text(0.5, 0.5, text, ha="center", va="center", transform=axes[0].transAxes, fontsize=9)


def _draw_legend(
    figure: PageFigure,
    states: Sequence[list[ScanView]],
    rows: Sequence[ResidualRow],
    styles: Mapping[str, Style],
) -> None:
    views = states[0]
    peak = "specular direction" if views[0].side == "R" else "undeviated beam"
    entries = [("measured", MEASURED), *styles.items(), (peak, PEAK)]
    if any((view.in_plane & ~view.used).any() for view in views):
        entries.append(("masked, not fitted", MASKED))
    if any(_leaves(view, row.limit) for row in rows for view in states[row.state]):
        entries.append(("beyond the axis", BEYOND))
    figure.draw_line_legend(entries)


def _leaves(view: ScanView, limit: float) -> bool:
    """Whether a residual that is drawn lies beyond the axis."""
    shown = view.in_plane & view.used
    return view.has_cut and bool(np.any(np.abs(view.residual[shown]) > limit))
