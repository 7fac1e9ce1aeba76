"""Corner plot: distributions of parameters, alone and in pairs, by a covariance or by samples."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import ArrayLike, Float
from matplotlib.ticker import MaxNLocator

from jaxink.errors import InputRefusedError, no_such_name
from jaxink.plots.cuts import BEFORE, FITTED
from jaxink.plots.figure import PageFigure, Style, blank_figure
from jaxink.plots.scan_views import headed

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from jaxink.fitting import FitResult

_PANEL, _BETWEEN, _LEFT, _RIGHT, _TOP, _BOTTOM = 1.75, 0.12, 1.15, 0.25, 0.5, 1.15
# Half-width of an axis in standard errors.
_SPAN = 3.5
_BINS = 40
# An axis reaches beyond the truth by this factor.
_MARGIN = 1.15
_TRUTH: Style = {"color": "black", "linewidth": 0.9, "linestyle": (0, (4, 2)), "zorder": 3}
# Ellipses hold these shares of a normal distribution of two variables: one and two standard deviations.
_LEVELS = (1.0, 2.0)
_MOST_DOTS = 4000


def corner_figure(
    result: "FitResult",
    names: Sequence[str] | None = None,
    samples: Mapping[str, Float[ArrayLike, " *samples"]] | None = None,
    truth: Mapping[str, float] | None = None,
) -> PageFigure:
    """Distribution of each fitted parameter and of each pair.

    Red curves and ellipses (one and two standard deviations) are the normal distribution of the fit.

    Parameters
    ----------
    result
        The fit.
    names
        Parameters to draw; None: all that have a standard error.
    samples
        Samples of the posterior by name, of any equal shapes, drawn as histograms and dots; None for none.
    truth
        Values by name to mark with black dashes, such as those of a simulation; None for none.

    Raises
    ------
    InputRefusedError
        A parameter has no standard error or no samples, there is none to draw, or the truth has another name.
    """
    covariance = result.covariance
    chosen = list(covariance.names if names is None else names)
    for name in chosen:
        if name not in covariance.names:
            raise InputRefusedError(f"the standard error of {name}, {no_such_name(covariance.names)}")
        if samples is not None and name not in samples:
            raise InputRefusedError(f"the samples of {name}, {no_such_name(samples)}")
    for name in truth or {}:
        if name not in result.parameters:
            raise InputRefusedError(f"the truth of {name}, {no_such_name(result.parameters)}")
    if not chosen:
        raise InputRefusedError("no fitted parameter has a standard error; there is nothing to draw.")
    at = [covariance.names.index(name) for name in chosen]
    matrix = covariance.matrix[np.ix_(at, at)]
    centre = np.array([result[name].value for name in chosen])
    drawn = None if samples is None else np.array([np.ravel(samples[name]) for name in chosen])
    side = len(chosen) * (_PANEL + _BETWEEN) - _BETWEEN
    with blank_figure(max(_LEFT + side + _RIGHT, 4.5), _TOP + side + _BOTTOM) as page:
        page.write_title(headed(result, "fitted parameters"))
        units = [result[name].unit for name in chosen]
        # In lines, as wide as a panel.
        lines = (
            [*name.split(".", 1), f"[{unit}]" * bool(unit)] for name, unit in zip(chosen, units, strict=True)
        )
        labels = ["\n".join(filter(None, parts)) for parts in lines]
        marked = np.array([(truth or {}).get(name, np.nan) for name in chosen])
        _draw_panels(page, labels, centre, matrix, drawn, marked)
    return page


def _draw_panels(page: PageFigure, labels: list[str], centre, matrix, samples, truth) -> None:
    n, deviation = len(labels), np.sqrt(np.diag(matrix))
    reach = np.fmax(_SPAN * deviation, _MARGIN * np.abs(truth - centre))
    for row in range(n):
        for column in range(row + 1):
            x = _LEFT + column * (_PANEL + _BETWEEN)
            axes = page.panel(x, _BOTTOM + (n - 1 - row) * (_PANEL + _BETWEEN), _PANEL, _PANEL)
            axes.set_xlim(centre[column] - reach[column], centre[column] + reach[column])
            if row == column:
                _draw_one(axes, centre[row], deviation[row], None if samples is None else samples[row])
            else:
                pair = [column, row]
                _draw_pair(axes, centre[pair], matrix[np.ix_(pair, pair)], samples, pair)
                axes.set_ylim(centre[row] - reach[row], centre[row] + reach[row])
                if np.isfinite(truth[row]):
                    axes.axhline(truth[row], **_TRUTH)
            if np.isfinite(truth[column]):
                axes.axvline(truth[column], **_TRUTH)
            _label(axes, labels, row, column, n)


def _draw_one(axes: "Axes", centre: float, deviation: float, samples) -> None:
    if samples is not None:
        axes.hist(samples, _BINS, range=axes.get_xlim(), density=True, color="0.8")
    x = np.linspace(*axes.get_xlim(), 201)
    density = np.exp(-0.5 * ((x - centre) / deviation) ** 2) / (np.sqrt(2 * np.pi) * deviation)
    axes.plot(x, density, **FITTED)
    axes.set_ylim(0, None)
    axes.set_yticks([])


def _draw_pair(axes: "Axes", centre, matrix, samples, pair: list[int]) -> None:
    if samples is not None:
        x, y = samples[pair]
        step = -(-x.size // _MOST_DOTS)
        axes.plot(x[::step], y[::step], ".", color="0.55", markersize=1.5, zorder=1)
    turn = np.linspace(0, 2 * np.pi, 181)
    # A square root by eigenvectors also draws a pair that is correlated perfectly.
    values, vectors = np.linalg.eigh(matrix)
    circle = vectors @ (np.sqrt(np.maximum(values, 0))[:, None] * np.array([np.cos(turn), np.sin(turn)]))
    for level in _LEVELS:
        axes.plot(*(centre[:, None] + level * circle), **FITTED, zorder=2)
    axes.axvline(centre[0], color=BEFORE["color"], linewidth=0.7, zorder=1)
    axes.axhline(centre[1], color=BEFORE["color"], linewidth=0.7, zorder=1)


def _label(axes: "Axes", labels: list[str], row: int, column: int, n: int) -> None:
    axes.xaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=8, labelbottom=row == n - 1, labelleft=column == 0 and row > 0)
    axes.ticklabel_format(useOffset=False)
    for tick in axes.get_xticklabels():
        tick.set_rotation(45)
    if row > 0 and column == 0:
        axes.set_ylabel(labels[row], fontsize=8)
    if row != column:
        axes.yaxis.set_major_locator(MaxNLocator(4))
    if row == n - 1:
        axes.set_xlabel(labels[column], fontsize=8)
