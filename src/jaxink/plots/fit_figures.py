"""Figures of a fit: scans of chosen wavelengths, one for each side, and the spectrum of many."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.plots.scan_views import (
    MOST_WAVELENGTHS,
    SIDES,
    ScanView,
    fit_wavelengths,
    headed,
    residual_label,
    residual_limit,
    scan_views,
    used_wavelengths,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from jaxink.fitting import FitResult
    from jaxink.plots.picture_files import Page

FIGURE_FOLDER = "figures"
FORMATS = ("png", "pdf", "svg")


def cut_figure(result: "FitResult", wavelength_nm: float, side: str) -> "Figure":
    """Measured and fitted in-plane scans with residuals, for every incidence.

    Parameters
    ----------
    result
        The fit.
    wavelength_nm
        Which wavelength.
    side
        ``R`` or ``T``.

    Raises
    ------
    InputRefusedError
        If the result has no such scan, or fewer than five in-plane points at every incidence.
    """
    from jaxink.plots.cuts import ResidualRow, cut_page

    views = used_views(result, wavelength_nm, side)
    if not any(view.has_cut for view in views):
        raise InputRefusedError(
            f"{side} at {wavelength_nm:g} nm: no scan has five points in the plane of incidence; use "
            "residual_map instead."
        )
    title = _title(result, wavelength_nm, side, "in-plane scans")
    return cut_page([views], [ResidualRow(residual_label(result), 0, residual_limit(views, True))], title)


def residual_map(result: "FitResult", wavelength_nm: float, side: str) -> "Figure":
    """Residuals over (theta_o, phi), one disc for each incidence, on one scale.

    Parameters
    ----------
    result, wavelength_nm, side
        As for `cut_figure`.

    Raises
    ------
    InputRefusedError
        If the result has no such scan.
    """
    from jaxink.plots.discs import DiscLayout, draw_discs
    from jaxink.plots.figure import blank_figure

    views = used_views(result, wavelength_nm, side)
    what = "residuals over all viewing directions"
    if not any(view.has_cut for view in views):
        what += " (too few in-plane points)"
    title = _title(result, wavelength_nm, side, what)
    with blank_figure(*DiscLayout(len(views)).size) as page:
        draw_discs(page, views, title, residual_limit(views, False), residual_label(result))
    return page


def residual_shape_figure(result: "FitResult", wavelength_nm: float, side: str) -> "Figure":
    """The relative residual of a misfit, and the part of it that smooth modes carry, on one scale.

    Parameters
    ----------
    result, wavelength_nm, side
        As for `cut_figure`.

    Raises
    ------
    InputRefusedError
        If the result has no such scan, or is no misfit.
    """
    from jaxink.plots.shape_page import shape_page

    used_views(result, wavelength_nm, side)
    shape = result.residual_shape
    if shape is None:
        raise InputRefusedError("the result is no misfit, so its residual has no shape; see result.verdict.")
    title = _title(result, wavelength_nm, side, "shape of the residual")
    return shape_page(result.data, result.predicted_per_sr, shape, wavelength_nm, side, title)


def figures(
    result: "FitResult", wavelengths_nm: Sequence[float] | None = None
) -> Iterator[tuple[str, "Figure"]]:
    """Draw all figures of a result, one after the other.

    Parameters
    ----------
    result
        The fit.
    wavelengths_nm
        Whose scans are drawn; None for all, of more than three for the three that are fitted worst.

    Yields
    ------
    name, figure
        ``cuts_R_550nm`` for data in the plane of incidence, ``residual_map_R_550nm`` for data out of it,
        ``residual_shape_R_550nm`` for a misfit, and ``spectrum`` for more than three wavelengths.

    Raises
    ------
    InputRefusedError
        If the result has no scan at one of the wavelengths.
    """
    for name, draw in fit_pages(result, wavelengths_nm):
        yield name, draw()


def fit_pages(result: "FitResult", wavelengths_nm: Sequence[float] | None = None) -> Iterator["Page"]:
    """The same figures, each to be drawn by a call."""
    held = used_wavelengths(result.data)
    if len(held) > MOST_WAVELENGTHS:
        yield "spectrum", partial(_spectrum, result)
    shown = fit_wavelengths(result) if wavelengths_nm is None else _held(held, wavelengths_nm)
    pages = sorted({(s.wavelength_nm, s.side) for s in result.data.scans if s.used})
    for wavelength_nm, side in pages:
        if wavelength_nm not in shown:
            continue
        views = used_views(result, wavelength_nm, side)
        name = f"{side}_{wavelength_nm:g}nm"
        has_cut = any(view.has_cut for view in views)
        if has_cut:
            yield f"cuts_{name}", partial(cut_figure, result, wavelength_nm, side)
        if not has_cut or any((view.used & ~view.in_plane).any() for view in views):
            yield f"residual_map_{name}", partial(residual_map, result, wavelength_nm, side)
        if result.residual_shape is not None and result.residual_shape.modes:
            yield f"residual_shape_{name}", partial(residual_shape_figure, result, wavelength_nm, side)


def _spectrum(result: "FitResult") -> "Figure":
    from jaxink.plots.spectra import spectrum_figure

    return spectrum_figure(result)


def _held(held: Sequence[float], asked: Sequence[float]) -> list[float]:
    """The wavelengths of a measurement that are asked for; rejected if one has no used points."""
    found = []
    for wavelength_nm in asked:
        near = [wave for wave in held if abs(wave - wavelength_nm) < 1e-6]
        if not near:
            raise InputRefusedError(
                f"a figure is asked for at {wavelength_nm:g} nm; the measurement has used points at "
                f"{', '.join(f'{wave:g}' for wave in held)} nm."
            )
        found += near
    return found


def save_figures(
    result: "FitResult",
    folder: str | Path,
    formats: Sequence[str] = ("png",),
    wavelengths_nm: Sequence[float] | None = None,
) -> list[Path]:
    """Draw and write all figures of a result.

    Parameters
    ----------
    result
        The fit.
    folder
        Created if it does not exist.
    formats
        Any of ``png``, ``pdf`` and ``svg``.
    wavelengths_nm
        See `figures`.

    Raises
    ------
    InputRefusedError
        For another format, or a wavelength that was not fitted.
    """
    for suffix in formats:
        if suffix not in FORMATS:
            raise InputRefusedError(
                f"figures cannot be written as '{suffix}'; choose from {', '.join(FORMATS)}."
            )
    from jaxink.plots.figure import DPI

    folder = Path(folder)
    files = []
    for name, figure in figures(result, wavelengths_nm):
        folder.mkdir(parents=True, exist_ok=True)
        for suffix in formats:
            files.append(folder / f"{name}.{suffix}")
            figure.savefig(files[-1], dpi=DPI)
    return files


def used_views(result: "FitResult", wavelength_nm: float, side: str) -> list[ScanView]:
    """Scans of one wavelength and side that have used points; rejected if there is none."""
    views = [view for view in scan_views(result, wavelength_nm, side) if view.used.any()]
    if not views:
        held = sorted({f"{s.side} at {s.wavelength_nm:g} nm" for s in result.data.scans if s.used})
        raise InputRefusedError(
            f"the result has no {side} at {wavelength_nm:g} nm; it has {', '.join(held)}."
        )
    return views


def _title(result: "FitResult", wavelength_nm: float, side: str, what: str) -> str:
    fit = f"{result.method} fit{_misfit_words(result)}"
    if not result.converged:
        fit += ", DID NOT CONVERGE"
    return f"{headed(result, f'{SIDES[side]} at {wavelength_nm:g} nm, {what}')}\n{fit}"


def _misfit_words(result: "FitResult") -> str:
    """Reduced chi-square, by the weights of the sample if it has any, as they were minimised."""
    merit, whitened = result.merit, result.whitened
    if merit.reduced_chi_square is None or whitened is None or merit.degrees_of_freedom is None:
        return ""
    if not result.sample.weights:
        return f", reduced χ² {merit.reduced_chi_square:.4g} over all scans"
    from jaxink.fitting import weights_of

    weight = weights_of(result.data, result.sample)
    freedom = np.count_nonzero(weight) - (merit.points - merit.degrees_of_freedom)
    if freedom <= 0:
        return ", no degree of freedom with its weights"
    return f", weighted reduced χ² {np.sum(weight * whitened**2) / freedom:.4g} over the scans that weigh"
