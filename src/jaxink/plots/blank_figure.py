"""A figure outside pyplot: the user's backend, open figures and style stay as they are."""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO

import matplotlib
from matplotlib.figure import Figure

DPI = 130


class NotebookFigure(Figure):
    """A figure that shows itself as the last value of a notebook cell."""

    def _repr_png_(self) -> bytes:
        stream = BytesIO()
        self.savefig(stream, format="png", dpi=DPI)
        return stream.getvalue()


@contextmanager
def blank_figure(width_inch: float, height_inch: float) -> Iterator[NotebookFigure]:
    """An empty figure with matplotlib's default style while it is being drawn.

    Parameters
    ----------
    width_inch, height_inch
        Size.
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        yield NotebookFigure(figsize=(width_inch, height_inch))
