"""In-plane lobes in polar coordinates: measured and fitted, or of an ink table."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.ticker import MaxNLocator

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.plots.cuts import MEASURED, with_gaps
from jaxink.plots.figure import PageFigure, blank_figure
from jaxink.plots.fit_figures import used_views
from jaxink.plots.scan_views import SIDES, headed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.projections.polar import PolarAxes

    from jaxink.fitting import FitResult
    from jaxink.ink import InkTable

_WIDTH, _HEIGHT, _DISC, _BELOW = 7.2, 5.0, 5.6, 1.2
_VIEW_DEG = np.linspace(-89.0, 89.0, 357)


def lobe_figure(result: "FitResult", wavelength_nm: float, side: str) -> PageFigure:
    """Measured and fitted BSDF in the plane of incidence as polar lobes, one colour for each incidence.

    Parameters
    ----------
    result, wavelength_nm, side
        As for `cut_figure`.

    Raises
    ------
    InputRefusedError
        If the result has no such scan, or none with five points in the plane of incidence.
    """
    views = [view for view in used_views(result, wavelength_nm, side) if view.has_cut]
    if not views:
        raise InputRefusedError(
            f"{side} at {wavelength_nm:g} nm: no scan has five points in the plane of incidence."
        )
    title = headed(result, f"{SIDES[side]} at {wavelength_nm:g} nm,\nin-plane BSDF [1/sr]")
    with blank_figure(_WIDTH, _HEIGHT) as page:
        axes = _half_disc(page, title)
        entries = []
        for view, colour in zip(views, _colours(len(views)), strict=True):
            shown = view.in_plane & view.used
            order = np.argsort(view.signed_deg[shown], kind="stable")
            angle = np.deg2rad(view.signed_deg[shown][order])
            curve_deg, curve = with_gaps(view.signed_deg[shown][order], view.fitted[shown][order])
            axes.plot(np.deg2rad(curve_deg), curve, color=colour, linewidth=1.3)
            axes.plot(angle, view.measured[shown][order], **{**MEASURED, "color": colour})
            entries.append((f"{view.theta_i_deg:g}°", {"color": colour, "linewidth": 1.3}))
        page.draw_line_legend([*entries, ("measured", MEASURED)])
    return page


def table_lobe_figure(
    table: "InkTable",
    component: str,
    incidences_deg: Sequence[float] = (0.0, 30.0, 60.0),
    wavelength: int = 0,
) -> PageFigure:
    """BSDF of an ink table in the plane of incidence as polar lobes, without the regular part.

    Parameters
    ----------
    table
        The ink table.
    component
        ``R_II``, ``T_IA``, ``T_AI`` or ``R_AA``.
    incidences_deg
        Polar angles of incidence in the medium of the incident side.
    wavelength
        Index of the wavelength.

    Raises
    ------
    InputRefusedError
        If there is no such component.
    """
    from jaxink.ink import COMPONENTS

    require_one_of("component", component, COMPONENTS)
    phi = np.where(_VIEW_DEG < 0, 0.0, 180.0)
    title = f"Ink, {component} at {table.wavelength_nm[wavelength]:g} nm: in-plane BSDF [1/sr]"
    with blank_figure(_WIDTH, _HEIGHT) as page:
        axes = _half_disc(page, title)
        entries = []
        for theta_deg, colour in zip(incidences_deg, _colours(len(incidences_deg)), strict=True):
            values = table.interpolated(component, theta_deg, np.abs(_VIEW_DEG), phi, wavelength)
            axes.plot(np.deg2rad(_VIEW_DEG), values, color=colour, linewidth=1.3)
            entries.append((f"{theta_deg:g}°", {"color": colour, "linewidth": 1.3}))
        page.draw_line_legend(entries)
    return page


def _half_disc(page: PageFigure, title: str) -> "Axes":
    """Half a disc of viewing angles with the normal upwards."""
    page.write_title(title)
    # matplotlib puts half a disc into the middle of a square, whose lower quarter leaves the page.
    square = page.panel((_WIDTH - _DISC) / 2, _BELOW - _DISC / 4, _DISC, _DISC, projection="polar")
    axes = cast("PolarAxes", square)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    axes.set_thetalim(-np.pi / 2, np.pi / 2)
    axes.set_xticks(np.deg2rad([-90, -60, -30, 0, 30, 60, 90]))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=8)
    axes.grid(True, color="0.88", linewidth=0.6)
    axes.set_axisbelow(True)
    page.write_below("viewing angle, negative towards the source; colours: angle of incidence", 0.65)
    return axes


def _colours(count: int) -> list[str]:
    """Colours that remain distinct in greyscale."""
    from matplotlib import colormaps

    return [to_hex(colormaps["viridis"](share)) for share in np.linspace(0.0, 0.85, max(count, 2))[:count]]
