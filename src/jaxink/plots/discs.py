"""Residuals over all directions of view, one disc for each incidence."""

from typing import TYPE_CHECKING

import numpy as np

from jaxink.plots.scans import ScanView

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

COLOURS = "RdBu_r"


def draw_discs(
    figure: "Figure | SubFigure", views: list[ScanView], columns: int, limit: float, label: str
) -> None:
    """Draw polar discs on one colour scale; triangles point up where measured exceeds fitted.

    Parameters
    ----------
    figure
        Where.
    views
        Scans, of one side and wavelength.
    columns
        Discs beside each other.
    limit
        Half-width of the colour scale.
    label
        Its label.
    """
    rows = -(-len(views) // columns)
    grid = figure.subplots(rows, columns, squeeze=False, subplot_kw={"projection": "polar"})
    drawn = None
    for axes, view in zip(grid.flat, views, strict=False):
        drawn = _draw_disc(axes, view, limit)
    for axes in grid.flat[len(views) :]:
        axes.set_axis_off()
    bar = figure.colorbar(drawn, ax=grid, shrink=0.7 / rows**0.5, aspect=25, extend="both", pad=0.03)
    bar.set_label(f"{label}   (▲ measured above, ▼ below the fit)", fontsize=9)
    bar.ax.tick_params(labelsize=8)


def _draw_disc(axes, view: ScanView, limit: float):
    # As in the cuts: the source's half-plane (phi 0) to the left, the peak (phi 180) to the right.
    axes.set_theta_zero_location("W")
    axes.set_theta_direction(-1)
    size = np.clip(2200 / max(int(view.used.sum()), 1), 4, 26)
    for sign, marker in ((1, "^"), (-1, "v")):
        here = view.used & (np.where(view.residual >= 0, 1, -1) == sign)
        drawn = axes.scatter(
            np.deg2rad(view.phi_deg[here]),
            view.theta_o_deg[here],
            c=view.residual[here],
            marker=marker,
            s=size,
            cmap=COLOURS,
            vmin=-limit,
            vmax=limit,
            edgecolors="0.35",
            linewidths=0.3,
            zorder=3,
        )
    ring = {
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
    axes.set_yticks([30, 60, 90], ["30°", "60°", ""])
    axes.set_rlabel_position(67.5)
    axes.set_xticks(np.deg2rad([0, 90, 180, 270]), ["0°", "90°", "180°", "-90°"])
    axes.tick_params(labelsize=8, pad=0)
    axes.grid(True, color="0.85", linewidth=0.6)
    axes.set_title(f"incidence {view.theta_i_deg:g}°: {int(view.used.sum())} points", fontsize=10)
    return drawn
