"""Sizes of the Mie series for all particles of a sample."""

import dataclasses
import math

from jaxink.errors import InputRefusedError
from jaxink.particles import DEFAULT_MAX_SIZE_PARAMETER, REACH, sizes_needed
from jaxink.sample import Sample

# Largest size parameters that compiled programs are made for.
_SERVED = (DEFAULT_MAX_SIZE_PARAMETER, 80.0, 160.0, 320.0)
# The tail of a distribution is followed up to this many times the median by volume.
_TAIL = 4.0


@dataclasses.dataclass(frozen=True)
class MieSizes:
    """Sizes of the Mie series that a compiled program needs.

    Parameters
    ----------
    max_size_parameter
        Largest size parameter covered.
    n_sizes
        Number of sizes of each log-normal distribution, by the prefix of its parameters' names.
    """

    max_size_parameter: float = DEFAULT_MAX_SIZE_PARAMETER
    n_sizes: tuple[tuple[str, int], ...] = ()


def mie_sizes(sample: Sample, wavelengths_nm: tuple[float, ...]) -> MieSizes:
    """Sizes of the Mie series that cover all particles of a sample throughout a fit.

    Parameters
    ----------
    sample, wavelengths_nm
        The sample and the wavelengths in vacuum.

    Raises
    ------
    InputRefusedError
        If the particles given in the sample are too large for the Mie series.
    """
    wanted, n_sizes = DEFAULT_MAX_SIZE_PARAMETER, []
    start = sample.parameters.values_with({})
    for layer in sample.layers:
        if layer.phase_function != "mie":
            continue
        per_nm = max(
            2 * math.pi * sample.at_wavelength(start, w)[f"{layer.name}.refractive_index"] / w
            for w in wavelengths_nm
        )
        for name, table in layer.particles.items():
            if table is not None:
                given = x = per_nm * max(table[0])
            else:
                given, x = (per_nm * largest for largest in _largest(sample, f"{name}.radius_nm"))
            if given > _SERVED[-1]:
                raise InputRefusedError(
                    f"layer '{layer.name}': particles '{name}' have a size parameter of {given:.4g}, but the "
                    f"Mie series is computed up to {_SERVED[-1]:g} only, here {_SERVED[-1] / per_nm:.0f} nm; "
                    "give smaller particles, or a phase function without a radius."
                )
            variance = f"{name}.radius_variance_ln"
            if any(p.split("@")[0] == variance for p in sample.parameters):
                largest = _largest(sample, variance)[1]
                n_sizes.append((name, sizes_needed(x, largest)))
                by_volume = x * math.exp(3 * largest)
                x = by_volume * min(math.exp(REACH * math.sqrt(largest)), _TAIL)
            wanted = max(wanted, x)
    served = next((x for x in _SERVED if x >= wanted), _SERVED[-1])
    return MieSizes(served, tuple(n_sizes))


def _largest(sample: Sample, name: str) -> tuple[float, float]:
    """Largest value of a quantity as given, and throughout a fit."""
    start = sample.parameters.values_with({})
    given = [p for p in sample.parameters.values() if p.name.split("@")[0] == name]
    return (
        max(start[p.name] for p in given),
        max(p.maximum if p.free else start[p.name] for p in given),
    )
