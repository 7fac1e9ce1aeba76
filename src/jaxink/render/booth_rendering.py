"""A body of printed plate in a light booth: as sheets, as a solid with its ink, and as a volume."""

import dataclasses
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.export import ExportOptions, write
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
from jaxink.render.booth import (
    SHEET,
    SOLID,
    VOLUME,
    WHITE,
    Booth,
    camera,
    integrator,
    lit,
    sheet_body,
    solid_body,
    volume_body,
    white_body,
)
from jaxink.render.luminance import chromaticity, luminance_weights, tristimulus_weights
from jaxink.render.mitsuba_session import mitsuba, with_table_plugin
from jaxink.render.printed_plate import PrintedPlate

# The centre is seen by so many pixels squared, which share the cores.
_CENTRE_PIXELS = 4
# Paths of each way over those of the volume: each for about the same standard error.
_SHARES = {WHITE: 1.0, SHEET: 0.75, SOLID: 1.0, VOLUME: 1.0}
# Thinning of tables, which are read by Python.
_OPTIONS = ExportOptions(interpolation_error=1e-3)


@dataclasses.dataclass(frozen=True)
class BoothEffort:
    """Numbers of paths, together for all wavelengths.

    Parameters
    ----------
    batches
        Independent batches; standard errors come from their scatter.
    paths
        Paths of a batch to the centre: the point of the body in the middle of the picture, of a torus that of
        its outer equator.
    pixels
        Width and height of the picture.
    pixel_paths
        Paths of a batch to each pixel.
    seed
        Seed of all random numbers.
    """

    batches: int = 8
    paths: int = 16_000
    pixels: int = 48
    pixel_paths: int = 8
    seed: int = 0

    def __post_init__(self):
        require_counts(self, batches=2, paths=1, pixels=8, pixel_paths=1, seed=0)


@dataclasses.dataclass(frozen=True, eq=False)
class BoothLight:
    """Light of one way to model the printed plate.

    Parameters
    ----------
    name
        `SHEET`, `SOLID` or `VOLUME`.
    wavelength_nm
        Wavelengths.
    centre
        Radiance at the centre over that of the lamps, shape ``(batches, wavelengths)``.
    pictures
        The same in each pixel, shape ``(batches, y, x, wavelengths)``.
    """

    name: str
    wavelength_nm: Float[np.ndarray, " wavelengths"]
    centre: Float[np.ndarray, "batches wavelengths"]
    pictures: Float[np.ndarray, "batches y x wavelengths"]

    @property
    def luminance_weights(self) -> Float[np.ndarray, " wavelengths"]:
        """From the spectrum to luminance over that of the lamps, whose light is D65."""
        return luminance_weights(self.wavelength_nm)

    @property
    def luminance(self) -> Estimate:
        """Luminance at the centre over that of the lamps."""
        return estimate(self.centre @ self.luminance_weights)

    @property
    def chromaticity(self) -> Estimate | None:
        """CIE x, y at the centre, shape ``(2,)``; None for a single wavelength."""
        weights = tristimulus_weights(self.wavelength_nm)
        return None if weights is None else jackknife(self.centre @ weights, chromaticity)

    @property
    def picture(self) -> Estimate:
        """Luminance over that of the lamps in each pixel."""
        return estimate(self.pictures @ self.luminance_weights)


@dataclasses.dataclass(frozen=True, eq=False)
class BoothRendering:
    """A body of printed plate in a booth.

    Parameters
    ----------
    booth, effort
        What was rendered, and with how many paths.
    ink
        The ink as plain data.
    white
        Radiance at the centre of a body that is a perfect diffuser, by batch.
    lights
        The ways to model the plate, the sheet first.
    """

    booth: Booth
    effort: BoothEffort
    ink: dict[str, Any]
    white: Float[np.ndarray, " batches"]
    lights: tuple[BoothLight, ...]

    def light(self, name: str) -> BoothLight | None:
        """The light of one way, None if it was not rendered."""
        return next((light for light in self.lights if light.name == name), None)

    @property
    def pairs(self) -> tuple[tuple[BoothLight, BoothLight], ...]:
        """Ways that are compared."""
        found = [
            (self.light(a), self.light(b)) for a, b in ((SHEET, SOLID), (SHEET, VOLUME), (SOLID, VOLUME))
        ]
        return tuple((a, b) for a, b in found if a is not None and b is not None)

    def luminance_factor(self, light: BoothLight) -> Estimate:
        """Luminance at the centre over that of a white body in the same booth."""
        relative = ratio_less_one(light.luminance, estimate(self.white))
        return Estimate(1 + relative.value, relative.error)

    def compared(self, one: BoothLight, other: BoothLight) -> tuple[Estimate, Estimate | None]:
        """Ratio less 1 of luminance at the centre, and difference in x, y, None for a single wavelength."""
        ratio = ratio_less_one(one.luminance, other.luminance)
        a, b = one.chromaticity, other.chromaticity
        if a is None or b is None:
            return ratio, None
        return ratio, Estimate(a.value - b.value, np.hypot(a.error, b.error))

    def to_dict(self) -> dict[str, Any]:
        """Scene, numbers and comparisons, as plain data."""
        lights, comparisons = {}, {}
        for light in self.lights:
            lights[light.name] = {
                "luminance_over_lamp": _plain(light.luminance),
                "luminance_over_white_body": _plain(self.luminance_factor(light)),
                "xy": _plain(light.chromaticity),
            }
        for one, other in self.pairs:
            ratio, xy = self.compared(one, other)
            comparisons[f"{one.name}_against_{other.name}"] = {
                "luminance_ratio_less_1": _plain(ratio),
                "xy_difference": _plain(xy),
            }
        return {
            "scene": self.booth.body.name,
            "booth": dataclasses.asdict(self.booth) | {"words": self.booth.words},
            "effort": dataclasses.asdict(self.effort),
            "ink": self.ink,
            "white_body_over_lamp": _plain(estimate(self.white)),
            "lights": lights,
            "comparisons": comparisons,
        }


