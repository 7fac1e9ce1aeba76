"""A figure outside pyplot, with what all pages have in common; places are in inches, from below left."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from io import BytesIO
from typing import TYPE_CHECKING, Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection

DPI = 130
# Options of lines, as matplotlib names them.
Style = dict[str, Any]


class PageFigure(Figure):
    """A figure that shows itself as the last value of a notebook cell."""

    def _repr_png_(self) -> bytes:
        return self.png()

    def png(self) -> bytes:
        """The content of a PNG file."""
        stream = BytesIO()
        self.savefig(stream, format="png", dpi=DPI)
        return stream.getvalue()

    def panel(self, x: float, y: float, width: float, height: float, **options: Any) -> "Axes":
        """Axes whose lower left corner is at x, y."""
        wide, tall = self.get_size_inches()
        return self.add_axes((x / wide, y / tall, width / wide, height / tall), **options)

    def write_title(self, title: str) -> None:
        """Title at the top."""
        top = 1 - 0.08 / self.get_size_inches()[1]
        self.text(0.5, top, title, ha="center", va="top", fontsize=11, linespacing=1.35)

    def write_panel_title(self, title: str, x: float, y: float, fontsize: float = 10) -> None:
        """Title above a panel; not that of its axes, whose place would be sought anew at each drawing."""
        wide, tall = self.get_size_inches()
        self.text(x / wide, (y + 0.06) / tall, title, ha="center", fontsize=fontsize)

    def write_below(self, text: str, y: float, va: str = "top", fontsize: float = 9) -> None:
        """A line in the middle, below the panels."""
        self.text(0.5, y / self.get_size_inches()[1], text, ha="center", va=va, fontsize=fontsize)

    def draw_colour_bar(self, drawn: "Collection", axes: "Axes", label: str) -> None:
        """Colour bar of a residual."""
        bar = self.colorbar(drawn, cax=axes, extend="both")
        bar.set_label(label, fontsize=9)
        bar.ax.tick_params(labelsize=8)

    def draw_line_legend(self, entries: Iterable[tuple[str, Style]]) -> None:
        """Legend of lines, at the bottom."""
        handles = [Line2D([], [], **style, label=text) for text, style in entries]
        self.draw_legend(handles)

    def draw_legend(self, handles: list[Any]) -> None:
        """Legend at the bottom."""
        self.legend(handles=handles, loc="lower center", ncols=len(handles), frameon=False, fontsize=9)


@contextmanager
def blank_figure(width_inch: float, height_inch: float) -> Iterator[PageFigure]:
    """An empty figure with matplotlib's default style while it is being drawn; the user's stays as it is.

    Parameters
    ----------
    width_inch, height_inch
        Size.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        yield PageFigure(figsize=(width_inch, height_inch))


def set_angle_axis(axes: "Axes", labelled: bool) -> None:
    """Signed polar angle across, a grid, no frame."""
    set_angle_ticks(axes)
    axes.set_axisbelow(True)
    axes.grid(True, color="0.9", linewidth=0.6)
    axes.tick_params(labelsize=8, labelbottom=labelled)
    axes.spines[["top", "right"]].set_visible(False)


def set_angle_ticks(axes: "Axes") -> None:
    """Signed polar angle across."""
    axes.set_xlim(-90, 90)
    axes.set_xticks([-60, -30, 0, 30, 60])
