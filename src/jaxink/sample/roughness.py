"""Rough faces in a sample file: facet slopes, a power spectrum of heights, or a height map."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.sample.entries import choice, only
from jaxink.sample.heights import read_map
from jaxink.sample.parameter_reading import ParameterReader
from jaxink.sample.schema import (
    AMPLITUDES,
    FACETS_ENTRIES,
    HEIGHT_MAP,
    HEIGHT_MAP_ENTRIES,
    HEIGHT_MAP_WORD,
    ROUGHNESS,
    ROUGHNESS_DENSITIES,
    SECOND_ROUGHNESS,
    SPECTRA,
    WAVES_ENTRIES,
)


@dataclasses.dataclass(frozen=True)
class Roughness:
    """Declared roughness of one face of a layer.

    Parameters
    ----------
    face
        ``front_roughness`` (towards the light) or ``back_roughness``.
    density, second_density
        For facets: one of `schema.ROUGHNESS_DENSITIES` or ``height_map``, and a second density or None.
    name
        First part of the names of its parameters, such as ``ink.back_roughness``.
    spectrum, amplitude
        For wave optics: one of `schema.SPECTRA` or ``height_map``, and one of `schema.AMPLITUDES`.
    nodes
        For a map: slopes and logarithms of their density, or logarithms of frequencies (1/um) and of the
        power spectrum; and the height variance (um^2).
    heights_um, pitch_um
        For a map: its file, and the distances between neighbouring heights.
    """

    __repr__ = brief_repr

    face: str
    density: str | None
    second_density: str | None
    name: str
    spectrum: str | None = None
    amplitude: str | None = None
    nodes: tuple[tuple[float, ...], tuple[float, ...], float] | None = None
    heights_um: str | None = None
    pitch_um: tuple[float, ...] = ()

    @property
    def strength(self) -> str:
        """Name of the parameter that makes the face smooth if it is 0."""
        if HEIGHT_MAP_WORD in (self.density, self.spectrum):
            return f"{self.name}.height_scale"
        return f"{self.name}.{'height_rms_um' if self.spectrum else 'sigma_deg'}"


def read_roughness(layer: str, face: str, given: Any, folder: Path, numbers: ParameterReader) -> Roughness:
    """One rough face; its numbers become parameters.

    Parameters
    ----------
    layer, face
        Names of the layer and of the face.
    given
        Its entry in the file.
    folder
        Folder of files that the entry names.
    numbers
        Collects the parameters.
    """
    where = f"{layer}.{face}"
    if not isinstance(given, dict):
        raise InputRefusedError(f'{where} must be {{ density = "...", sigma_deg = ... }}.')
    if "spectrum" in given and "density" in given:
        raise InputRefusedError(
            f"{where} has both a density (facets) and a spectrum (wave optics); remove one of them."
        )
    by_waves = "spectrum" in given
    fields, keys, quantities = (_by_waves if by_waves else _by_facets)(given, where)
    is_map = HEIGHT_MAP_WORD in fields.values()
    only(given, keys | (HEIGHT_MAP_ENTRIES if is_map else {}) | quantities, where)
    nodes, pitch = _nodes(given, where, folder, by_waves) if is_map else (None, None)
    numbers.read(where, quantities, given)
    if is_map:
        fields["heights_um"] = str((folder / given["heights_um"]).resolve())
        fields["pitch_um"] = tuple(map(float, pitch if isinstance(pitch, tuple) else [pitch]))
    return Roughness(face, name=where, nodes=nodes, **fields)


def _by_waves(given: dict[str, Any], where: str):
    """Fields of `Roughness`, valid keys, and quantities of the numbers."""
    spectrum = choice(given, "spectrum", (*SPECTRA, HEIGHT_MAP_WORD), where)
    amplitude = choice({"amplitude": AMPLITUDES[0]} | given, "amplitude", AMPLITUDES, where)
    fields = {"density": None, "second_density": None, "spectrum": spectrum, "amplitude": amplitude}
    return fields, WAVES_ENTRIES, SPECTRA.get(spectrum, HEIGHT_MAP)


def _by_facets(given: dict[str, Any], where: str):
    """As `_by_waves`."""
    second = given.get("second_density")
    known = ROUGHNESS_DENSITIES if second is not None else (*ROUGHNESS_DENSITIES, HEIGHT_MAP_WORD)
    density = choice(given, "density", known, where)
    quantities = HEIGHT_MAP if density == HEIGHT_MAP_WORD else ROUGHNESS
    if second is not None:
        choice(given, "second_density", ROUGHNESS_DENSITIES, where)
        quantities = quantities | SECOND_ROUGHNESS
    return {"density": density, "second_density": second}, FACETS_ENTRIES, quantities


def _nodes(given: dict[str, Any], where: str, folder: Path, by_waves: bool):
    """Slope density or power spectrum of a measured map, and its pitch."""
    # Imported late: reading a sample needs JAX only if there is a map.
    from jaxink.numerics.precision import computing
    from jaxink.surfaces import HeightMap

    heights, pitch = read_map(given.get("heights_um"), given.get("pitch_um"), where, folder)
    try:
        surface = HeightMap(heights, pitch)
        with computing():
            if by_waves:
                spectrum = surface.power_spectrum()
                variance = float(spectrum.height_variance_um2)
                columns = spectrum.log_frequency, spectrum.log_shape
            else:
                density = surface.slope_density()
                variance, columns = surface.height_variance_um2, (density.slopes, density.log_density)
            first, second = (tuple(np.asarray(column, float).tolist()) for column in columns)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{where}.heights_um: {problem}") from None
    return (first, second, variance), pitch
