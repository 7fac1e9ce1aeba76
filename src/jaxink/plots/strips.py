"""In-plane residuals as strips: viewing angle horizontally, one strip for each incidence."""

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import PolyCollection

from jaxink.plots.discs import COLOURS
from jaxink.plots.figure import PageFigure, set_angle_ticks
from jaxink.plots.scan_views import ScanView

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Height of a strip over the distance of two strips.
_FILLED = 0.86
# Largest width of a cell over the usual step, so that gaps in the data stay empty.
_WIDEST = 1.5
_EMPTY = "0.93"


@dataclasses.dataclass(frozen=True)
class StripLayout:
    """Positions of the panels in inches, for the numbers of incidences in each row of panels."""

    incidences: tuple[int, ...]
    columns: int

    _left, _right, _top, _bottom = 0.85, 1.15, 0.42, 0.85
    _panel, _beside, _above, _strip, _fewest = 4.3, 0.3, 0.45, 0.3, 3

    def _height(self, row: int) -> float:
        return self._strip * max(self.incidences[row], self._fewest)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the page."""
        width = self._left + self.columns * self._panel + (self.columns - 1) * self._beside + self._right
        rows = sum(self._above + self._height(row) for row in range(len(self.incidences)))
        return width, self._top + rows + self._bottom

    def axes(self, figure: PageFigure, row: int, column: int) -> "Axes":
        """Panel of one side and state."""
        x = self._left + column * (self._panel + self._beside)
        above = sum(self._above + self._height(r) for r in range(row + 1))
        return figure.panel(x, self.size[1] - self._top - above, self._panel, self._height(row))

    def bar_axes(self, figure: PageFigure) -> "Axes":
        """Colour bar on the right."""
        width, height = self.size
        tall = min(3.2, height - self._top - self._bottom)
        middle = (height - self._top + self._bottom) / 2
        return figure.panel(width - 0.9, middle - tall / 2, 0.15, tall)


def draw_strips(
    figure: PageFigure, rows: list[list[tuple[str, list[ScanView]]]], title: str, limit: float, label: str
) -> None:
    """Draw panels of strips on one colour scale, whose half-width is ``limit``.

    The figure must have the size given by `StripLayout`. Each panel of ``rows`` has a title and the scans of
    one side and wavelength, in the order of incidence.
    """
    layout = StripLayout(tuple(len(row[0][1]) for row in rows), len(rows[0]))
    figure.write_title(title)
    for i, row in enumerate(rows):
        for j, (words, views) in enumerate(row):
            axes = layout.axes(figure, i, j)
            drawn = _draw_strips(axes, views, limit)
            axes.set_title(words, fontsize=10)
            axes.tick_params(labelsize=8, labelleft=j == 0, labelbottom=i == len(rows) - 1)
            if j == 0:
                axes.set_ylabel("incidence", fontsize=9)
    figure.draw_colour_bar(drawn, layout.bar_axes(figure), label)
    figure.write_below("viewing angle [°], negative towards the source", 0.52)
    text = "○ specular direction or undeviated beam;  ☆ source;  red: measured above the model, blue: below"
    figure.write_below(text, 0.1, "bottom", 8.5)


def _draw_strips(axes: "Axes", views: list[ScanView], limit: float):
    cells, colours = [], []
    for row, view in enumerate(views):
        shown = view.in_plane & view.used
        cells += _cells(view.signed_deg[shown], row)
        colours.append(view.residual[shown])
    drawn = PolyCollection(cells, array=np.concatenate(colours), cmap=COLOURS, linewidths=0, zorder=2)
    drawn.set_clim(-limit, limit)
    axes.add_collection(drawn)
    mark: dict[str, Any] = {
        "markerfacecolor": "none",
        "markeredgecolor": "black",
        "linestyle": "none",
        "zorder": 4,
    }
    for row, view in enumerate(views):
        axes.plot([view.theta_i_deg], [row], marker="o", markersize=5, **mark)
        if view.side == "R":
            axes.plot([-view.theta_i_deg], [row], marker="*", markersize=6, **mark)
    set_angle_ticks(axes)
    axes.set_ylim(len(views) - 0.5, -0.5)
    axes.set_yticks(range(len(views)), [f"{view.theta_i_deg:g}°" for view in views])
    axes.set_facecolor(_EMPTY)
    return drawn


def _cells(angle_deg: np.ndarray, row: int) -> list[np.ndarray]:
    """Corners of a cell for each point; repeated readings of a direction share its height."""
    distinct, of_point = np.unique(np.round(angle_deg, 6), return_inverse=True)
    step = np.diff(distinct)
    half = _WIDEST * np.median(step) / 2 if step.size else 2.0
    below = np.minimum(np.append(half, step / 2), half)
    above = np.minimum(np.append(step / 2, half), half)
    count = np.bincount(of_point)
    cells, seen = [], np.zeros(distinct.size)
    for i in of_point:
        left, right = distinct[i] - below[i], distinct[i] + above[i]
        tall = _FILLED / count[i]
        low = row - _FILLED / 2 + seen[i] * tall
        seen[i] += 1
        cells.append(np.array([(left, low), (right, low), (right, low + tall), (left, low + tall)]))
    return cells
