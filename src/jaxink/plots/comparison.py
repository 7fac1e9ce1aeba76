"""Several fits of one measurement in one figure."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.plots.cuts import BEFORE, FITTED, ResidualRow, cut_page
from jaxink.plots.figure import PageFigure, Style
from jaxink.plots.fit_figures import used_views
from jaxink.plots.scan_views import SIDES, headed, residual_limit

if TYPE_CHECKING:
    from jaxink.fitting import FitResult


_STYLES: tuple[Style, ...] = (
    FITTED,
    BEFORE,
    {"color": "#2a8f4f", "linewidth": 1.2, "linestyle": (0, (5, 1.5, 1, 1.5))},
    {"color": "#d18a1b", "linewidth": 1.2, "linestyle": (0, (1, 1.2))},
)


def comparison_figure(
    results: "Sequence[FitResult] | Mapping[str, FitResult]", wavelength_nm: float, side: str
) -> PageFigure:
    """Measured in-plane scans with several fits to them, and a row of residuals for each fit.

    All rows of residuals have the same scale.

    Parameters
    ----------
    results
        Two to four fits of the same measurement; a mapping names them, otherwise their methods do.
    wavelength_nm, side
        As for `cut_figure`.

    Raises
    ------
    InputRefusedError
        If there are fewer or more fits, they are of different measurements, or have no such scan.
    """
    named = named_results(results)
    if not 2 <= len(named) <= len(_STYLES):
        raise InputRefusedError(f"results has {len(named)} fits; a comparison takes 2 to {len(_STYLES)}.")
    first = next(iter(named.values()))
    for name, result in named.items():
        if not _are_same(first.data.directions, result.data.directions):
            raise InputRefusedError(
                f"'{name}' is a fit of another measurement than the first; compare fits of one measurement."
            )
    states = [used_views(result, wavelength_nm, side) for result in named.values()]
    if len({len(views) for views in states}) > 1:
        raise InputRefusedError("the fits use different scans; give them the same masks.")
    if not any(view.has_cut for view in states[0]):
        raise InputRefusedError(
            f"{side} at {wavelength_nm:g} nm: no scan has five points in the plane of incidence."
        )
    limit = max(residual_limit(views, True) for views in states)
    unit = "[%]" if first.whitened is None else "[σ]"
    rows = [ResidualRow(f"{name} {unit}", number, limit) for number, name in enumerate(named)]
    title = headed(first, f"{SIDES[side]} at {wavelength_nm:g} nm, in-plane scans and residuals")
    return cut_page(states, rows, title, dict(zip(named, _STYLES, strict=False)))


def _are_same(first, other) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(first, other, strict=True))


def named_results(
    results: "FitResult | Sequence[FitResult] | Mapping[str, FitResult]",
) -> "dict[str, FitResult]":
    """Fits by the names to show: those of a mapping, or their methods, numbered where several are alike."""
    if isinstance(results, Mapping):
        return dict(results)
    named: dict[str, FitResult] = {}
    for result in list(results) if isinstance(results, Sequence) else [results]:
        same = sum(name.split(" ")[0] == result.method for name in named)
        named[f"{result.method} {same + 1}" if same else result.method] = result
    return named
