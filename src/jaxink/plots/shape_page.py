"""The shape of a residual: the relative residual beside the part of it that smooth modes carry."""

from typing import TYPE_CHECKING

import numpy as np

from jaxink.plots.discs import DiscLayout, draw_discs
from jaxink.plots.figure import PageFigure, blank_figure
from jaxink.plots.scan_views import SIDES, ScanView, residual_limit, views_of
from jaxink.plots.strips import StripLayout, draw_strips

if TYPE_CHECKING:
    from jaxink.measurement import GonioData
    from jaxink.residual import ResidualShape

STATES = ("residual", "its smooth modes")
_LABEL = "measured / model - 1 [%]"


def shape_page(
    data: "GonioData",
    predicted_per_sr: np.ndarray,
    shape: "ResidualShape",
    wavelength_nm: float,
    side: str,
    title: str,
) -> PageFigure:
    """Both parts of one wavelength and side on one scale: strips in the plane of incidence, else discs.

    Parameters
    ----------
    data
        The measurement.
    predicted_per_sr
        The model at the used points.
    shape
        Of its residual.
    wavelength_nm, side
        What to draw.
    title
        Title of the page.
    """
    relative = 100 * (data.bsdf_per_sr[data.used] / predicted_per_sr - 1)
    found = [
        [view for view in views_of(data, predicted_per_sr, part, wavelength_nm, side) if view.used.any()]
        for part in (relative, 100 * shape.relative)
    ]
    if all(np.all(view.in_plane[view.used]) for view in found[0]):
        return _strips(found, side, title)
    views = [view for pair in zip(*found, strict=True) for view in pair]
    with blank_figure(*DiscLayout(len(views), len(STATES)).size) as page:
        draw_discs(page, views, title, _limit(found, False), _LABEL, STATES)
    return page


def _strips(found: list[list[ScanView]], side: str, title: str) -> PageFigure:
    row = [(f"{SIDES[side]}, {state}", views) for state, views in zip(STATES, found, strict=True)]
    with blank_figure(*StripLayout((len(found[0]),), len(STATES)).size) as page:
        draw_strips(page, [row], title, _limit(found, True), _LABEL)
    return page


def _limit(found: list[list[ScanView]], in_plane: bool) -> float:
    return residual_limit([view for views in found for view in views], in_plane)
