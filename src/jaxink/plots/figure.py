"""A figure without pyplot, and the common elements of all pages; positions in inches from the lower left."""

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
    """A figure that is displayed as the last value of a notebook cell."""

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
        """Title above a panel; axes titles are slower, because they are positioned at each drawing."""
        wide, tall = self.get_size_inches()
        self.text(x / wide, (y + 0.06) / tall, title, ha="center", fontsize=fontsize)

    def write_below(self, text: str, y: float, va: str = "top", fontsize: float = 9) -> None:
        """A centred line below the panels."""
        self.text(0.5, y / self.get_size_inches()[1], text, ha="center", va=va, fontsize=fontsize)

    def draw_colour_bar(self, drawn: "Collection", axes: "Axes", label: str) -> None:
        """Colour bar of a residual."""
        bar = self.colorbar(drawn, cax=axes, extend="both")
        bar.set_label(label, fontsize=9)
        bar.ax.tick_params(labelsize=8)

    def draw_line_legend(self, entries: Iterable[tuple[str, Style]], side_by_side: int | None = None) -> None:
        """Legend of lines, at the bottom; see `draw_legend`."""
        self.draw_legend([Line2D([], [], **style, label=text) for text, style in entries], side_by_side)

    def draw_legend(self, handles: list[Any], side_by_side: int | None = None) -> None:
        """Legend at the bottom, with so many entries in a row; None: all."""
        ncols = side_by_side or len(handles)
        self.legend(handles=handles, loc="lower center", ncols=ncols, frameon=False, fontsize=9)


@contextmanager
def blank_figure(width_inch: float, height_inch: float) -> Iterator[PageFigure]:
    """An empty figure, drawn with matplotlib's default style; the user's style is not changed."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        yield PageFigure(figsize=(width_inch, height_inch))


def set_angle_axis(axes: "Axes", labelled: bool) -> None:
    """Horizontal axis of signed polar angles, with a grid and without a frame."""
    set_angle_ticks(axes)
    axes.set_axisbelow(True)
    axes.grid(True, color="0.9", linewidth=0.6)
    axes.tick_params(labelsize=8, labelbottom=labelled)
    axes.spines[["top", "right"]].set_visible(False)


def set_angle_ticks(axes: "Axes") -> None:
    """Horizontal axis of signed polar angles."""
    axes.set_xlim(-90, 90)
    axes.set_xticks([-60, -30, 0, 30, 60])
