"""Figures as contents of files; one that cannot be drawn costs itself only."""

from collections.abc import Callable, Iterable, Sequence
from io import BytesIO
from typing import TYPE_CHECKING

from jaxink.numerics.failures import Failures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Name of a figure, and what draws it.
Page = tuple[str, Callable[[], "Figure"]]


def pictures(
    pages: Iterable[Page], failures: Failures, formats: Sequence[str] = ("png",)
) -> dict[str, bytes]:
    """Draw figures one after the other.

    Parameters
    ----------
    pages
        Names and what draws them; those before one that cannot be listed are drawn.
    failures
        Takes note of what cannot be drawn, matplotlib itself included.
    formats
        Any of ``png``, ``pdf`` and ``svg``.

    Returns
    -------
    dict
        Contents of the files by their names.
    """
    found = {}
    with failures.sparing("the drawing of figures", ""):
        from jaxink.plots.figure import DPI

        for name, draw in pages:
            with failures.sparing("the figure {}", name):
                figure = draw()
                for suffix in formats:
                    stream = BytesIO()
                    figure.savefig(stream, format=suffix, dpi=DPI)
                    found[f"{name}.{suffix}"] = stream.getvalue()
    return found
