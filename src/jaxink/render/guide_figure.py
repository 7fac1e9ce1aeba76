"""The picture of a light guide: its face with each way to model the dots, and the luminance along it."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from jaxink.render.lightguide import SHEET, UNCORRECTED, VOLUME, GuideRendering

_TITLES = {
    SHEET: "sheets: the ink's BSDF in the plate",
    VOLUME: "volumes: every scattering traced",
    UNCORRECTED: "sheets, model without correction",
}
_COLOURS = {SHEET: "tab:blue", VOLUME: "black", UNCORRECTED: "tab:red"}
_DPI, _BRIGHTEST = 110, 0.99


def guide_figure(rendering: GuideRendering) -> Figure:
    """Luminance across the face, one panel for each way, and along the guide below."""
    lights, guide = rendering.lights, rendering.guide
    names = [light.name for light in lights]
    figure = Figure(figsize=(max(6.5, 3.3 * len(lights)), 4.4), layout="constrained")
    mosaic: Any = [names, ["along"] * len(names)]
    axes = figure.subplot_mosaic(mosaic, height_ratios=[1.15, 1])
    # One scale, on which single bright bins do not count.
    top = float(np.quantile(lights[0].picture @ lights[0].luminance_weights, _BRIGHTEST))
    for light in lights:
        panel, flux = axes[light.name], light.efficiency
        drawn = panel.imshow(
            light.picture @ light.luminance_weights,
            origin="lower",
            extent=(0, guide.length_mm, 0, guide.width_mm),
            vmin=0,
            vmax=top,
            cmap="inferno",
            interpolation="nearest",
        )
        panel.set_title(
            f"{_TITLES[light.name]}\nflux out / flux in {100 * flux.value:.1f} ± {100 * flux.error:.1f} %",
            fontsize=9,
        )
        panel.tick_params(labelsize=8)
    axes[names[0]].set_ylabel("mm (lamp at the left)", fontsize=8)
    figure.colorbar(drawn, ax=[axes[name] for name in names], shrink=0.8).set_label(
        "luminance / lamp's", fontsize=8
    )
    below = axes["along"]
    for light in lights:
        is_volume = light.name == VOLUME
        below.errorbar(
            guide.columns_mm,
            100 * light.profile.value,
            100 * light.profile.error,
            color=_COLOURS[light.name],
            marker="." if is_volume else None,
            linestyle="none" if is_volume else "-",
            capsize=2,
            label=light.name,
        )
    below.set(xlabel="distance from the lamp, mm", xlim=(0, guide.length_mm))
    below.set_ylabel("luminance, % of the lamp's")
    below.set_ylim(bottom=0)
    below.legend(fontsize=8, loc="lower right")
    return figure


def save_guide_figure(rendering: GuideRendering, path: Path) -> None:
    """Write the figure as PNG."""
    guide_figure(rendering).savefig(path, dpi=_DPI, metadata={"Software": None})