def render_booth(
    plate: PrintedPlate,
    out: str | Path,
    booth: Booth | None = None,
    effort: BoothEffort | None = None,
    with_volume: bool = True,
    follow: Progress = log_progress,
) -> BoothRendering:
    """Render the booth by Mitsuba 3; batches that are in the folder already are not made again.

    Parameters
    ----------
    plate
        The printed plate.
    out
        Folder for the batches.
    booth
        The scene; None for the default.
    effort
        Numbers of paths; None for the default.
    with_volume
        Whether to render the volume, too.
    follow
        Told of each batch.

    Raises
    ------
    InputRefusedError
        If Mitsuba is not installed, the ink cannot be a volume although one is wanted, or the folder has
        batches of another rendering.
    """
    booth, effort = booth or Booth(), effort or BoothEffort()
    medium, wavelengths = plate.ink.medium, plate.wavelength_nm
    if with_volume and medium is None:
        raise InputRefusedError(
            f"{plate.ink.name}: cannot be rendered as a volume: {plate.ink.why_no_volume} Or leave the "
            "volume out (--no-volume)."
        )
    # Refuses a band that has no colour before anything is traced.
    tristimulus_weights(wavelengths)
    with mitsuba() as mi, tempfile.TemporaryDirectory() as folder:
        meshes = Path(folder)
        files = with_table_plugin(
            mi,
            {
                name: write(table, "mitsuba", folder, dataclasses.replace(_OPTIONS, name=name))
                for name, table in ((SHEET, plate.sheet), (SOLID, plate.ink.table))
            },
        )
        plan = {
            "scene": booth.body.name,
            "booth": dataclasses.asdict(booth),
            "paths": [effort.paths, effort.pixels, effort.pixel_paths, _SHARES],
            "seed": effort.seed,
            "plate": plate.identity,
        }
        kept = Kept(Path(out), plan)

        def body(way: str, w: int) -> dict[str, Any]:
            wavelength, around = float(wavelengths[w]), float(plate.surroundings[w])
            if way == WHITE:
                return white_body(booth, meshes)
            if way == SHEET:
                return sheet_body(booth, files[SHEET], wavelength, meshes)
            if way == SOLID:
                index = float(plate.ink.table.index_inside[w])
                return solid_body(booth, files[SOLID], wavelength, index, around, meshes)
            assert medium is not None, "a volume needs a medium"
            return volume_body(booth, medium, w, around, meshes)

        # Tables take long to read, so that scenes are kept.
        @cache
        def loaded(way: str, w: int):
            cameras = {
                "centre": camera(booth, _CENTRE_PIXELS, centre=True),
                "picture": camera(booth, effort.pixels, centre=False),
            }
            scene = {"type": "scene", "integrator": integrator(way), **cameras, **lit(booth)}
            return mi.load_dict(scene | body(way, w))

        def batches(way: str, view: int, paths: float, what: str):
            n = 1 if way == WHITE else len(wavelengths)

            def make(k: int) -> np.ndarray:
                found = []
                for w in range(n):
                    words = [ord(c) for c in way]
                    seed = np.random.SeedSequence([effort.seed, k, w, view, *words]).generate_state(1)[0]
                    spp = max(1, round(paths / n))
                    picture = mi.render(loaded(way, w), sensor=view, spp=spp, seed=int(seed) >> 1)
                    found.append(np.array(picture, float).reshape(picture.shape[:2]))
                return np.stack(found, axis=-1)

            return batches_of(kept, f"{way}-{view}", effort.batches, make, follow, f"{way}, {what}")

        def centre(way: str):
            paths = effort.paths * _SHARES[way] / _CENTRE_PIXELS**2
            return batches(way, 0, paths, "centre").mean(axis=(1, 2))

        ways = (SHEET, SOLID, VOLUME) if with_volume else (SHEET, SOLID)
        white = centre(WHITE)[:, 0]
        lights = tuple(
            BoothLight(way, wavelengths, centre(way), batches(way, 1, effort.pixel_paths, "picture"))
            for way in ways
        )
    return BoothRendering(booth, effort, plate.ink.describe(), white, lights)


def _plain(found: Estimate | None) -> dict[str, Any] | None:
    return None if found is None else found.to_dict()
