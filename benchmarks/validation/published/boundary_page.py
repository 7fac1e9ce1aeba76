"""Table and figure of the last step of 2018, for the page on the published protocols."""

from pathlib import Path

import numpy as np

from benchmarks.pages import page_path, rms, table
from benchmarks.validation.published.boundary import (
    BOUNDARY,
    ENTRIES,
    INCIDENCES_DEG,
    LOBES,
    PHOTONS_DEG,
    SIGNED_DEG,
    SMOOTH,
    SMOOTH_STACK,
    WHOLE,
    make,
)
from jaxink.plots.figure import blank_figure

FIGURE = page_path("published-boundary.png")
_DPI = 100
_SHOWN_DEG = (0.0, 30.0, 60.0)
_STYLES = {
    WHOLE: {"color": "#c22f2f", "linewidth": 3.0, "alpha": 0.45},
    BOUNDARY: {"color": "#1f4e9c", "linewidth": 1.2},
    ENTRIES: {"color": "#d18a1b", "linewidth": 1.2, "linestyle": (0, (4, 2))},
    SMOOTH: {"color": "0.45", "linewidth": 1.0, "linestyle": (0, (1, 1.5))},
}
_PHOTONS = {
    "color": "black",
    "marker": "o",
    "markersize": 2.6,
    "markerfacecolor": "none",
    "linestyle": "none",
}


def text() -> str:
    """Each boundary against the relief in the stack, and against the photons."""
    found = make()
    whole = np.array(found[WHOLE]["bsdf"])
    rows = []
    for name in (SMOOTH, ENTRIES, LOBES, BOUNDARY, WHOLE):
        bsdf, power = np.array(found[name]["bsdf"]), found[name].get("power")
        off = 100 * (bsdf / whole - 1)
        cells = [f"{name}, {found[name]['angles']} angles" if power else name]
        cells.append("" if power is None else f"{100 * power[0]:.1f} to {100 * power[1]:.1f}")
        for side in (0, 1):
            same = name == WHOLE
            cells.append(
                "" if same else f"{rms(off[side]):.2f} ({off[side].flat[np.abs(off[side]).argmax()]:+.2f})"
            )
        rows.append([*cells, *_against_photons(bsdf, found["photons"])])
    heads = ["outer face", "power of the table, %", "R, rms (largest), %", "T, rms (largest), %"]
    heads += ["photons over it, R", "T", "deviation from the photons, mean square"]
    return table(heads, rows)


def _against_photons(bsdf: np.ndarray, photons: dict) -> list[str]:
    """Mean ratio in R and T with its scatter over incidences, and mean square deviation."""
    here = bsdf[:, [INCIDENCES_DEG.index(theta) for theta in PHOTONS_DEG], ::2]
    seen, error = np.array(photons["bsdf"]), np.array(photons["error"])
    ratio = (seen / here).mean(axis=2)
    cells = [f"{r.mean():.3f} ({r.min():.3f} to {r.max():.3f})" for r in ratio]
    return [*cells, f"{np.mean(((seen - here) / error) ** 2):.1f}"]


def joining_percent() -> float:
    """Largest difference of the star product from the solver where both have a smooth face."""
    found = make()
    joined, solved = (np.array(found[name]["bsdf"]) for name in (SMOOTH, SMOOTH_STACK))
    return float(100 * np.abs(joined / solved - 1).max())


def seconds() -> float:
    """Processor time of everything that was computed."""
    return sum(part["seconds"] for part in make().values())


def picture() -> Path:
    """R above and T below at some incidences."""
    found = make()
    photons = np.array(found["photons"]["bsdf"])
    with blank_figure(9.6, 5.6) as figure:
        axes = figure.subplots(2, len(_SHOWN_DEG), sharex=True, sharey="row", squeeze=False)
        for side, of_side in enumerate(axes):
            for theta, axis in zip(_SHOWN_DEG, of_side, strict=True):
                at = INCIDENCES_DEG.index(theta)
                for name, style in _STYLES.items():
                    axis.plot(SIGNED_DEG, np.array(found[name]["bsdf"])[side, at], **style, label=name)
                seen = photons[side, PHOTONS_DEG.index(theta)]
                axis.plot(SIGNED_DEG[::2], seen, **_PHOTONS, label="Monte Carlo with facets")
                axis.grid(True, color="0.9", linewidth=0.6)
                axis.set_axisbelow(True)
                axis.tick_params(labelsize=8)
                axis.spines[["top", "right"]].set_visible(False)
                if side == 0:
                    axis.set_title(f"incidence {theta:g}°", fontsize=10)
            of_side[0].set_ylabel(f"{'RT'[side]}: BSDF [1/sr]", fontsize=9)
        axes[1, 0].set_yscale("log")
        axes[0, 0].set_xlim(-78, 78)
        axes[0, 0].set_xticks([-60, -30, 0, 30, 60])
        handles, labels = axes[0, 0].get_legend_handles_labels()
        where = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.945)}
        figure.suptitle("Sample 2 with its relief, and with a table in its place", fontsize=11, y=0.985)
        figure.legend(handles, labels, ncols=5, fontsize=8, frameon=False, **where)
        bottom = "polar angle of view [°], negative on the source's side"
        figure.text(0.5, 0.012, bottom, ha="center", fontsize=9)
        figure.subplots_adjust(left=0.075, right=0.99, top=0.85, bottom=0.09, wspace=0.08, hspace=0.1)
        figure.savefig(FIGURE, dpi=_DPI)
    return FIGURE
