"""What a layer is made of: its phase function and coefficients from the values of its parameters."""

import dataclasses
import math
from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.precision import computing
from jaxink.particles.mie import DEFAULT_MAX_SIZE_PARAMETER, mie_coefficients
from jaxink.particles.mixture import Population, mixture_coefficients
from jaxink.particles.phase_function import (
    HenyeyGreenstein,
    PhaseFunction,
    Rayleigh,
    TabulatedByAngle,
    TabulatedByMoments,
    TwoTermHenyeyGreenstein,
)
from jaxink.particles.size_distribution import REACH, discrete, log_normal, monodisperse, sizes_needed
from jaxink.sample import Layer, Sample

# Size parameters that a compiled program may serve.
_SERVED = (DEFAULT_MAX_SIZE_PARAMETER, 80.0, 160.0, 320.0)
# A tail need not be served further than this many times the median by volume.
_TAIL = 4.0


class VolumeScattering(NamedTuple):
    """Scattering in the volume of a layer at one wavelength.

    Parameters
    ----------
    phase_function
        Of one scattering.
    scattering_per_mm, absorption_per_mm
        Coefficients; of an opaque layer without particles only their ratio has a meaning.
    """

    phase_function: PhaseFunction
    scattering_per_mm: Float[Array, ""]
    absorption_per_mm: Float[Array, ""]


@dataclasses.dataclass(frozen=True)
class MieSizes:
    """Sizes of the Mie series that a compiled program needs.

    Parameters
    ----------
    max_size_parameter
        Largest size parameter served.
    n_sizes
        Number of sizes of each log-normal distribution, by what the names of its parameters begin with.
    """

    max_size_parameter: float = DEFAULT_MAX_SIZE_PARAMETER
    n_sizes: tuple[tuple[str, int], ...] = ()


def mie_sizes(sample: Sample, wavelengths_nm: tuple[float, ...]) -> MieSizes:
    """Sizes of the Mie series that serve all particles of a sample wherever a fit may take them.

    Parameters
    ----------
    sample
        The sample.
    wavelengths_nm
        Wavelengths in vacuum.

    Raises
    ------
    InputRefusedError
        If particles are too large for the Mie series as the sample gives them.
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
                    f"Mie series is served up to {_SERVED[-1]:g}, here {_SERVED[-1] / per_nm:.0f} nm; give "
                    "smaller particles, or a phase function without a radius."
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
    """Largest value that a quantity has as given, and that it may come to have in a fit."""
    start = sample.parameters.values_with({})
    given = [p for p in sample.parameters.values() if p.name.split("@")[0] == name]
    return (
        max(start[p.name] for p in given),
        max(p.maximum if p.free else start[p.name] for p in given),
    )


def volume_scattering(
    layer: Layer, values: Mapping[str, Float[ArrayLike, ""]], wavelength_nm, sizes: MieSizes = MieSizes()
) -> VolumeScattering:
    """Phase function and coefficients of a scattering layer at one wavelength.

    Parameters
    ----------
    layer
        The layer.
    values
        Value of every parameter at this wavelength, by plain name.
    wavelength_nm
        Wavelength in vacuum.
    sizes
        Of the Mie series, for Mie particles.
    """
    if layer.phase_function == "mie":
        return _mie(layer, values, wavelength_nm, sizes)

    def get(key):
        return values[f"{layer.name}.{key}"]

    if layer.opaque:
        albedo = get("single_scattering_albedo")
        scattering, absorption = albedo, 1 - albedo
    else:
        scattering, absorption = get("scattering_per_mm"), get("absorption_per_mm")
    return VolumeScattering(_phase_function(layer, get), scattering, absorption)


def check_phase_table(layer: Layer) -> None:
    """Refuse a tabulated phase function that is none; compiled predictions do not look at its numbers.

    Raises
    ------
    InputRefusedError
        With the layer and what is wrong.
    """
    if layer.phase_function != "tabulated":
        return
    # Numbers, even where a model is made within a function that is being compiled.
    with computing(), jax.ensure_compile_time_eval():
        try:
            _phase_function(layer, None)
        except InputRefusedError as problem:
            raise InputRefusedError(f"layer '{layer.name}': {problem}") from None


def _phase_function(layer: Layer, get) -> PhaseFunction:
    if layer.phase_function == "henyey_greenstein":
        return HenyeyGreenstein(get("asymmetry_parameter"))
    if layer.phase_function == "two_term_henyey_greenstein":
        return TwoTermHenyeyGreenstein(
            get("asymmetry_parameter"), get("second_asymmetry_parameter"), get("second_weight")
        )
    if layer.phase_function == "rayleigh":
        return Rayleigh()
    kind, angles, numbers = layer.phase_table
    if kind == "moments":
        return TabulatedByMoments(np.array(numbers))
    return TabulatedByAngle(np.cos(np.deg2rad(angles)), np.array(numbers))


def _mie(layer: Layer, values, wavelength_nm, sizes: MieSizes) -> VolumeScattering:
    """Mie particles; equal spheres that scatter independently take the shorter way."""
    name, binder_index = layer.name, values[f"{layer.name}.refractive_index"]
    weight = values.get(f"{name}.structure_factor_weight")
    alone = not layer.populations and layer.radius_table is None and weight is None
    if alone and f"{name}.radius_variance_ln" not in values:
        found = mie_coefficients(
            radius_nm=values[f"{name}.radius_nm"],
            particle_index=_particle_index(name, values),
            volume_fraction=values[f"{name}.volume_fraction"],
            binder_index=binder_index,
            wavelength_nm=wavelength_nm,
            max_size_parameter=sizes.max_size_parameter,
        )
    else:
        populations = tuple(
            Population(
                _size_distribution(kind, table, values, dict(sizes.n_sizes)),
                _particle_index(kind, values),
                values[f"{kind}.volume_fraction"],
            )
            for kind, table in layer.particles.items()
        )
        found = mixture_coefficients(
            populations, binder_index, wavelength_nm, weight, sizes.max_size_parameter
        )
    phase_function, scattering, absorption = found
    binder = values.get(f"{name}.binder_absorption_per_mm")
    if binder is not None:
        absorption += (1 - sum(values[f"{kind}.volume_fraction"] for kind in layer.particles)) * binder
    return VolumeScattering(phase_function, scattering, absorption)


def _particle_index(kind: str, values):
    return values[f"{kind}.particle_index"] + 1j * values[f"{kind}.particle_absorption_index"]


def _size_distribution(kind: str, table, values, n_sizes: Mapping[str, int]):
    if table is not None:
        return discrete(jnp.array(table[0]), jnp.array(table[1]))
    radius = values[f"{kind}.radius_nm"]
    variance = values.get(f"{kind}.radius_variance_ln")
    return monodisperse(radius) if variance is None else log_normal(radius, variance, n_sizes[kind])
