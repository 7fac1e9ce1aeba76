"""An ink over a black and a white card against its thickness."""

from typing import TYPE_CHECKING

from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from jaxink.colour import HIDING, Drawdown
from jaxink.plots.figure import PageFigure, blank_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH, _LEFT = 6.4, 0.75
_NUMBERS = ("L", "a", "b")
_COLOURS = {"L": "0.2", "a": "#b5395a", "b": "#b08a17"}


def drawdown_figure(drawn: Drawdown) -> PageFigure:
    """Swatches, CIELAB and contrast ratio against the thickness.

    Parameters
    ----------
    drawn
        The drawdown; over black is drawn solid, over white dashed.
    """
    with blank_figure(_WIDTH, 6.6) as figure:
        figure.write_title(f"Drawdown seen {drawn.spectra.geometries[0].name}\n{drawn.viewing.sentence}")
        wide = _WIDTH - _LEFT - 0.35
        top = figure.panel(_LEFT, 5.0, wide, 0.9)
        _draw_swatches(top, drawn)
        middle = figure.panel(_LEFT, 2.6, wide, 2.1)
        for colours, line in ((drawn.black, "-"), (drawn.white, "--")):
            for name in _NUMBERS:
                values = [colour.values[name] for colour in colours]
                middle.plot(drawn.thickness_um, values, line, color=_COLOURS[name], linewidth=1.3)
        middle.set_ylabel("L*, a*, b*", fontsize=9)
        below = figure.panel(_LEFT, 0.95, wide, 1.4)
        below.plot(drawn.thickness_um, drawn.contrast_ratio, "o-", color="0.2", markersize=3, linewidth=1.3)
        below.axhline(HIDING, color="0.6", linewidth=0.8, linestyle=":")
        below.set_ylim(0, 1.05)
        below.set_ylabel("contrast ratio", fontsize=9)
        below.set_xlabel("thickness, um", fontsize=9)
        for axes in (middle, below):
            _set_thickness_axis(axes, drawn, labelled=axes is below)
        entries = [
            (f"{name}* over {card}", {"color": _COLOURS[name], "linestyle": line})
            for card, line in (("black", "-"), ("white", "--"))
            for name in _NUMBERS
        ]
        figure.draw_line_legend(entries, 3)
    return figure


def _draw_swatches(axes: "Axes", drawn: Drawdown) -> None:
    """A square for each thickness, over white above and over black below."""
    count = len(drawn.thickness_um)
    for row, colours in enumerate((drawn.black, drawn.white)):
        for k, colour in enumerate(colours):
            axes.axvspan(k, k + 1, row / 2, row / 2 + 0.5, color=colour.display_code)
    axes.set_xlim(0, count)
    axes.set_ylim(0, 2)
    axes.set_xticks([k + 0.5 for k in range(count)], [f"{t:.3g}" for t in drawn.thickness_um], fontsize=8)
    axes.set_yticks([0.5, 1.5], ["black", "white"], fontsize=8)
    axes.tick_params(length=0)


def _set_thickness_axis(axes: "Axes", drawn: Drawdown, labelled: bool) -> None:
    axes.set_xscale("log")
    axes.set_xlim(drawn.thickness_um[0], drawn.thickness_um[-1])
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(labelsize=8, labelbottom=labelled)
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
