"""Figures of an ink put back as a sheet: measurement, full model and sheet in the plane of incidence."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxink.ink.sheet import Sheet
from jaxink.measurement import GonioData
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.plots.figure import DPI, blank_figure
from jaxink.plots.scan_views import IN_PLANE_DEG
from jaxink.sample import Sample

# Signed polar angles of the lines: positive on the side of the specular and of the undeviated direction.
SIGNED_DEG = np.arange(-87.5, 87.6, 0.5)
_MEASURED = {
    "color": "black",
    "marker": "o",
    "markersize": 2.4,
    "markerfacecolor": "none",
    "linestyle": "none",
}
_MODEL = {"color": "#c22f2f", "linewidth": 2.6, "alpha": 0.45}
_SHEET = {"color": "#1f4e9c", "linewidth": 1.1}
_SIDES = {"R": "Reflection", "T": "Transmission"}


@dataclass(frozen=True)
class Lines:
    """Full model and sheet along `SIGNED_DEG`, shapes ``(sides, incidences, angles)``, R before T."""

    theta_i_deg: tuple[float, ...]
    wavelength_nm: float
    model: np.ndarray
    sheet: np.ndarray


def lines(sample: Sample, of_ink: Sheet, theta_i_deg: tuple[float, ...]) -> Lines:
    """Compute the lines of a sample and of its sheet at some incidences, lit from the plate."""
    theta_o, phi = np.abs(SIGNED_DEG), np.where(SIGNED_DEG < 0, 0.0, 180.0)
    side, incidence, _ = np.meshgrid([False, True], theta_i_deg, SIGNED_DEG, indexing="ij")
    columns = [np.broadcast_to(c, side.shape).ravel() for c in (incidence, theta_o, phi)]
    wavelength = of_ink.table.wavelength_nm[of_ink.wavelength]
    model = ForwardModel(sample, *columns, np.full(side.size, wavelength), side.ravel())
    found = [
        [of_ink.bsdf(0, theta_i, theta_o, phi, np.full(len(phi), to)) for theta_i in theta_i_deg]
        for to in (False, True)
    ]
    return Lines(theta_i_deg, float(wavelength), evaluate(model).reshape(side.shape), np.array(found))


def draw(data: GonioData, drawn: Lines, side: str, title: str, path: Path) -> None:
    """Draw one side: BSDF above, differences from the full model below; a column for each incidence."""
    at = "RT".index(side)
    n = len(drawn.theta_i_deg)
    with blank_figure(0.7 + 2.35 * n, 5.2) as figure:
        axes = figure.subplots(2, n, sharex=True, sharey="row", gridspec_kw={"height_ratios": [2.4, 1]})
        for column, theta_i in enumerate(drawn.theta_i_deg):
            above, below = axes[:, column]
            model, of_sheet = drawn.model[at, column], drawn.sheet[at, column]
            signed, measured = _measured(data, drawn.wavelength_nm, theta_i, side)
            above.plot(SIGNED_DEG, model, **_MODEL, label="full model of the stack")
            above.plot(SIGNED_DEG, of_sheet, **_SHEET, label="table as a sheet on the plate")
            above.plot(signed, measured, **_MEASURED, label="measurement (simulated)", zorder=3)
            top = model.max()
            below.axhline(0, **_MODEL)
            expected = np.interp(signed, SIGNED_DEG, model)
            below.plot(signed, 100 * (measured - expected) / top, **_MEASURED)
            below.plot(SIGNED_DEG, 100 * (of_sheet - model) / top, **_SHEET)
            above.set_title(f"incidence {theta_i:g}°", fontsize=10)
            for axis in (above, below):
                axis.grid(True, color="0.9", linewidth=0.6)
                axis.set_axisbelow(True)
                axis.tick_params(labelsize=8)
                axis.spines[["top", "right"]].set_visible(False)
        axes[0, 0].set_yscale("log")
        _label_decades(axes[0, 0])
        axes[1, 0].set_xlim(-90, 90)
        axes[1, 0].set_xticks([-60, -30, 0, 30, 60])
        axes[0, 0].set_ylabel("BSDF [1/sr]", fontsize=9)
        axes[1, 0].set_ylabel("minus full model\n[% of its maximum]", fontsize=9)
        figure.suptitle(f"{title}: {_SIDES[side].lower()}", fontsize=11, y=0.985)
        handles, labels = axes[0, 0].get_legend_handles_labels()
        where = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.955)}
        figure.legend(handles, labels, ncols=3, fontsize=9, frameon=False, **where)
        bottom = "polar angle of view [°], negative on the source's side"
        figure.text(0.5, 0.012, bottom, ha="center", fontsize=9)
        left = 0.75 / figure.get_figwidth()
        figure.subplots_adjust(left=left, right=0.99, top=0.84, bottom=0.11, wspace=0.1, hspace=0.08)
        figure.savefig(path, dpi=DPI)


def _measured(data: GonioData, wavelength_nm: float, theta_i: float, side: str):
    """Used points in the plane of incidence: signed polar angles and values."""
    forward = np.abs(data.phi_deg - 180) <= IN_PLANE_DEG
    plane = forward | (np.abs((data.phi_deg + 180) % 360 - 180) <= IN_PLANE_DEG)
    plane &= data.used & (data.wavelength_nm == wavelength_nm)
    here = plane & (data.theta_i_deg == theta_i) & (data.is_transmission == (side == "T"))
    return np.where(forward, 1, -1)[here] * data.theta_o_deg[here], data.bsdf_per_sr[here]


def _label_decades(axis) -> None:
    """Plain decimals at a few values, whatever the span."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

    low, high = axis.get_ylim()
    subs = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if high / low < 8 else (1.0, 2.0, 5.0)
    axis.yaxis.set_major_locator(LogLocator(subs=subs))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.yaxis.set_minor_locator(NullLocator())
