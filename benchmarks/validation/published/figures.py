"""Figures of the published kind: measured solid, modelled dashed, at every incidence."""

from pathlib import Path

import numpy as np

from benchmarks.validation.published.fits import kept_sample
from benchmarks.validation.published.judgement import predictions
from benchmarks.validation.published.problems import COLOURED, EVERYTHING, PROTOCOL, SHEET, measured
from jaxink.measurement import GonioData
from jaxink.plots.figure import DPI, blank_figure

_COLOURS = ("#1f4e9c", "#2a8f8f", "#6a9c1f", "#d18a1b", "#c22f2f")
_ROWS = {PROTOCOL: "fitted by the published protocol", EVERYTHING: "fitted to all that was measured"}
# Of the coloured ink, three wavelengths are shown.
_SHOWN_NM = (570.0, 600.0, 630.0)


def draw(name: str, path: Path) -> None:
    """Draw one reconstruction: above the fit by the protocol, below that of everything."""
    ink = name.split("-")[0]
    rows = {words: predictions(name, kept_sample(name, scans)) for scans, words in _ROWS.items()}
    draw_fits(name, measured(ink), rows, path)


def draw_fits(name: str, data: tuple[GonioData, ...], rows: dict[str, list[np.ndarray]], path: Path) -> None:
    """Draw predictions, by their names, beside the measurements, for each face that is lit."""
    columns = _columns(name.split("-")[0], data)
    tall = 0.9 + 2.3 * len(rows)
    with blank_figure(1.0 + 3.0 * len(columns), tall) as figure:
        axes = figure.subplots(len(rows), len(columns), sharex=True, sharey="col", squeeze=False)
        for row, (words, predicted) in enumerate(rows.items()):
            for (title, face, side, wavelength), axis in zip(columns, axes[row], strict=True):
                chosen = (data[face].side == side) & (data[face].wavelength_nm == wavelength)
                _lines(axis, data[face], predicted[face], chosen)
                if row == 0:
                    axis.set_title(title, fontsize=10)
            axes[row, 0].set_ylabel(f"{words}\nBSDF [1/sr]", fontsize=9)
        axes[0, 0].set_xlim(-90, 90)
        axes[0, 0].set_xticks([-60, -30, 0, 30, 60])
        figure.suptitle(
            f"{name}: measured (simulated) solid, modelled dashed", fontsize=11, y=1 - 0.06 / tall
        )
        handles, labels = axes[0, 0].get_legend_handles_labels()
        where = {"loc": "upper center", "bbox_to_anchor": (0.5, 1 - 0.22 / tall)}
        figure.legend(handles, labels, ncols=5, fontsize=8, frameon=False, **where)
        bottom = "polar angle of view [°], negative on the source's side"
        figure.text(0.5, 0.06 / tall, bottom, ha="center", fontsize=9)
        left = 0.75 / figure.get_figwidth()
        figure.subplots_adjust(left=left, right=0.99, top=1 - 0.72 / tall, bottom=0.5 / tall)
        figure.savefig(path, dpi=DPI)


def _columns(ink: str, data: tuple[GonioData, ...]) -> list[tuple[str, int, str, float]]:
    """Title, face that is lit, side and wavelength of each column."""
    if ink == COLOURED:
        return [(f"R at {w:g} nm", 0, "R", w) for w in _SHOWN_NM]
    words = (", lit from the bottom", ", lit from the top")[: len(data)] if ink == SHEET else ("",)
    return [
        (f"{side}{word}", face, side, float(data[face].wavelength_nm[0]))
        for face, word in enumerate(words)
        for side in "RT"
    ]


def _lines(axis, data: GonioData, predicted: np.ndarray, chosen: np.ndarray) -> None:
    signed = np.where(data.phi_deg == 180, 1.0, -1.0) * data.theta_o_deg
    for incidence, colour in zip(np.unique(data.theta_i_deg), _COLOURS, strict=True):
        here = np.flatnonzero(chosen & (data.theta_i_deg == incidence))
        here = here[np.argsort(signed[here])]
        axis.plot(signed[here], data.bsdf_per_sr[here], color=colour, linewidth=1.1, label=f"{incidence:g}°")
        axis.plot(signed[here], predicted[here], color=colour, linewidth=1.1, linestyle=(0, (4, 2.5)))
    # A lobe around the undeviated beam would hide all else.
    values = data.bsdf_per_sr[chosen]
    if values.max() > 8 * np.median(values):
        axis.set_yscale("log")
    axis.grid(True, color="0.9", linewidth=0.6)
    axis.set_axisbelow(True)
    axis.tick_params(labelsize=8)
    axis.spines[["top", "right"]].set_visible(False)
