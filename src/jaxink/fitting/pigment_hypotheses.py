"""Particles of another material than the sample names, as mistakes in the input."""

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np

from jaxink.fitting.hypotheses import Corrected, Hypothesis
from jaxink.materials import Material, material, names
from jaxink.sample import Dispersion, Parameter, ParameterTable, Sample

_INDEX, _ABSORPTION = "particle_index", "particle_absorption_index"
# Range of both while they are held.
_HIGHEST = 10.0


def of_pigments(sample: Sample) -> Iterator[Hypothesis]:
    """Each other material for particles whose index is that of a material; all of a kind share one program.

    Parameters
    ----------
    sample
        With its wavelengths; an absorption index that is free stays free.
    """
    wavelengths = np.array(sample.wavelengths_nm)
    for dispersion in sample.dispersions:
        kind, _, key = dispersion.name.rpartition(".")
        declared = _material_of(dispersion) if key == _INDEX and wavelengths.size else None
        if declared is None or sample.parameters[f"{dispersion.name}.offset"].free:
            continue
        opened = _opened(sample, dispersion, kind)
        for name in names():
            other = material(name)
            if other is not declared and _covers(other, wavelengths):
                yield Hypothesis(
                    f"particles_of_{kind}_are_{name}",
                    f"The particles of {kind} read like {name}, not {declared.name}",
                    f'write material = "{name}" for {dispersion.name}, and for the absorption index',
                    _with_values(opened, _held(opened, other, kind)),
                )


def _material_of(dispersion: Dispersion) -> Material | None:
    """The material whose table of indices this is."""
    if dispersion.formula != "table":
        return None
    for name in names():
        known = material(name)
        if (known.wavelength_nm.tolist(), known.index.tolist()) == (
            list(dispersion.wavelength_nm),
            list(dispersion.value),
        ):
            return known
    return None


def _covers(known: Material, wavelengths_nm: np.ndarray) -> bool:
    low, high = known.wavelength_nm[0], known.wavelength_nm[-1]
    finite = np.isfinite(known.absorption_index)
    if finite.any():
        at = known.wavelength_nm[finite]
        low, high = max(low, at[0]), min(high, at[-1])
    return bool(low <= wavelengths_nm.min() and wavelengths_nm.max() <= high)


def _opened(sample: Sample, dispersion: Dispersion, kind: str) -> Sample:
    """The sample with indices at each wavelength in the place of the material's, free to be held."""
    absorption = f"{kind}.{_ABSORPTION}"
    table = sample.parameters
    own = [name for name in table if name.partition("@")[0] == absorption]
    replaced = {f"{dispersion.name}.offset"}
    stems = [dispersion.name]
    if all(table[name].is_fixed for name in own):
        replaced |= set(own)
        stems.append(absorption)
    kept = [p for p in table.values() if p.name not in replaced]
    start = table.values_with({})
    for wavelength in sample.wavelengths_nm:
        here = sample.at_wavelength(start, wavelength)
        for stem in stems:
            value = float(here[stem])
            kept.append(Parameter(f"{stem}@{wavelength:g}", value, True, 0.0, _HIGHEST))
    others = tuple(one for one in sample.dispersions if one is not dispersion)
    return dataclasses.replace(sample, parameters=ParameterTable(kept), dispersions=others)


def _held(opened: Sample, other: Material, kind: str) -> dict[str, float]:
    """Indices of a material at the wavelengths."""
    wavelengths = np.array(opened.wavelengths_nm)
    found = {}
    for key, values in ((_INDEX, other.n(wavelengths)), (_ABSORPTION, other.k(wavelengths))):
        for wavelength, value in zip(wavelengths, values, strict=True):
            name = f"{kind}.{key}@{wavelength:g}"
            # What stays free has its own start.
            if name in opened.parameters and opened.parameters[name].maximum == _HIGHEST:
                found[name] = float(value)
    return found


def _with_values(opened: Sample, held: Mapping[str, float]):
    return lambda data, _: Corrected(data, opened, held=held)
