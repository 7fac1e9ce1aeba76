"""The light guide with an ink, as sheets and as volumes, and the numbers that a designer wants."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.progress import Progress, log_progress
from jaxink.render.batches import (
    Estimate,
    Kept,
    batches_of,
    estimate,
    jackknife,
    ratio_less_one,
    require_counts,
)
from jaxink.render.dots import Dots, SheetDots, VolumeDots
from jaxink.render.guide import Guide
from jaxink.render.guide_paths import BINS, HEMISPHERE, NORMAL, guide_batch
from jaxink.render.luminance import chromaticity, luminance_weights, tristimulus_weights
from jaxink.render.rendered_ink import RenderedInk
from jaxink.render.sheet_sampling import SheetSampler

SHEET, VOLUME, UNCORRECTED = "sheet", "volume", "uncorrected"
# Spots of the usual nine points are so many cells wide and are in the middle of ninths of the face.
_SPOT_CELLS = 2
# Ends of the guide between which the colour shift is taken: shares of its length.
_END = 0.15


@dataclasses.dataclass(frozen=True)
class Effort:
    """Numbers of paths.

    Parameters
    ----------
    batches
        Independent batches; standard errors come from their scatter.
    paths
        Paths of each bin of the face in a batch, seen along the normal, with the dots as volumes.
    hemisphere_paths
        The same for the flux.
    sheets
        How many times as many paths are traced with the dots as sheets, which is much faster.
    seed
        Seed of all random numbers.
    """

    batches: int = 8
    paths: int = 60
    hemisphere_paths: int = 15
    sheets: int = 4
    seed: int = 0

    def __post_init__(self):
        require_counts(self, batches=2, paths=1, hemisphere_paths=1, sheets=1, seed=0)


@dataclasses.dataclass(frozen=True, eq=False)
class GuideLight:
    """Light of one way to model the dots.

    Parameters
    ----------
    name
        `SHEET`, `VOLUME` or `UNCORRECTED`.
    wavelength_nm
        Wavelengths.
    cells
        Radiance along the normal over that of the lamp, by batch and cell, shape
        ``(batches, rows, columns, wavelengths)``.
    hemisphere
        Exitance over pi in the same units, mean over the face, shape ``(batches, wavelengths)``.
    picture
        Radiance along the normal in each bin, mean over the batches, shape ``(y, x, wavelengths)``.
    guide
        The guide.
    """

    name: str
    wavelength_nm: Float[np.ndarray, " wavelengths"]
    cells: Float[np.ndarray, "batches rows columns wavelengths"]
    hemisphere: Float[np.ndarray, "batches wavelengths"]
    picture: Float[np.ndarray, "y x wavelengths"]
    guide: Guide

    @property
    def luminance_weights(self) -> Float[np.ndarray, " wavelengths"]:
        """From the spectrum to luminance over that of the lamp, whose light is D65."""
        return luminance_weights(self.wavelength_nm)

    @property
    def luminance(self) -> Float[np.ndarray, "batches rows columns"]:
        """Luminance along the normal over that of the lamp, in each cell."""
        return self.cells @ self.luminance_weights

    @property
    def profile(self) -> Estimate:
        """Luminance along the guide: mean over each column of dots."""
        return estimate(self.luminance.mean(axis=1))

    @property
    def mean_luminance(self) -> Estimate:
        """Mean over the face."""
        return estimate(self.luminance.mean(axis=(1, 2)))

    @property
    def efficiency(self) -> Estimate:
        """Luminous flux that leaves through the exit face over that which the lamp sends onto the edge."""
        guide = self.guide
        areas = guide.length_mm / guide.thickness_mm
        return estimate(self.hemisphere @ self.luminance_weights * areas)

    @property
    def uniformity(self) -> Estimate:
        """Least over largest column of the profile; errors by leaving out each batch in turn."""
        return jackknife(self.luminance.mean(axis=1), lambda columns: columns.min() / columns.max())

    @property
    def nine_points(self) -> Estimate:
        """Least over largest luminance of nine spots in the middle of ninths of the face."""

        def ratio(cells):
            spots = [
                cells[_spot(cells.shape[0], row), _spot(cells.shape[1], column)].mean()
                for row in range(3)
                for column in range(3)
            ]
            return min(spots) / max(spots)

        return jackknife(self.luminance, ratio)

    @property
    def chromaticity(self) -> Estimate | None:
        """CIE x, y of each column, shape ``(columns, 2)``; None for a single wavelength."""
        weights = tristimulus_weights(self.wavelength_nm)
        if weights is None:
            return None
        return jackknife(self.cells.mean(axis=1) @ weights, chromaticity)

    @property
    def colour_shift(self) -> Estimate | None:
        """CIE x, y at the far end less those at the lamp, each over 15 % of the length."""
        weights = tristimulus_weights(self.wavelength_nm)
        if weights is None:
            return None
        n = max(1, round(_END * self.guide.columns))

        def shift(columns):
            return chromaticity(columns[-n:].mean(axis=0)) - chromaticity(columns[:n].mean(axis=0))

        return jackknife(self.cells.mean(axis=1) @ weights, shift)

    def to_dict(self) -> dict[str, Any]:
        """Numbers with standard errors, as plain data."""
        found = {
            "mean_luminance": self.mean_luminance,
            "flux_out_over_flux_in": self.efficiency,
            "uniformity_columns": self.uniformity,
            "uniformity_nine_points": self.nine_points,
            "luminance_of_columns": self.profile,
            "xy_of_columns": self.chromaticity,
            "xy_far_less_near": self.colour_shift,
        }
        return {name: None if one is None else one.to_dict() for name, one in found.items()}


@dataclasses.dataclass(frozen=True, eq=False)
class GuideRendering:
    """A light guide with an ink.

    Parameters
    ----------
    guide, effort
        What was rendered, and with how many paths.
    inks
        The ink, and the uncorrected one if there is one.
    lights
        The ways to model the dots, the sheet first.
    """

    guide: Guide
    effort: Effort
    inks: tuple[RenderedInk, ...]
    lights: tuple[GuideLight, ...]

    def light(self, name: str) -> GuideLight | None:
        """The light of one way, None if it was not rendered."""
        return next((light for light in self.lights if light.name == name), None)

    def relative(self, name: str, to: str) -> tuple[Estimate, Estimate] | None:
        """Ratio less 1 of the luminance of two ways, of the mean and by column; None if one is absent."""
        one, other = self.light(name), self.light(to)
        if one is None or other is None:
            return None
        return ratio_less_one(one.mean_luminance, other.mean_luminance), ratio_less_one(
            one.profile, other.profile
        )

    def to_dict(self) -> dict[str, Any]:
        """Scene, numbers and comparisons, as plain data."""
        comparisons = {}
        for name, to in ((SHEET, VOLUME), (UNCORRECTED, SHEET)):
            found = self.relative(name, to)
            if found is not None:
                keys = "mean_luminance", "luminance_of_columns"
                comparisons[f"{name}_over_{to}_less_1"] = {
                    key: one.to_dict() for key, one in zip(keys, found, strict=True)
                }
        return {
            "scene": "lightguide",
            "guide": dataclasses.asdict(self.guide) | {"dots": self.guide.n_dots, "words": self.guide.words},
            "effort": dataclasses.asdict(self.effort),
            "inks": [ink.describe() for ink in self.inks],
            "lights": {light.name: light.to_dict() for light in self.lights},
            "comparisons": comparisons,
        }


def render_guide(
    ink: RenderedInk,
    out: str | Path,
    guide: Guide | None = None,
    uncorrected: RenderedInk | None = None,
    effort: Effort | None = None,
    with_volume: bool = True,
    follow: Progress = log_progress,
) -> GuideRendering:
    """Render the light guide; batches that are in the folder already are not made again.

    Parameters
    ----------
    ink
        The ink of the dots.
    out
        Folder for the batches.
    guide
        The guide; None for the default.
    uncorrected
        The same ink by a model that lacks something, drawn as sheets beside it.
    effort
        Numbers of paths; None for the default.
    with_volume
        Whether to render the dots as volumes, too.
    follow
        Told of each batch.

    Raises
    ------
    InputRefusedError
        If the ink cannot be a volume although one is wanted, or the folder has batches of another rendering.
    """
    guide, effort = guide or Guide(), effort or Effort()
    if with_volume and ink.medium is None:
        raise InputRefusedError(
            f"{ink.name}: cannot be rendered as a volume: {ink.why_no_volume} Or render the sheet alone "
            "(--no-volume)."
        )
    # Refuses a band that has no colour before anything is traced.
    tristimulus_weights(ink.table.wavelength_nm)
    plan = {
        "scene": "lightguide",
        "guide": dataclasses.asdict(guide),
        "paths": [effort.paths, effort.hemisphere_paths, effort.sheets],
        "seed": effort.seed,
        "bins": BINS,
        "ink": ink.identity,
        "uncorrected": None if uncorrected is None else uncorrected.identity,
    }
    kept = Kept(Path(out), plan)
    ways: list[tuple[str, list[Dots], RenderedInk]] = [(SHEET, [SheetDots(SheetSampler(ink.table))], ink)]
    if with_volume and ink.medium is not None:
        each = [VolumeDots(ink.medium, w) for w in range(len(ink.table.wavelength_nm))]
        ways.append((VOLUME, list(each), ink))
    if uncorrected is not None:
        ways.append((UNCORRECTED, [SheetDots(SheetSampler(uncorrected.table))], uncorrected))
    lights = []
    for name, dots, of in ways:
        found = []
        for view, paths in ((NORMAL, effort.paths), (HEMISPHERE, effort.hemisphere_paths)):
            times = 1 if name == VOLUME else effort.sheets

            def make(k, name=name, view=view, paths=paths * times, dots=dots):
                parts = []
                for w, one in enumerate(dots):
                    words = [ord(c) for c in name + view]
                    random = np.random.default_rng([effort.seed, k, w, *words])
                    parts.append(guide_batch(guide, one, view, paths, random))
                return np.concatenate(parts, axis=-1)

            what = f"{name}, {'along the normal' if view == NORMAL else 'flux'}"
            found.append(batches_of(kept, f"{name}-{view}", effort.batches, make, follow, what))
        normal, hemisphere = found
        cells = normal.reshape(len(normal), guide.rows, BINS, guide.columns, BINS, -1).mean(axis=(2, 4))
        lights.append(
            GuideLight(
                name, of.table.wavelength_nm, cells, hemisphere.mean(axis=(1, 2)), normal.mean(axis=0), guide
            )
        )
    inks = (ink,) if uncorrected is None else (ink, uncorrected)
    return GuideRendering(guide, effort, inks, tuple(lights))


def _spot(n: int, third: int) -> slice:
    middle = (third + 0.5) * n / 3
    first = max(0, round(middle - _SPOT_CELLS / 2))
    return slice(first, min(n, first + _SPOT_CELLS))
