"""Inks, plates and undeclared effects of the simulated measurements, drawn at random from a seed.

Cases of odd number serve to develop a diagnosis; those of even number are kept unseen until it is finished.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

WAVELENGTH_NM = 550.0
INCIDENCES_DEG = (0.0, 20.0, 40.0, 60.0)
# How many cases each kind has.
SIZES = {
    "spread": 8,
    "dense": 8,
    "rough_and_backing": 8,
    "finite_field": 8,
    "bright_backing": 8,
    "small_gain": 8,
    "clean": 20,
}


@dataclass(frozen=True)
class Ink:
    """A layer of ink; exactly one of the two descriptions of its scattering.

    Parameters
    ----------
    index, thickness_um
        Refractive index of the binder, and thickness.
    scattering_per_mm, absorption_per_mm, asymmetry
        Of Henyey-Greenstein scattering.
    radius_nm, particle_index, particle_absorption_index, volume_fraction
        Of spheres.
    size_ratio, is_dense
        Geometric standard deviation of the radius, whose median is ``radius_nm``, and whether the positions
        of the spheres are correlated as those of hard spheres.
    """

    index: float
    thickness_um: float
    scattering_per_mm: float | None = None
    absorption_per_mm: float | None = None
    asymmetry: float | None = None
    radius_nm: float | None = None
    particle_index: float | None = None
    particle_absorption_index: float | None = None
    volume_fraction: float | None = None
    size_ratio: float = 1.0
    is_dense: bool = False


@dataclass(frozen=True)
class Case:
    """A simulated measurement.

    Parameters
    ----------
    name
        Kind and number.
    plate_index, plate_mm
        Refractive index and thickness of the plate, whose side is lit.
    ink
        On the other side of the plate.
    effects
        Names of the catalogue that the sample file does not mention.
    sigma_deg, backing, gain, beam_diameter_mm, field_diameter_mm
        Slopes of Cauchy facets on the outer face; reflectance of a backing that is there while reflection is
        measured; factor of all values; of a field of view that is not infinite.
    """

    name: str
    plate_index: float
    plate_mm: float
    ink: Ink
    effects: tuple[str, ...] = field(default=())
    sigma_deg: float | None = None
    backing: float | None = None
    gain: float = 1.0
    beam_diameter_mm: float | None = None
    field_diameter_mm: float | None = None

    @property
    def is_unseen(self) -> bool:
        """Whether the case is kept until a diagnosis is finished."""
        return int(self.name.rsplit("-", 1)[1]) % 2 == 0


class _Draws:
    """Values of one case, rounded as a person would declare them."""

    def __init__(self, seed: int):
        self._random = np.random.default_rng(seed)

    def between(self, low: float, high: float, digits: int) -> float:
        return round(float(self._random.uniform(low, high)), digits)

    def one_of(self, *values: float) -> float:
        return values[int(self._random.integers(len(values)))]

    def plate(self) -> dict:
        return {"plate_index": self.one_of(1.49, 1.5, 1.52), "plate_mm": self.one_of(0.5, 1.0, 2.0, 3.0)}

    def plain_ink(self, index: float, absorption=(0.2, 3.0)) -> Ink:
        """Ink of Henyey-Greenstein scattering, of an optical thickness of 3 to 10."""
        thickness_um = self.between(35, 100, 0)
        return Ink(
            index,
            thickness_um,
            scattering_per_mm=round(self.between(3, 10, 2) / (thickness_um * 1e-3), 1),
            absorption_per_mm=self.between(*absorption, 2),
            asymmetry=self.between(0.4, 0.75, 2),
        )

    def spheres(self, index: float, radius=(110, 240), fraction=(0.008, 0.03), **options) -> Ink:
        """Ink of spheres, thin enough for several scatterings only."""
        return Ink(
            index,
            self.between(25, 70, 0),
            radius_nm=self.between(*radius, 0),
            particle_index=self.one_of(1.9, 2.1, 2.3, 2.6),
            particle_absorption_index=self.between(2e-4, 1.5e-3, 5),
            volume_fraction=self.between(*fraction, 4),
            **options,
        )


def _spread(name: str, draws: _Draws) -> Case:
    plate = draws.plate()
    ink = draws.spheres(plate["plate_index"], (100, 190), size_ratio=draws.between(1.3, 1.6, 2))
    return Case(name, **plate, ink=ink, effects=("polydispersity",))


def _dense(name: str, draws: _Draws) -> Case:
    plate = draws.plate()
    ink = draws.spheres(plate["plate_index"], (120, 220), (0.15, 0.32), is_dense=True)
    # Thinner, and of weaker particles.
    ink = replace(ink, thickness_um=draws.between(8, 25, 0), particle_index=draws.one_of(1.7, 1.8, 2.0))
    return Case(name, **plate, ink=ink, effects=("structure_factor",))


def _rough_and_backing(name: str, draws: _Draws) -> Case:
    plate = draws.plate()
    effects = ("rough_ink", "backing")
    sizes = {"sigma_deg": draws.between(2.5, 5.0, 1), "backing": draws.between(0.12, 0.4, 2)}
    return Case(name, **plate, ink=draws.plain_ink(plate["plate_index"]), effects=effects, **sizes)


def _finite_field(name: str, draws: _Draws) -> Case:
    plate = draws.plate()
    beam = draws.between(1.0, 5.0, 1)
    sizes = {"beam_diameter_mm": beam, "field_diameter_mm": round(beam + draws.between(1.0, 4.0, 1), 1)}
    return Case(name, **plate, ink=draws.plain_ink(plate["plate_index"]), effects=("lateral_loss",), **sizes)


def _bright_backing(name: str, draws: _Draws) -> Case:
    plate = draws.plate()
    ink = draws.plain_ink(plate["plate_index"], absorption=(0.05, 1.0))
    return Case(name, **plate, ink=ink, effects=("backing",), backing=draws.between(0.4, 0.9, 2))


def _small_gain(name: str, draws: _Draws) -> Case:
    plate = draws.plate()
    gain = 1 + draws.one_of(-1, 1) * draws.between(0.01, 0.02, 3)
    return Case(name, **plate, ink=draws.plain_ink(plate["plate_index"]), effects=("gain",), gain=gain)


def _clean(name: str, draws: _Draws) -> Case:
    plate = draws.plate()
    if draws.one_of(0, 1):
        return Case(name, **plate, ink=draws.spheres(plate["plate_index"]))
    return Case(name, **plate, ink=draws.plain_ink(draws.one_of(plate["plate_index"], 1.46, 1.55)))


_KINDS: dict[str, Callable[[str, _Draws], Case]] = {
    "spread": _spread,
    "dense": _dense,
    "rough_and_backing": _rough_and_backing,
    "finite_field": _finite_field,
    "bright_backing": _bright_backing,
    "small_gain": _small_gain,
    "clean": _clean,
}


def cases() -> dict[str, Case]:
    """All cases by their names."""
    made = {}
    for kind_number, (kind, size) in enumerate(SIZES.items()):
        for number in range(1, size + 1):
            name = f"{kind}-{number}"
            made[name] = _KINDS[kind](name, _Draws(1000 * kind_number + number))
    return made
