"""How a sample file describes a rough face: by facet slopes, by a spectrum of heights, or by a map."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.sample.entries import choice, only
from jaxink.sample.heights import read_heights, read_pitch
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
        Facet slopes, of `schema.ROUGHNESS_DENSITIES`, or ``height_map``; the second is None where there is
        one density only, and the first where light is scattered by a spectrum of heights.
    name
        First part of the names of its parameters, such as ``ink.back_roughness``.
    spectrum, amplitude
        By wave optics: of `schema.SPECTRA`, or ``height_map``, and of `schema.AMPLITUDES`; else None.
    nodes
        Of a map: slopes and logarithms of their density, or logarithms of frequencies (1/um) and of the power
        spectrum, and the variance of its heights (um^2); else None.
    """

    face: str
    density: str | None
    second_density: str | None
    name: str
    spectrum: str | None = None
    amplitude: str | None = None
    nodes: tuple[tuple[float, ...], tuple[float, ...], float] | None = None

    @property
    def strength(self) -> str:
        """Name of the parameter without which the face is smooth."""
        if HEIGHT_MAP_WORD in (self.density, self.spectrum):
            return f"{self.name}.height_scale"
        return f"{self.name}.{'height_rms_um' if self.spectrum else 'sigma_deg'}"


def read_roughness(layer: str, face: str, given: Any, folder: Path, numbers: ParameterReader) -> Roughness:
    """A face that is declared rough; its numbers become parameters.

    Parameters
    ----------
    layer, face
        Names of the layer, and of the face.
    given
        What the file says.
    folder
        Where files that it names are looked for.
    numbers
        Takes its numbers.
    """
    where = f"{layer}.{face}"
    if not isinstance(given, dict):
        raise InputRefusedError(f'{where} must be {{ density = "...", sigma_deg = ... }}.')
    if "spectrum" in given and "density" in given:
        raise InputRefusedError(
            f"{where} has both a density (facets) and a spectrum (waves); a face is one or the other."
        )
    by_waves = "spectrum" in given
    fields, keys, quantities = (_by_waves if by_waves else _by_facets)(given, where)
    is_map = HEIGHT_MAP_WORD in fields.values()
    only(given, keys | (HEIGHT_MAP_ENTRIES if is_map else {}) | quantities, where)
    nodes = _nodes(given, where, folder, by_waves) if is_map else None
    numbers.read(where, quantities, given)
    return Roughness(face, name=where, nodes=nodes, **fields)


def _by_waves(given: dict[str, Any], where: str):
    """Fields of `Roughness`, keys that go with them, and numbers."""
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
    """What the rays or waves need of a measured map."""
    # Reading a sample needs no JAX, unless it has a map.
    from jaxink.numerics.precision import computing
    from jaxink.surfaces.height_map import HeightMap

    heights = read_heights(given.get("heights_um"), f"{where}.heights_um", folder)
    pitch = read_pitch(given.get("pitch_um"), f"{where}.pitch_um", heights.ndim)
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
    return first, second, variance
