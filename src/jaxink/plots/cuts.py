"""Measured and fitted BSDF in the plane of incidence, with the residuals below."""

from typing import TYPE_CHECKING

import numpy as np

from jaxink.plots.scans import FEWEST_IN_PLANE, ScanView

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure, SubFigure

MEASURED = {
    "color": "black",
    "marker": "o",
    "markersize": 2.6,
    "linestyle": "none",
    "markerfacecolor": "none",
}
MASKED = {"color": "0.45", "marker": "x", "markersize": 3.2, "linestyle": "none"}
FITTED = {"color": "#c22f2f", "linewidth": 1.3}
PEAK = {"color": "0.35", "linewidth": 0.8, "linestyle": (0, (4, 3))}
# A gap this many times wider than the usual step is not bridged by the line.
_GAP = 2.5


def draw_cuts(
    figure: "Figure | SubFigure", views: list[ScanView], columns: int, limit: float, label: str
) -> None:
    """Draw one column for each incidence: logarithmic, linear, residual.

    Parameters
    ----------
    figure
        Where.
    views
        Scans, of one side and wavelength.
    columns
        Columns of the page; those beyond the scans stay empty.
    limit
        Half-width of the residual axis.
    label
        Its label.
    """
    grid = figure.subplots(3, columns, squeeze=False, sharex=True, height_ratios=(3, 3, 1.8))
    first = next((i for i, view in enumerate(views) if view.has_cut), 0)
    for axis in grid[:, len(views) :].flat:
        axis.set_axis_off()
    for axes, view in zip(grid.T, views, strict=False):
        axes[0].set_title(f"incidence {view.theta_i_deg:g}°", fontsize=10)
        if view.has_cut:
            _draw_values(axes[0], view)
            _draw_values(axes[1], view)
            _draw_residual(axes[2], view, limit)
        else:
            _say_absent(axes, view)
    _set_axes(grid[:, : len(views)], views, first)
    for axis, text in zip(grid[:, first], ("BSDF [1/sr], log", "BSDF [1/sr], linear", label), strict=True):
        axis.set_ylabel(text, fontsize=9)
    figure.supxlabel("polar angle of view [°], negative on the source's side", fontsize=9)


def draw_legend(figure: "Figure", views: list[ScanView]) -> None:
    """Say what the symbols are, below the page."""
    from matplotlib.lines import Line2D

    peak = "specular direction" if views[0].side == "R" else "undeviated beam"
    entries = [("measured", MEASURED), ("fitted", FITTED), (peak, PEAK)]
    if any((view.in_plane & ~view.used).any() for view in views):
        entries.append(("measured, masked: not fitted", MASKED))
    handles = [Line2D([], [], **style, label=text) for text, style in entries]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False, fontsize=9)


def _set_axes(grid, views: list[ScanView], first: int) -> None:
    """One logarithmic scale for all incidences, over the positive values; one linear scale each."""
    cut = [(column, view) for column, view in zip(grid.T, views, strict=True) if view.has_cut]
    shown = [np.concatenate([v.measured[v.in_plane & v.used], v.fitted[v.in_plane & v.used]]) for _, v in cut]
    values = np.concatenate([*shown, np.zeros(0)])
    values = values[values > 0]
    for (log, linear, residual), _ in cut:
        log.set_yscale("log")
        if values.size:
            log.set_ylim(values.min() / 1.3, values.max() * 1.3)
        linear.set_ylim(bottom=0)
        residual.set_xticks([-90, -60, -30, 0, 30, 60, 90])
        residual.set_xlim(-90, 90)
        if residual is not grid[2, first]:
            log.tick_params(labelleft=False, which="both")
            residual.tick_params(labelleft=False)


def _draw_values(axes: "Axes", view: ScanView) -> None:
    plane = view.in_plane
    shown, hidden = plane & view.used, plane & ~view.used & (view.measured > 0)
    axes.axvline(view.theta_i_deg, **PEAK, zorder=0)
    order = np.argsort(view.signed_deg[shown], kind="stable")
    x, y = (column[shown][order] for column in (view.signed_deg, view.fitted))
    axes.plot(*_with_gaps(x, y), **FITTED, zorder=2)
    axes.plot(view.signed_deg[hidden], view.measured[hidden], **MASKED, zorder=1)
    axes.plot(view.signed_deg[shown], view.measured[shown], **MEASURED, zorder=3)
    _plain_frame(axes)


def _draw_residual(axes: "Axes", view: ScanView, limit: float) -> None:
    shown = view.in_plane & view.used
    x, y = view.signed_deg[shown], view.residual[shown]
    axes.axhline(0, color=FITTED["color"], linewidth=1.0, zorder=1)
    axes.axvline(view.theta_i_deg, **PEAK, zorder=0)
    inside = np.abs(y) <= limit
    axes.plot(x[inside], y[inside], **MEASURED, zorder=3)
    for sign, marker in ((1, "^"), (-1, "v")):
        beyond = ~inside & (np.sign(y) == sign)
        axes.plot(
            x[beyond],
            np.full(int(beyond.sum()), 0.94 * sign * limit),
            marker=marker,
            color="black",
            markersize=4,
            linestyle="none",
            zorder=3,
        )
    axes.set_ylim(-limit, limit)
    _plain_frame(axes)


def _with_gaps(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A line that is broken where points are missing, at the peaks for instance."""
    step = np.diff(x)
    after = np.flatnonzero(step > _GAP * np.median(step)) + 1
    return np.insert(x, after, np.nan), np.insert(y, after, np.nan)


def _say_absent(axes, view: ScanView) -> None:
    for axis in axes:
        axis.set_axis_off()
    count, points = int((view.in_plane & view.used).sum()), int(view.used.sum())
    axes[1].text(
        0.5,
        0.5,
        f"{count} of {points} points\nlie in the plane:\nno cut below {FEWEST_IN_PLANE},\nsee the map",
        ha="center",
        va="center",
        transform=axes[1].transAxes,
        fontsize=9,
    )


def _plain_frame(axes: "Axes") -> None:
    axes.grid(True, color="0.9", linewidth=0.6)
    axes.tick_params(labelsize=8)
    for edge in ("top", "right"):
        axes.spines[edge].set_visible(False)
