"""The spheres of a fitted ink beside those of another program."""

from collections.abc import Mapping

import numpy as np

from jaxink.fitting.result import MieCheck
from jaxink.model.mie_sizes import mie_sizes
from jaxink.particles.independent_series import difference_from_miepython
from jaxink.sample import Sample

# More spheres are left out at equal intervals: those of neighbouring wavelengths are alike.
_MOST = 64


def mie_check(
    sample: Sample, values: Mapping[str, float], wavelengths_nm: tuple[float, ...]
) -> MieCheck | None:
    """How far the Mie series at the solution is from miepython's; None without Mie particles.

    Compared are the spheres of each population at each wavelength: that of the radius, of distributed ones
    also those a standard deviation to either side of it, and of tabulated radii all.

    Parameters
    ----------
    sample
        With the layers.
    values
        Value of every parameter, by name.
    wavelengths_nm
        In vacuum.
    """
    spheres: list[tuple[float, complex]] = []
    for wavelength in wavelengths_nm:
        here = sample.at_wavelength(values, wavelength)
        for layer in sample.layers:
            if layer.phase_function != "mie":
                continue
            binder = float(here[f"{layer.name}.refractive_index"])
            for kind, table in layer.particles.items():
                index = here[f"{kind}.particle_index"] + 1j * here[f"{kind}.particle_absorption_index"]
                for radius in _radii_nm(kind, table, here):
                    spheres.append((2 * np.pi * radius * binder / wavelength, complex(index / binder)))
    if not spheres:
        return None
    largest = mie_sizes(sample, wavelengths_nm).max_size_parameter
    # The model has none that is larger.
    sizes = np.minimum([x for x, _ in spheres], largest)
    indices = np.array([m for _, m in spheres])
    some = slice(None, None, -(-len(spheres) // _MOST))
    found = difference_from_miepython(sizes[some], indices[some], largest)
    return MieCheck(len(found), float(np.max(found)))


def _radii_nm(kind: str, table, values: Mapping[str, float]) -> list[float]:
    if table is not None:
        return list(table[0])
    radius = float(values[f"{kind}.radius_nm"])
    variance = values.get(f"{kind}.radius_variance_ln")
    if variance is None:
        return [radius]
    deviation = float(np.sqrt(variance))
    return [radius * float(np.exp(step * deviation)) for step in (-1, 0, 1)]
