"""Sheets against volumes for one round dot: what the rim changes, by size of the dot and thickness.

python -m benchmarks.validation.render.dot_size

Each path is followed in a dot up to where it first meets the rim. From there it goes on twice: in a layer
without a rim, which is what a sheet stands for, and in the dot, whose rim faces air. Only paths that meet the
rim contribute to the difference, so that few of them suffice.
"""

import dataclasses
import functools
import itertools
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from jaxink.export import Medium, medium_of
from jaxink.export.dot_size import RIM, Rim, WideLayer, sheet_error
from jaxink.files.writing import written_whole
from jaxink.ink import find_ink
from jaxink.render.batches import Estimate, jackknife
from jaxink.render.dots import VolumeDots, Walk
from jaxink.sample import load_sample

HERE = Path(__file__).parent
FILE = HERE / "dot_size.json"
# The constants of the rule come from the first two; the last one tests it.
FITTED, KEPT_ASIDE = ("thin_ink", "coloured_dot"), "white_dot"
INKS = (*FITTED, KEPT_ASIDE)
# Thickness over that of the file; diameter over thickness; angle of incidence in the plate.
THICKNESSES = (0.25, 0.5, 1.0, 2.0)
RATIOS = (5, 10, 20, 40, 80)
DIFFUSE, GUIDED = "diffuse", "guided"
LIGHTS = {DIFFUSE: None, GUIDED: 60.0}
# Paths per batch and unit of the ratio: the share that meets the rim is inverse to the ratio.
_BATCHES, _PATHS, _COPIES, _SEED = 16, 300, 4, 7


class _LoneDot(NamedTuple):
    """A single dot around the origin; with an infinite radius, a layer without a rim."""

    radius_mm: float

    def dot_at(self, position_mm):
        return np.zeros((len(position_mm), 3)), np.full(len(position_mm), self.radius_mm)

    def is_clear(self, x_mm, y_mm):
        return np.hypot(x_mm, y_mm) > self.radius_mm


class _ToRim(Walk):
    """Paths up to where they first meet the rim."""

    def at_rim(self, rim):
        self.held.append((self.paths[rim], self.at[rim], self.along[rim]))
        return np.zeros(len(rim), bool)

    @functools.cached_property
    def held(self) -> list:
        """Numbers, positions and directions of the paths that met the rim."""
        return []


def ink(name: str, thickness: float = 1.0) -> Medium:
    """One of `INKS`, with its thickness multiplied."""
    sample = load_sample(HERE / f"{name}.toml")
    medium = medium_of(find_ink(sample), sample.wavelengths_nm)
    return dataclasses.replace(medium, thickness_um=medium.thickness_um * thickness)


def rim_batch(
    medium: Medium, ratio: float, theta_deg: float | None, n: int, random: np.random.Generator
) -> Float[np.ndarray, "2 2"]:
    """Shares of the light on a dot that are scattered into plate and air: of the sheet, of the volume.

    Parameters
    ----------
    medium
        The ink.
    ratio
        Diameter over thickness.
    theta_deg
        Angle of incidence in the plate; None: equal radiance from all directions.
    n
        Number of paths.
    random
        Source of random numbers.
    """
    dots, radius = VolumeDots(medium, 0), ratio * medium.thickness_um / 2000
    far, turn, azimuth = radius * np.sqrt(random.random(n)), *(2 * np.pi * random.random((2, n)))
    cosine = np.sqrt(random.random(n)) if theta_deg is None else np.full(n, np.cos(np.deg2rad(theta_deg)))
    sine = np.sqrt(1 - cosine**2)
    start = _ToRim(dots, _LoneDot(radius), n, random)
    start.enter(
        np.stack([far * np.cos(turn), far * np.sin(turn), np.zeros(n)], axis=1),
        np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), -cosine], axis=1),
    )
    start.finish()
    paths, at, along = (np.repeat(np.concatenate(x), _COPIES, axis=0) for x in zip(*start.held, strict=True))

    def scattered(of: float) -> np.ndarray:
        walk = Walk(dots, _LoneDot(of), len(paths), random)
        walk.is_scattered = start.is_scattered[paths]
        walk.start(np.arange(len(paths)), at.copy(), along.copy())
        walk.finish()
        return (_scattered(start) + _scattered(walk) / _COPIES) / n

    return np.stack([scattered(np.inf), scattered(radius)])


