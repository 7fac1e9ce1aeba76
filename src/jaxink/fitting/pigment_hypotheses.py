"""Particles of another material than the sample names, as mistakes in the input."""

import dataclasses
from collections.abc import Iterator
from contextlib import suppress

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.fitting.hypotheses import Hypothesis, with_values_held
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
    for dispersion in sample.dispersions if sample.wavelengths_nm else ():
        kind, _, key = dispersion.name.rpartition(".")
        declared = _material_of(dispersion) if key == _INDEX else None
        if declared is None or sample.parameters[f"{dispersion.name}.offset"].free:
            continue
        opened = _opened(sample, dispersion, kind)
        added = {p.name for p in opened.parameters.free} - {p.name for p in sample.parameters.free}
        for name in names():
            other = material(name)
            if other is declared:
                continue
            # Nothing can be tested of a material that is not known at all wavelengths.
            with suppress(InputRefusedError):
                held = _indices(other, kind, np.array(sample.wavelengths_nm))
                yield Hypothesis(
                    f"particles_of_{kind}_are_{name}",
                    f"The particles of {kind} read like {name}, not {declared.name}",
                    f'write material = "{name}" for {dispersion.name}, and for the absorption index',
                    with_values_held(opened, {n: value for n, value in held.items() if n in added}),
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


def _opened(sample: Sample, dispersion: Dispersion, kind: str) -> Sample:
    """The sample with indices at each wavelength in the place of the material's, free to be held."""
    absorption = f"{kind}.{_ABSORPTION}"
    table = sample.parameters
    replaced, stems = {f"{dispersion.name}.offset"}, [dispersion.name]
    own = [name for name in table if name.partition("@")[0] == absorption]
    # It may also be free, tied, or follow a law with parameters of its own.
    if own and all(table[name].is_fixed for name in own):
        replaced |= set(own)
        stems.append(absorption)
    kept = [p for p in table.values() if p.name not in replaced]
    start = table.values_with({})
    for wavelength in sample.wavelengths_nm:
        here = sample.at_wavelength(start, wavelength)
        for stem in stems:
            kept.append(Parameter(f"{stem}@{wavelength:g}", float(here[stem]), True, 0.0, _HIGHEST))
    others = tuple(one for one in sample.dispersions if one is not dispersion)
    return dataclasses.replace(sample, parameters=ParameterTable(kept), dispersions=others)


def _indices(known: Material, kind: str, wavelengths_nm: np.ndarray) -> dict[str, float]:
    """Both indices of a material by the names of their values at the wavelengths."""
    columns = (_INDEX, known.n(wavelengths_nm)), (_ABSORPTION, known.k(wavelengths_nm))
    return {
        f"{kind}.{key}@{wavelength:g}": float(value)
        for key, values in columns
        for wavelength, value in zip(wavelengths_nm, values, strict=True)
    }
