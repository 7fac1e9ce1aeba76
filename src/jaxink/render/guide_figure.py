"""The picture of a light guide: its face with each way to model the dots, and the luminance along it."""

from pathlib import Path

from matplotlib.figure import Figure

from jaxink.render.lightguide import SHEET, UNCORRECTED, VOLUME, GuideRendering

_TITLES = {
    SHEET: "dots as sheets: the ink's BSDF inside the plate",
    VOLUME: "dots as volumes: every scattering traced",
    UNCORRECTED: "dots as sheets, uncorrected model",
}
_COLOURS = {SHEET: "tab:blue", VOLUME: "black", UNCORRECTED: "tab:red"}
_DPI = 110


def guide_figure(rendering: GuideRendering) -> Figure:
    """Luminance across the face, one panel for each way, and along the guide below."""
    lights, guide = rendering.lights, rendering.guide
    figure = Figure(figsize=(9, 2.1 * len(lights) + 3.0), layout="constrained")
    axes = figure.subplots(len(lights) + 1, 1, height_ratios=[1] * len(lights) + [1.25], squeeze=False)[:, 0]
    pictures = [light.picture @ light.luminance_weights for light in lights]
    top = max(float(picture.max()) for picture in pictures[:1])
    extent = (0, guide.length_mm, 0, guide.width_mm)
    for panel, light, picture in zip(axes, lights, pictures, strict=False):
        drawn = panel.imshow(
            picture, origin="lower", extent=extent, vmin=0, vmax=top, cmap="inferno", interpolation="nearest"
        )
        flux = light.efficiency
        panel.set_title(
            f"{_TITLES[light.name]}; flux out / flux in {100 * flux.value:.1f} ± {100 * flux.error:.1f} %",
            fontsize="medium",
        )
        panel.set_ylabel("mm")
    figure.colorbar(drawn, ax=list(axes[:-1]), label="luminance / that of the lamp", aspect=40)
    below = axes[-1]
    for light in lights:
        below.errorbar(
            guide.columns_mm,
            100 * light.profile.value,
            100 * light.profile.error,
            color=_COLOURS[light.name],
            marker="." if light.name == VOLUME else None,
            linestyle="none" if light.name == VOLUME else "-",
            capsize=2,
            label=light.name,
        )
    below.set(
        xlabel="distance from the lamp, mm",
        ylabel="luminance, %\nof the lamp",
        xlim=(0, guide.length_mm),
    )
    below.set_ylim(bottom=0)
    below.legend(fontsize="small")
    return figure


def save_guide_figure(rendering: GuideRendering, path: Path) -> None:
    """Write the figure as PNG."""
    guide_figure(rendering).savefig(path, dpi=_DPI, metadata={"Software": None})
