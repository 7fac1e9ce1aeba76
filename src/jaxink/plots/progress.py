"""How searches lower their loss, against run time and against evaluations."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import matplotlib
import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.plots.comparison import named_results
from jaxink.plots.figure import PageFigure, Style, blank_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from jaxink.fitting import FitResult, SearchSummary

_WIDE, _TALL, _LEFT, _BETWEEN, _RIGHT, _BOTTOM, _TOP = 3.6, 2.9, 0.8, 0.75, 0.2, 0.95, 0.55
# Of the legend: the line with the gaps beside it, a letter, and a row, inches.
_LEGEND_LINE, _LEGEND_LETTER, _LEGEND_ROW = 0.6, 0.085, 0.19


def progress_figure(results: "FitResult | Sequence[FitResult] | Mapping[str, FitResult]") -> PageFigure:
    """Lowest loss so far against run time, and against the number of evaluations.

    A scan that preceded the searches counts, and so do all starts, one after the other; profile likelihoods
    and compilation do not. A Jacobian counts as one evaluation.

    Parameters
    ----------
    results
        A fit, or several, which should minimise the same objective; a mapping names them, otherwise their
        methods do.

    Raises
    ------
    InputRefusedError
        No fit is given, or an older jaxink saved one without its path.
    """
    named = named_results(results)
    if not named:
        raise InputRefusedError("no fit is given; there is no progress to draw.")
    ways = {name: way_of(result) for name, result in named.items()}
    objectives = {result.objective for result in named.values()}
    colours = matplotlib.color_sequences["tab10"]
    dashes = ("-", "--", ":")
    styles: list[Style] = [
        {"color": colours[i % len(colours)], "linestyle": dashes[i // len(colours) % len(dashes)]}
        for i in range(len(ways))
    ]
    width = _LEFT + 2 * _WIDE + _BETWEEN + _RIGHT
    side_by_side = int(width / (_LEGEND_LINE + _LEGEND_LETTER * max(map(len, ways))))
    side_by_side = min(max(side_by_side, 1), len(ways))
    bottom = _BOTTOM + _LEGEND_ROW * (-(-len(ways) // side_by_side) - 1)
    with blank_figure(width, bottom + _TALL + _TOP) as page:
        page.write_title("Progress of the searches")
        panels = [page.panel(_LEFT + i * (_WIDE + _BETWEEN), bottom, _WIDE, _TALL) for i in range(2)]
        for column, axes in enumerate(panels):
            for style, way in zip(styles, ways.values(), strict=True):
                axes.plot(way[:, column], way[:, 2], drawstyle="steps-post", linewidth=1.4, **style)
                axes.plot(way[-1, column], way[-1, 2], "o", color=style["color"], markersize=4)
            _label(axes, ("run time [s]", "evaluations and Jacobians")[column], column == 0)
        panels[0].set_ylabel("chi-square" if objectives == {"chi_square"} else "loss", fontsize=9)
        page.draw_line_legend(zip(ways, styles, strict=True), side_by_side)
    return page


def way_of(result: "FitResult") -> Float[np.ndarray, "entries 3"]:
    """Seconds, evaluations with Jacobians, and the lowest loss so far, over all searches of a fit."""
    rows: list[tuple[float, float, float]] = []
    seconds = evaluations = 0.0
    for search in _in_order(result):
        path = search.path
        if path is None:
            raise InputRefusedError(
                f"{result.data.source or 'the fit'}: an older jaxink saved it without the path of its "
                "searches; fit again."
            )
        efforts = zip(path.seconds, path.evaluations, path.jacobians, path.loss, strict=True)
        for time, alone, jacobians, loss in efforts:
            if not rows or loss < rows[-1][2]:
                rows.append((seconds + time, evaluations + alone + jacobians, loss))
        seconds += search.run_seconds
        evaluations += search.evaluations + search.jacobians
    # The searches go on beyond the last improvement.
    return np.array([*rows, (seconds, evaluations, rows[-1][2])])


def _in_order(result: "FitResult") -> Iterator["SearchSummary"]:
    """The searches as they were made: a result lists the scan behind the starts."""
    yield from (search for search in result.searches if search.method == "scan")
    yield from (search for search in result.searches if search.is_single)


def _label(axes: "Axes", label: str, from_zero: bool) -> None:
    axes.set_yscale("log")
    if from_zero:
        axes.set_xlim(left=0)
    else:
        axes.set_xscale("log")
    axes.set_xlabel(label, fontsize=9)
    axes.tick_params(labelsize=8)
    axes.grid(True, which="major", color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
