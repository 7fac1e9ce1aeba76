"""The BSDF of an ink for light from inside its plate, by two models."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from jaxink.plots.cuts import BEFORE, FITTED
from jaxink.plots.figure import PageFigure, set_angle_axis
from jaxink.plots.scan_views import FROM_INSIDE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from jaxink.ink.comparison import TableComparison

# In the plate; beyond the critical angle light is guided.
INCIDENCES_DEG = (0.0, 30.0, 50.0, 70.0)
_VIEW_DEG = np.linspace(-85.0, 85.0, 171)


@dataclasses.dataclass(frozen=True)
class InsideLayout:
    """Positions of the panels in inches: for each component a row of curves and a row of changes."""

    _left, _right, _top, _bottom = 0.8, 0.2, 0.5, 0.6
    _panel, _beside, _above, _between, _below = 2.3, 0.55, 0.3, 0.13, 0.3
    _curve, _change = 1.75, 1.1

    @property
    def _block(self) -> float:
        return self._above + self._curve + self._between + self._change + self._below

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the page."""
        n = len(INCIDENCES_DEG)
        width = self._left + n * self._panel + (n - 1) * self._beside + self._right
        return width, self._top + len(FROM_INSIDE) * self._block + self._bottom

    def axes(self, figure: PageFigure, row: int, column: int, title: str) -> "tuple[Axes, Axes]":
        """Curves and change of one component at one incidence."""
        x = self._left + column * (self._panel + self._beside)
        y = self.size[1] - self._top - row * self._block - self._above
        figure.write_panel_title(title, x + self._panel / 2, y, 9.5)
        below = y - self._curve - self._between - self._change
        above = figure.panel(x, y - self._curve, self._panel, self._curve)
        return above, figure.panel(x, below, self._panel, self._change)


def draw_inside(figure: PageFigure, change: "TableComparison", wavelength: int, title: str) -> None:
    """Draw the in-plane BSDF of both tables at a wavelength, given by its index, and the change below.

    The figure must have the size given by `InsideLayout`.
    """
    layout = InsideLayout()
    figure.write_title(title)
    view, phi = np.abs(_VIEW_DEG), np.where(_VIEW_DEG < 0, 0.0, 180.0)
    for row, (component, where) in enumerate(FROM_INSIDE.items()):
        curves = [change.at(component, theta, view, phi, wavelength) for theta in INCIDENCES_DEG]
        relative = [_change_percent(before, after) for before, after in curves]
        limit = _limit(relative)
        for column, theta in enumerate(INCIDENCES_DEG):
            above, below = layout.axes(figure, row, column, f"{theta:g}° inside, {where}")
            for values, style in zip(curves[column], (BEFORE, FITTED), strict=True):
                above.plot(_VIEW_DEG, values, **style)
            above.set_ylim(0, 1.08 * max(float(np.max(values)) for values in curves[column]) or 1.0)
            below.axhline(0, color=BEFORE["color"], linewidth=1.0)
            below.plot(_VIEW_DEG, relative[column], **FITTED)
            below.set_ylim(-limit, limit)
            set_angle_axis(above, False)
            set_angle_axis(below, True)
            if column == 0:
                above.set_ylabel(f"{component} [1/sr]", fontsize=9)
                below.set_ylabel("change [%]", fontsize=9)
    figure.write_below("exit angle in the medium of the exit side [°], negative towards the source", 0.54)
    figure.draw_line_legend([("declared", BEFORE), ("corrected", FITTED)])


def _change_percent(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore", invalid="ignore"):
        return 100 * np.where(before > 0, after / before - 1, np.nan)


def _limit(relative: list[np.ndarray]) -> float:
    """Half-width of the common axis of all incidences."""
    sizes = np.abs(np.concatenate(relative))
    sizes = sizes[np.isfinite(sizes)]
    return 1.1 * max(float(sizes.max()), 1e-3) if sizes.size else 1.0
