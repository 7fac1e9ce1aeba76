"""TOML file that describes a rough boundary between two clear media."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jax.numpy as jnp

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.numerics.precision import computing
from jaxink.sample import (
    ROUGHNESS,
    SPECTRA,
    SURROUNDINGS,
    WAVELENGTH_NM,
    Quantity,
    bounded,
    choice,
    document_of,
    missing,
    only,
    read_map,
    refuse_sample,
    table_of,
    text_of,
)
from jaxink.surfaces import (
    DENSITIES,
    GaussianSpectrum,
    HeightMap,
    KCorrelation,
    PowerSpectrum,
    SlopeDensity,
    TabulatedSlopes,
    TabulatedSpectrum,
    slope_density,
)

METHODS = ("facets", "waves")
INDEX = SURROUNDINGS["index_front"]
# Numbers of each description; a file contains exactly one of these tables.
DESCRIPTIONS: dict[str, dict[str, Quantity]] = {
    "facets": ROUGHNESS,
    **SPECTRA,
    "height_map": {
        "height_scale": Quantity("", 1e-3, 1e3, 1.0, meaning="factor of the heights"),
        "height_scale_standard_error": Quantity("", 0.0, 1e3, 0.0, meaning="of the factor"),
    },
}
# Keys of a description that are not numbers.
OTHER_KEYS = {"facets": ("density",), "height_map": ("heights_um", "pitch_um", "method")}
_MEDIA = ("index_inside", "index_outside")
TOP_KEYS = (*_MEDIA, "wavelength_nm", *DESCRIPTIONS)


@dataclasses.dataclass(frozen=True)
class RoughBoundary:
    """A rough boundary between two clear media.

    Parameters
    ----------
    wavelengths_nm
        Wavelengths in vacuum, ascending.
    index_inside, index_outside
        Refractive indices of side I and side A, one for each wavelength.
    method
        One of `METHODS`.
    shape
        Slope density for facets, power spectrum of the height for wave optics, both for the height scale 1.
    heights
        Height map from which the shape was computed, or None.
    height_scale, height_scale_standard_error
        Factor of the heights of a map, and its standard error, 0 if it is exact.
    """

    __repr__ = brief_repr

    wavelengths_nm: tuple[float, ...]
    index_inside: tuple[float, ...]
    index_outside: tuple[float, ...]
    method: str
    shape: SlopeDensity | PowerSpectrum
    heights: HeightMap | None = None
    height_scale: float = 1.0
    height_scale_standard_error: float = 0.0

    def shape_at(self, height_scale: float) -> SlopeDensity | PowerSpectrum:
        """The density or spectrum for heights multiplied by a factor."""
        match self.shape:
            case TabulatedSlopes():
                return dataclasses.replace(self.shape, height_scale=jnp.asarray(height_scale))
            case TabulatedSpectrum():
                variance = self.shape.height_variance_um2 * height_scale**2
                return dataclasses.replace(self.shape, height_variance_um2=variance)
        return self.shape


def load_boundary(path: str | Path) -> RoughBoundary:
    """Read the file of a rough boundary.

    Parameters
    ----------
    path
        TOML file (see docs/manual/surfaces.md); paths of height maps are relative to its folder.

    Raises
    ------
    InputRefusedError
        If the file is invalid; names the file and the key.
    """
    path = Path(path)
    document = document_of(text_of(path, "surface"), str(path))
    try:
        with computing():
            return _boundary(document, path.parent)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{path}: {problem}") from None


def _boundary(document: dict[str, Any], folder: Path) -> RoughBoundary:
    refuse_sample(
        document, "a boundary file gives index_inside, index_outside and one description of the relief."
    )
    only(document, TOP_KEYS, "the file")
    wavelengths = _numbers(document, "wavelength_nm", WAVELENGTH_NM)
    if any(late <= early for early, late in zip(wavelengths, wavelengths[1:], strict=False)):
        raise InputRefusedError(f"wavelength_nm is {list(wavelengths)}; it must be ascending.")
    media = {}
    for name in _MEDIA:
        values = _numbers(document, name, INDEX)
        if len(values) not in (1, len(wavelengths)):
            raise InputRefusedError(
                f"{name} has {len(values)} values for {len(wavelengths)} wavelengths; give one number or one "
                "for each wavelength."
            )
        media[name] = values * len(wavelengths) if len(values) == 1 else values
    given = [name for name in DESCRIPTIONS if name in document]
    if len(given) != 1:
        found = " and ".join(f"[{name}]" for name in given) or "none"
        raise InputRefusedError(
            f"the surface is described by {found}; give exactly one of the tables "
            f"{', '.join(f'[{name}]' for name in DESCRIPTIONS)}."
        )
    (kind,) = given
    table = table_of(document, kind)
    only(table, (*DESCRIPTIONS[kind], *OTHER_KEYS.get(kind, ())), f"[{kind}]")
    numbers = {key: _number(table, key, q, f"{kind}.{key}") for key, q in DESCRIPTIONS[kind].items()}
    if numbers.get("height_scale_standard_error", 0) >= numbers.get("height_scale", 1):
        raise InputRefusedError(
            f"{kind}.height_scale_standard_error is {numbers['height_scale_standard_error']:g}; it must be "
            f"smaller than the height_scale of {numbers['height_scale']:g}."
        )
    described = _DESCRIBED[kind](table, numbers, folder)
    return RoughBoundary(wavelengths, media["index_inside"], media["index_outside"], **described)


def _numbers(document: Mapping[str, Any], key: str, quantity: Quantity) -> tuple[float, ...]:
    """One number, or a list of them."""
    if key not in document:
        raise missing(key, key, quantity)
    given = document[key] if isinstance(document[key], list) else [document[key]]
    if not given:
        raise InputRefusedError(f"{key} is an empty list; give at least one number.")
    return tuple(bounded(value, quantity, key) for value in given)


def _number(table: Mapping[str, Any], key: str, quantity: Quantity, name: str) -> float:
    value = table.get(key, quantity.default)
    if value is None:
        raise missing(name, key, quantity)
    return bounded(value, quantity, name)


def _facets(table, numbers, _) -> dict[str, Any]:
    density = slope_density(choice(table, "density", DENSITIES, "[facets]"), numbers["sigma_deg"])
    return {"method": "facets", "shape": density}


def _k_correlation(_, numbers, __) -> dict[str, Any]:
    shape = KCorrelation(numbers["height_rms_um"] ** 2, numbers["length_b_um"], numbers["exponent"])
    return {"method": "waves", "shape": shape}


def _gaussian(_, numbers, __) -> dict[str, Any]:
    shape = GaussianSpectrum(numbers["height_rms_um"] ** 2, numbers["correlation_length_um"])
    return {"method": "waves", "shape": shape}


def _height_map(table, numbers, folder) -> dict[str, Any]:
    method = choice(table, "method", METHODS, "[height_map]")
    file = table.get("heights_um")
    values, pitch = read_map(file, table.get("pitch_um"), "height_map", folder)
    try:
        heights = HeightMap(values, pitch)
        shape = heights.slope_density() if method == "facets" else heights.power_spectrum()
    except InputRefusedError as problem:
        raise InputRefusedError(f"height_map.heights_um = {file!r}: {problem}") from None
    return {"method": method, "shape": shape, "heights": heights, **numbers}


_DESCRIBED = {
    "facets": _facets,
    "k_correlation": _k_correlation,
    "gaussian": _gaussian,
    "height_map": _height_map,
}
