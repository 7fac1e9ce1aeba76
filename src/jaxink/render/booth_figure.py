"""The picture of the booth: the body by each way, and relative differences between the ways."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from jaxink.render.batches import Estimate, estimate, ratio_less_one
from jaxink.render.bodies import Body
from jaxink.render.booth import FILLS, SHEET, SOLID, VOLUME
from jaxink.render.booth_rendering import BoothLight, BoothRendering

_TITLES = {
    SHEET: "sheet: BSDF of the whole plate\non the full hemisphere, predicted",
    SOLID: "solid: clear body with the ink's\nBSDF on its inner face",
    VOLUME: "volume: every scattering traced\n",
}
_DPI, _BRIGHTEST = 110, 0.995
# Differences are those of blocks of pixels, so many across the picture, and within the body's outline by a
# share of its half width.
_BLOCKS, _MARGIN = 8, 0.03
_PER_CENT = 5.0


def block_differences(body: Body, one: BoothLight, other: BoothLight) -> Estimate:
    """Relative differences of luminance, of blocks within the body; nan outside, shape ``(y, x)``."""
    return ratio_less_one(*(estimate(_blocks(body, light)) for light in (one, other)))


def _blocks(body: Body, light: BoothLight) -> np.ndarray:
    """Mean luminance of the pixels of each block within the body, by batch."""
    pictures = light.pictures @ light.luminance_weights
    n = pictures.shape[1]
    across = ((np.arange(n) + 0.5) / n * 2 - 1) * body.half_width_mm / FILLS
    # Rows go down.
    x, y = np.meshgrid(across, -across)
    within = body.covers(x, y, _MARGIN * body.half_width_mm)
    number = np.arange(n) * _BLOCKS // n
    sums = np.zeros((len(pictures), _BLOCKS, _BLOCKS))
    counts = np.zeros((_BLOCKS, _BLOCKS))
    at = np.ix_(number, number)
    np.add.at(counts, at, within)
    for total, picture in zip(sums, pictures, strict=True):
        np.add.at(total, at, np.where(within, picture, 0.0))
    # A block with few pixels is all noise.
    return sums / np.where(counts > (n / _BLOCKS) ** 2 / 2, counts, np.nan)


def booth_figure(rendering: BoothRendering) -> Figure:
    """Luminance of each way above, and differences below."""
    lights, pairs = rendering.lights, rendering.pairs
    columns = len(lights)
    figure = Figure(figsize=(2.7 * columns + 0.9, 5.9), layout="constrained")
    axes = figure.subplots(2, columns, squeeze=False)
    white = float(np.mean(rendering.white))
    # One scale, on which reflections of the lamps do not count.
    top = float(np.quantile(lights[0].picture.value / white, _BRIGHTEST))
    for panel, light in zip(axes[0], lights, strict=True):
        drawn = panel.imshow(light.picture.value / white, vmin=0, vmax=top, cmap="gray")
        found = rendering.luminance_factor(light)
        panel.set_title(
            f"{_TITLES[light.name]}\ncentre {100 * found.value:.1f} ± {100 * found.error:.1f} %", fontsize=8
        )
    figure.colorbar(drawn, ax=list(axes[0]), shrink=0.8).set_label("luminance / white body's", fontsize=8)
    for panel in axes[1][len(pairs) :]:
        panel.set_visible(False)
    for panel, (one, other) in zip(axes[1], pairs, strict=False):
        found = block_differences(rendering.booth.body, one, other)
        shown = panel.imshow(100 * found.value, vmin=-_PER_CENT, vmax=_PER_CENT, cmap="coolwarm")
        panel.set_title(
            f"{one.name} less {other.name}\nerror of a block {100 * np.nanmedian(found.error):.1f} %",
            fontsize=8,
        )
    figure.colorbar(shown, ax=list(axes[1]), shrink=0.8).set_label("difference, %", fontsize=8)
    for panel in axes.ravel():
        panel.set_xticks([])
        panel.set_yticks([])
    return figure


def save_booth_figure(rendering: BoothRendering, path: Path) -> None:
    """Write the figure as PNG."""
    booth_figure(rendering).savefig(path, dpi=_DPI, metadata={"Software": None})
