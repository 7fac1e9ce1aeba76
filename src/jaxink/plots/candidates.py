"""Bar chart of the decrease in chi-square by each candidate of a diagnosis."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from jaxink.plots.figure import PageFigure, Style

if TYPE_CHECKING:
    from jaxink.diagnosis import CandidateRow

MOST_BARS = 12
PREDICTED: Style = {"color": "0.72"}
REFITTED: Style = {"color": "#c22f2f"}
# Smaller decreases do not count: noise gives 1 to any additional parameter.
_LEAST = 1.0
_BAR, _ROW = 0.36, 0.36
_LEFT, _RIGHT, _TOP, _BOTTOM = 1.9, 0.9, 0.6, 0.8


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
