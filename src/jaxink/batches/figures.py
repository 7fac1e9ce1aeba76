"""Trends of the parameters over a batch, and maps of them where positions are known."""

from collections.abc import Iterator

import numpy as np
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from jaxink.batches.listing import POSITION
from jaxink.batches.result import Batch
from jaxink.batches.row import Row, RowParameter
from jaxink.batches.verdicts import standard_errors_hold
from jaxink.plots import PageFigure, blank_figure

_GOOD, _FAR = "#2b5d8a", "#c22f2f"
_WIDTH, _HEIGHT = 9.0, 2.6
_ABOVE_GRID = 1.8
# Values of reduced chi-square within this factor have a linear axis, and beyond the second one fewer labels.
_LINEAR_SPAN, _FEW_DECADES = 5.0, 200.0


def trend_figures(batch: Batch, far: dict[str, set[str]]) -> Iterator[tuple[str, PageFigure]]:
    """Caption and figure for each parameter, in the order of the plan, and for chi-square."""
    for name, unit in batch.parameters.items():
        found = list(_of(batch, name))
        at = np.array([number for number, _, _ in found], float)
        values = np.array([p.value for _, _, p in found], float)
        errors = np.array([p.standard_error or 0.0 for _, _, p in found], float)
        holds = np.array([standard_errors_hold(row) for _, row, _ in found])
        outlier = np.array([row.name in far.get(name, ()) for _, row, _ in found])
        with blank_figure(_WIDTH, _HEIGHT) as figure:
            axes = _panel(figure, f"{name}{unit and ', ' + unit}", len(batch))
            _points(axes, at, values, errors, holds & ~outlier, _GOOD, _GOOD)
            _points(axes, at, values, errors, ~holds & ~outlier, _GOOD, "white")
            _points(axes, at, values, errors, outlier, _FAR, _FAR)
            axes.axhline(float(np.median(values)), color="0.5", linewidth=0.8, zorder=_ABOVE_GRID)
        yield f"{name} over the run", figure
    pairs = [(i, row.reduced_chi_square) for i, row in enumerate(batch, 1) if row.reduced_chi_square]
    if pairs:
        with blank_figure(_WIDTH, _HEIGHT) as figure:
            axes = _panel(figure, "reduced χ²", len(batch))
            at, values = np.array(pairs, float).T
            axes.plot(at, values, ".", color=_GOOD)
            axes.axhline(1.0, color="0.5", linewidth=0.8, zorder=_ABOVE_GRID)
            low, high = min(values.min(), 1.0), max(values.max(), 1.0)
            if high > _LINEAR_SPAN * low:
                _set_log(axes, low, high)
        yield "reduced chi-square over the run", figure


def _of(batch: Batch, name: str) -> Iterator[tuple[int, Row, RowParameter]]:
    for number, row in enumerate(batch, 1):
        for p in row.parameters:
            if p.name == name and p.value is not None:
                yield number, row, p


def _points(axes, at, values, errors, which, colour: str, fill: str) -> None:
    if which.any():
        style = {"fmt": "o", "markersize": 3.5, "linewidth": 0.8, "color": colour, "markerfacecolor": fill}
        axes.errorbar(at[which], values[which], errors[which], **style)


def _panel(figure: PageFigure, text: str, n: int):
    """Axes over the run; what they show is above them, where a long name has room."""
    axes = figure.panel(0.9, 0.5, _WIDTH - 1.1, _HEIGHT - 0.8)
    figure.text(0.9 / _WIDTH, 1 - 0.22 / _HEIGHT, text, fontsize=9)
    axes.set_xlim(0.5, n + 0.5)
    axes.set_xlabel("number of the measurement", fontsize=9)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.8g}"))
    axes.tick_params(labelsize=8)
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    return axes


def _set_log(axes, low: float, high: float) -> None:
    axes.set_yscale("log")
    axes.set_ylim(low / 1.25, high * 1.25)
    subdivisions = (1.0, 2.0, 5.0) if high < _FEW_DECADES * low else (1.0,)
    axes.yaxis.set_major_locator(LogLocator(subs=subdivisions))
    axes.yaxis.set_minor_locator(NullLocator())
    # A new scale has brought its own, in powers of ten.
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def map_figures(batch: Batch) -> Iterator[tuple[str, PageFigure]]:
    """Caption and figure for each parameter over the positions of the measurements, if these are given."""
    place = {
        one.name: tuple(float(one.columns[key]) for key in POSITION)
        for one in batch.measurements
        if all(key in one.columns for key in POSITION)
    }
    for name, unit in batch.parameters.items():
        found = [(*place[row.name], p.value) for _, row, p in _of(batch, name) if row.name in place]
        if len(found) < 2:
            continue
        x, y, values = np.array(found, float).T
        with blank_figure(6.0, 4.6) as figure:
            axes = figure.panel(0.8, 0.6, 4.0, 3.7)
            drawn = axes.scatter(x, y, c=values, s=60, cmap="viridis")
            axes.set_aspect("equal", adjustable="datalim")
            axes.set_xlabel("x, mm", fontsize=9)
            axes.set_ylabel("y, mm", fontsize=9)
            axes.tick_params(labelsize=8)
            bar = figure.colorbar(drawn, cax=figure.panel(5.0, 0.6, 0.15, 3.7))
            bar.set_label(f"{name}{unit and ', ' + unit}", fontsize=9)
            bar.ax.tick_params(labelsize=8)
        yield f"{name} over the sample", figure
