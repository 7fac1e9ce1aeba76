"""What was fitted against the wavelength, with error bars, and the misfit at each wavelength."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.numerics.digits import with_uncertainty
from jaxink.plots.cuts import BEFORE, FITTED
from jaxink.plots.figure import PageFigure, Style, blank_figure
from jaxink.plots.scan_views import headed, used_wavelengths

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from jaxink.fitting import FitResult

_STYLES: tuple[Style, ...] = (FITTED, BEFORE)
# Goes with the reduced scattering.
_NOT_DRAWN = "reduced_optical_thickness"
_COLUMNS, _LEFT, _PANEL, _BESIDE, _RIGHT = 2, 0.85, 3.2, 0.85, 0.2
_TOP, _BOTTOM, _HEIGHT, _BETWEEN = 0.75, 0.85, 1.65, 0.6


class Curve(NamedTuple):
    """A quantity of one fit against the wavelength; errors are nan where there is none.

    ``is_shared``: whether it is one parameter for all wavelengths, of which each entry repeats the value.
    """

    wavelength_nm: np.ndarray
    value: np.ndarray
    error: np.ndarray
    is_shared: bool = False


def spectrum_figure(results: "FitResult | Mapping[str, FitResult]") -> PageFigure:
    """Optical properties of each scattering layer, other free parameters, and the misfit, by wavelength.

    Bars are standard errors; a fit that is a misfit has none, because they would be meaningless. A parameter
    that all wavelengths share is a level line with its value, in a band of its standard error.

    Parameters
    ----------
    results
        One fit, or two of the same measurement by the names to show.

    Raises
    ------
    InputRefusedError
        If there are more than two fits, or the measurement has one wavelength.
    """
    named = dict(results) if isinstance(results, Mapping) else {"fitted": results}
    if not 1 <= len(named) <= len(_STYLES):
        raise InputRefusedError(f"results has {len(named)} fits; a spectrum takes 1 or {len(_STYLES)}.")
    first = next(iter(named.values()))
    if len(used_wavelengths(first.data)) < 2:
        raise InputRefusedError(
            "the measurement has one wavelength; a spectrum needs two, use cut_figure for its scans."
        )
    curves = {name: quantities(result) for name, result in named.items()}
    heads = list(dict.fromkeys(head for of in curves.values() for head in of))
    n_rows = -(-(len(heads) + 1) // _COLUMNS)
    size = (
        _LEFT + _COLUMNS * _PANEL + (_COLUMNS - 1) * _BESIDE + _RIGHT,
        _TOP + n_rows * _HEIGHT + (n_rows - 1) * _BETWEEN + _BOTTOM,
    )
    with blank_figure(*size) as figure:
        figure.write_title(headed(first, "fitted quantities against wavelength"))
        for i, head in enumerate([*heads, ""]):
            row, column = divmod(i, _COLUMNS)
            x = _LEFT + column * (_PANEL + _BESIDE)
            y = size[1] - _TOP - (row + 1) * _HEIGHT - row * _BETWEEN
            axes = figure.panel(x, y, _PANEL, _HEIGHT)
            title = head or misfit_label(first)
            figure.write_panel_title(title, x + _PANEL / 2, y + _HEIGHT, fontsize=9)
            for style, (name, result) in zip(_STYLES, named.items(), strict=False):
                curve = curves[name].get(head) if head else misfit(result)
                if curve is not None:
                    _draw(axes, curve, style)
            _finish(axes, from_zero=not head)
        figure.write_below("wavelength [nm]", 0.5)
        figure.draw_line_legend(
            (f"{name}{_bars(named[name])}", {**style, "marker": "o", "markersize": 3})
            for style, name in zip(_STYLES, named, strict=False)
        )
    return figure


def quantities(result: "FitResult") -> dict[str, Curve]:
    """Quantities that change with the wavelength, by their names in words."""
    points: dict[str, list[tuple[float, float, float | None]]] = {}
    shared = set[str]()
    drawn = [d for d in result.derived if d.quantity != _NOT_DRAWN]
    several = len({d.layer for d in drawn}) > 1
    for d in drawn:
        head = _head(d.optical_property.words, d.optical_property.unit)
        head = f"{d.layer}: {head}" if several else head
        points.setdefault(head, []).append((d.wavelength_nm, d.value, d.standard_error))
        if f"{d.layer}.{d.quantity}" in result.parameters:
            shared.add(head)
    derived = {f"{d.layer}.{d.quantity}" for d in drawn}
    for p in result.parameters.free:
        stem, _, wavelength = p.name.partition("@")
        if wavelength and stem not in derived:
            points.setdefault(_head(stem, p.unit), []).append((float(wavelength), p.value, p.standard_error))
    holds = result.verdict.standard_errors_hold
    return {head: _curve(rows, holds, head in shared) for head, rows in points.items()}


def _head(words: str, unit: str) -> str:
    return f"{words} [{unit}]" if unit else words


def misfit(result: "FitResult") -> Curve:
    """Root mean square of the residual at each wavelength: in sigma, or in per cent of the fit."""
    data = result.data
    residual = result.whitened
    if residual is None:
        residual = 100 * (data.bsdf_per_sr[data.used] / result.predicted_per_sr - 1)
    waves, at = np.array(used_wavelengths(data)), data.wavelength_nm[data.used]
    rms = np.array([np.sqrt(np.mean(residual[at == wave] ** 2)) for wave in waves])
    return Curve(waves, rms, np.full(waves.size, np.nan))


def misfit_label(result: "FitResult") -> str:
    """What `misfit` is."""
    return "rms of the residual [%]" if result.whitened is None else "rms of the residual [σ]"


def _curve(rows: list[tuple[float, float, float | None]], holds: bool, may_be_shared: bool) -> Curve:
    nm, value, error = (np.array(column, float) for column in zip(*sorted(_known(rows)), strict=True))
    is_shared = may_be_shared and bool(np.all(value == value[0]))
    return Curve(nm, value, error if holds else np.full(nm.size, np.nan), is_shared)


def _known(rows: list[tuple[float, float, float | None]]) -> Iterator[tuple[float, float, float]]:
    for nm, value, error in rows:
        yield nm, value, np.nan if error is None else error


def _bars(result: "FitResult") -> str:
    return "" if result.verdict.standard_errors_hold else " (a misfit: no standard errors)"


def _draw(axes: "Axes", curve: Curve, style: Style) -> None:
    colour = style["color"]
    if curve.is_shared:
        _draw_level(axes, curve, style)
        return
    axes.plot(curve.wavelength_nm, curve.value, **style, marker="o", markersize=3, zorder=2)
    known = np.isfinite(curve.error)
    if known.any():
        axes.errorbar(
            curve.wavelength_nm[known],
            curve.value[known],
            curve.error[known],
            fmt="none",
            ecolor=colour,
            elinewidth=1.0,
            capsize=2,
            zorder=3,
        )


def _draw_level(axes: "Axes", curve: Curve, style: Style) -> None:
    value, error = float(curve.value[0]), float(curve.error[0])
    ends = curve.wavelength_nm[[0, -1]]
    axes.plot(ends, [value, value], **style, zorder=2)
    known = np.isfinite(error)
    if known:
        axes.fill_between(ends, value - error, value + error, color=style["color"], alpha=0.2, linewidth=0)
    text = f"{with_uncertainty(value, error if known else None)}, all wavelengths"
    axes.annotate(
        text,
        (ends.mean(), value),
        (0, 4),
        textcoords="offset points",
        ha="center",
        fontsize=8,
        color=style["color"],
    )


def _finish(axes: "Axes", from_zero: bool) -> None:
    axes.set_axisbelow(True)
    axes.grid(True, color="0.9", linewidth=0.6)
    axes.tick_params(labelsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    axes.ticklabel_format(axis="y", useOffset=False)
    if from_zero:
        # The margin that the axes chose is a share of the range of the values, and may cut the markers.
        axes.set_ylim(0, 1.08 * axes.get_ylim()[1])
