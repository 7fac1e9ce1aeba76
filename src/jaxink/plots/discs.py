"""Residuals over all viewing directions, one disc for each incidence."""

import dataclasses
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from jaxink.plots.figure import PageFigure
from jaxink.plots.scan_views import ScanView

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.projections.polar import PolarAxes

COLOURS = "RdBu_r"
_MOST_COLUMNS = 3
_NARROWEST = 7.6


@dataclasses.dataclass(frozen=True)
class DiscLayout:
    """Positions of the discs in inches; ``states`` of the ``scans`` discs belong to one scan."""

    scans: int
    states: int = 1

    _left, _right, _top, _bottom = 0.4, 1.3, 0.5, 0.6
    _disc, _beside, _above = 2.7, 0.6, 0.7

    @property
    def columns(self) -> int:
        """Number of discs in a row."""
        return min(self.scans, -(-_MOST_COLUMNS // self.states) * self.states)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the page."""
        rows = -(-self.scans // self.columns)
        width = self._left + self.columns * self._disc + (self.columns - 1) * self._beside + self._right
        return max(width, _NARROWEST), self._top + rows * (self._above + self._disc) + self._bottom

    def axes(self, figure: PageFigure, scan: int) -> "PolarAxes":
        """Disc of one incidence."""
        row, column = divmod(scan, self.columns)
        x = self._left + column * (self._disc + self._beside)
        y = self.size[1] - self._top - (row + 1) * (self._above + self._disc)
        return cast("PolarAxes", figure.panel(x, y, self._disc, self._disc, projection="polar"))

    def bar_axes(self, figure: PageFigure) -> "Axes":
        """Colour bar on the right."""
        width, height = self.size
        tall = min(3.2, 0.6 * height)
        return figure.panel(width - 0.85, (height - tall) / 2, 0.15, tall)


def draw_discs(
    figure: PageFigure,
    views: list[ScanView],
    title: str,
    limit: float,
    label: str,
    states: tuple[str, ...] = ("",),
) -> None:
    """Draw polar discs on one colour scale; triangles point up if measured exceeds fitted.

    The figure must have the size given by `DiscLayout`. ``views`` are scans of one side and wavelength, each
    once for each of the ``states``; ``limit`` is the half-width of the colour scale, ``label`` its label.
    """
    layout = DiscLayout(len(views), len(states))
    figure.write_title(title)
    for i, view in enumerate(views):
        drawn = _draw_disc(layout.axes(figure, i), view, limit, states[i % len(states)])
    figure.draw_colour_bar(drawn, layout.bar_axes(figure), label)
    peak = "○ specular direction, ☆ source" if views[0].side == "R" else "○ undeviated beam"
    text = f"▲ measured above, ▼ below the fit;  {peak};  rings: viewing angle 30°, 60°, 90°;  azimuth: phi"
    figure.write_below(text, 0.15, "bottom", 8.5)


def _draw_disc(axes: "PolarAxes", view: ScanView, limit: float, state: str):
    # As in the scans: the source's half-plane (phi 0) on the left, the peak (phi 180) on the right.
    axes.set_theta_zero_location("W")
    axes.set_theta_direction(-1)
    # Size and colour both grow with the residual, so that the pattern is also visible in greyscale.
    share = np.minimum(np.abs(view.residual) / limit, 1.0)
    size = np.clip(9000 / max(int(view.used.sum()), 1), 12, 60) * (0.1 + 0.9 * share)
    for sign, marker in ((1, "^"), (-1, "v")):
        here = view.used & (np.where(view.residual >= 0, 1, -1) == sign)
        drawn = axes.scatter(
            np.deg2rad(view.phi_deg[here]),
            view.theta_o_deg[here],
            c=view.residual[here],
            s=size[here],
            marker=marker,
            cmap=COLOURS,
            vmin=-limit,
            vmax=limit,
            edgecolors="0.3",
            linewidths=0.3,
            zorder=3,
        )
    ring: dict[str, Any] = {
        "markersize": 9,
        "markerfacecolor": "none",
        "markeredgecolor": "black",
        "linestyle": "none",
        "zorder": 4,
    }
    if view.side == "R":
        axes.plot([0.0], [view.theta_i_deg], marker="*", **ring, clip_on=False)
    axes.plot([np.pi], [view.theta_i_deg], marker="o", **ring, clip_on=False)
    axes.set_ylim(0, 90)
    axes.set_yticks([30, 60, 90], ["", "", ""])
    axes.set_xticks(np.deg2rad([0, 90, 180, 270]), ["0°", "90°", "180°", "-90°"])
    axes.tick_params(labelsize=8, pad=0)
    axes.grid(True, color="0.85", linewidth=0.6)
    name = f"{state}, " if state else ""
    axes.set_title(f"{name}incidence {view.theta_i_deg:g}°: {int(view.used.sum())} points", fontsize=10)
    return drawn