def _scattered(walk: Walk) -> np.ndarray:
    """Numbers of paths that were scattered into the plate and into air."""
    return np.array([np.sum(ends & walk.is_scattered) for ends in (walk.goes_on, walk.leaves_plate)])


def rim_estimate(
    medium: Medium, ratio: float, theta_deg: float | None, n: int, seed: int = _SEED
) -> dict[str, Estimate]:
    """Shares of sheet and volume, and the error of the sheet.

    All are for the light scattered into the plate and into air, from `_BATCHES` batches of ``n`` paths; see
    `rim_batch`. ``error`` is the sheet's light over that of the volume, less 1; ``edge`` is the difference
    over the light of the sheet, times diameter over thickness.
    """
    randoms = np.random.default_rng(seed).spawn(_BATCHES)
    batches = np.stack([rim_batch(medium, ratio, theta_deg, n, random) for random in randoms])

    def derived(mean):
        sheet, volume = mean
        return np.stack([sheet, volume, sheet / volume - 1, ratio * (1 - volume / sheet)])

    values, errors = jackknife(batches, derived)
    names = "sheet", "volume", "error", "edge"
    return {name: Estimate(*both) for name, *both in zip(names, values, errors, strict=True)}


def key(name: str, light: str, thickness: float, ratio: float) -> str:
    """Name of a case in the file."""
    return f"{name} {light} {thickness:g} {ratio:g}"


def numbers() -> dict:
    """All cases by `key`, kept as they are made."""
    found = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    for name, light, thickness, ratio in itertools.product(INKS, LIGHTS, THICKNESSES, RATIOS):
        case = key(name, light, thickness, ratio)
        if case not in found:
            made = rim_estimate(ink(name, thickness), ratio, LIGHTS[light], _PATHS * ratio)
            found[case] = {part: one.to_dict() for part, one in made.items()}
            text = json.dumps(found, indent=1, sort_keys=True) + "\n"
            with written_whole(FILE) as new:
                new.write_text(text, encoding="utf-8")
    return found


def edge(found: dict, name: str, light: str, thickness: float) -> Estimate:
    """Mean of ``edge`` over all but the smallest dot, weighted with the errors."""
    cases = [found[key(name, light, thickness, ratio)]["edge"] for ratio in RATIOS[1:]]
    values, errors = (np.array([case[part] for case in cases]) for part in ("value", "standard_error"))
    weights = 1 / errors**2
    return Estimate(np.sum(weights * values, axis=0) / weights.sum(axis=0), weights.sum(axis=0) ** -0.5)


@functools.cache
def wide_layer(name: str, light: str, thickness: float) -> WideLayer:
    """By the solver, what the sheet of an ink does."""
    return WideLayer.of(ink(name, thickness), 0, LIGHTS[light])


def fitted(found: dict) -> Rim:
    """Constants of the rule from the inks of `FITTED` in diffuse light.

    An error that the rule cannot meet is expected to be a tenth of the error, besides that of the paths.
    """
    cases = list(itertools.product(FITTED, [DIFFUSE], THICKNESSES))
    layers = [wide_layer(*case) for case in cases]
    seen = [edge(found, *case) for case in cases]

    def misfit(constants):
        return np.concatenate(
            [
                (np.array(sheet_error(layer, Rim(*constants))) - one.value)
                / np.hypot(one.error, 0.1 * np.abs(one.value))
                for layer, one in zip(layers, seen, strict=True)
            ]
        )

    return Rim(*least_squares(misfit, RIM).x.tolist())


if __name__ == "__main__":
    print(fitted(numbers()))
