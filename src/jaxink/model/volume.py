"""Optics and coefficients of a layer from the values of its parameters."""

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from jaxink.errors import InputRefusedError
from jaxink.model.size_classes import MieSizes
from jaxink.numerics.precision import computing
from jaxink.optics import OPAQUE_OPTICAL_THICKNESS, ClearLayer, ScatteringLayer, ScatteringMatrix
from jaxink.particles import (
    PHASE_FUNCTIONS,
    MieCoefficients,
    MixtureCoefficients,
    PhaseFunction,
    Rayleigh,
    SpherePopulation,
    TabulatedByAngle,
    TabulatedByMoments,
    discrete,
    log_normal,
    mie_coefficients,
    mixture_coefficients,
    mixture_matrix,
    monodisperse,
)
from jaxink.sample import Layer

_SMALL = MieSizes()


class VolumeScattering(NamedTuple):
    """Scattering in the volume of a layer at one wavelength.

    Parameters
    ----------
    phase_function
        Phase function of single scattering.
    scattering_per_mm, absorption_per_mm
        Coefficients; for an opaque layer without particles only their ratio is meaningful.
    """

    phase_function: PhaseFunction
    scattering_per_mm: Float[Array, ""]
    absorption_per_mm: Float[Array, ""]


class LayerCoefficients(eqx.Module):
    """Volume scattering of one layer at one wavelength.

    Parameters
    ----------
    scattering_per_mm, absorption_per_mm
        Coefficients.
    asymmetry_parameter
        Mean cosine g of the scattering angle.
    reduced_scattering_per_mm
        scattering (1 - g).
    reduced_optical_thickness
        scattering (1 - g) thickness; infinite if opaque.
    """

    scattering_per_mm: Float[Array, ""]
    absorption_per_mm: Float[Array, ""]
    asymmetry_parameter: Float[Array, ""]
    reduced_scattering_per_mm: Float[Array, ""]
    reduced_optical_thickness: Float[Array, ""]


def layer_optics(
    layer: Layer, values: Mapping, wavelength_nm, sizes: MieSizes
) -> tuple[ClearLayer | ScatteringLayer, LayerCoefficients | None]:
    """Optics of one layer at one wavelength, and its coefficients; None for a clear one.

    The arguments are those of `volume_scattering`.
    """

    def get(key):
        return values[f"{layer.name}.{key}"]

    if not layer.scatters:
        return ClearLayer(get("refractive_index"), get("absorption_per_mm") * get("thickness_mm")), None
    phase, scattering, absorption = volume_scattering(layer, values, wavelength_nm, sizes)
    extinction = scattering + absorption
    asymmetry = phase.moments(2)[1]
    if layer.opaque:
        thickness, reduced = jnp.asarray(OPAQUE_OPTICAL_THICKNESS), jnp.asarray(jnp.inf)
    else:
        thickness_mm = get("thickness_um") / 1000
        thickness = extinction * thickness_mm
        reduced = scattering * (1 - asymmetry) * thickness_mm
    # A layer without extinction has no albedo; any value will do.
    albedo = scattering / jnp.where(extinction > 0, extinction, 1.0)
    optics = ScatteringLayer(get("refractive_index"), thickness, albedo, phase)
    if layer.opaque and layer.phase_function != "mie":
        # Only the albedo of such a layer is defined: there is no length to scale its coefficients.
        scattering = absorption = jnp.asarray(jnp.nan)
    return optics, LayerCoefficients(scattering, absorption, asymmetry, scattering * (1 - asymmetry), reduced)


def volume_scattering(
    layer: Layer, values: Mapping[str, Float[ArrayLike, ""]], wavelength_nm, sizes: MieSizes = _SMALL
) -> VolumeScattering:
    """Phase function and coefficients of a scattering layer at one wavelength.

    Parameters
    ----------
    layer
        The layer.
    values
        Value of every parameter at this wavelength, by name without wavelength.
    wavelength_nm
        Wavelength in vacuum.
    sizes
        Sizes of the Mie series, for Mie particles.
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


def scattering_matrix(
    layer: Layer, values: Mapping[str, Float[ArrayLike, ""]], wavelength_nm, sizes: MieSizes = _SMALL
) -> ScatteringMatrix:
    """Scattering matrix of a layer of Rayleigh or Mie particles.

    The arguments are those of `volume_scattering`.
    """
    if layer.phase_function == "rayleigh":
        return Rayleigh().matrix()
    binder_index = values[f"{layer.name}.refractive_index"]
    populations = _populations(layer, values, sizes)
    matrix = mixture_matrix(populations, binder_index, wavelength_nm, sizes.max_size_parameter)
    if f"{layer.name}.structure_factor_weight" not in values:
        return matrix
    return matrix.with_phase_function(volume_scattering(layer, values, wavelength_nm, sizes).phase_function)


def check_phase_table(layer: Layer) -> None:
    """Reject an invalid table of a phase function; compiled predictions cannot check its numbers.

    Raises
    ------
    InputRefusedError
        With the layer and what is wrong.
    """
    if layer.phase_table is None:
        return
    # Evaluated to numbers even if the model is made inside a function that is being compiled.
    with computing(), jax.ensure_compile_time_eval():
        try:
            _phase_function(layer, None)
        except InputRefusedError as problem:
            raise InputRefusedError(f"layer '{layer.name}': {problem}") from None


def _phase_function(layer: Layer, get) -> PhaseFunction:
    if layer.phase_table is not None:
        kind, angles, numbers = layer.phase_table
        if kind == "moments":
            return TabulatedByMoments(jnp.asarray(np.array(numbers)))
        return TabulatedByAngle(np.cos(np.deg2rad(angles)), np.array(numbers))
    assert layer.phase_function is not None, "a layer that scatters has one"
    of_name = PHASE_FUNCTIONS[layer.phase_function]
    return of_name(**{field.name: get(field.name) for field in dataclasses.fields(of_name)})


def _mie(layer: Layer, values, wavelength_nm, sizes: MieSizes) -> VolumeScattering:
    """Mie particles; equal spheres that scatter independently need no mixture."""
    name, binder_index = layer.name, values[f"{layer.name}.refractive_index"]
    weight = values.get(f"{name}.structure_factor_weight")
    found: MieCoefficients | MixtureCoefficients
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
        populations = _populations(layer, values, sizes)
        found = mixture_coefficients(
            populations, binder_index, wavelength_nm, weight, sizes.max_size_parameter
        )
    phase_function, scattering, absorption = found
    binder = values.get(f"{name}.binder_absorption_per_mm")
    if binder is not None:
        absorption += (1 - sum(values[f"{kind}.volume_fraction"] for kind in layer.particles)) * binder
    return VolumeScattering(phase_function, scattering, absorption)


def _populations(layer: Layer, values, sizes: MieSizes) -> tuple[SpherePopulation, ...]:
    return tuple(
        SpherePopulation(
            _size_distribution(kind, table, values, dict(sizes.n_sizes)),
            _particle_index(kind, values),
            values[f"{kind}.volume_fraction"],
        )
        for kind, table in layer.particles.items()
    )


def _particle_index(kind: str, values):
    return values[f"{kind}.particle_index"] + 1j * values[f"{kind}.particle_absorption_index"]


def _size_distribution(kind: str, table, values, n_sizes: Mapping[str, int]):
    if table is not None:
        return discrete(jnp.array(table[0]), jnp.array(table[1]))
    radius = values[f"{kind}.radius_nm"]
    variance = values.get(f"{kind}.radius_variance_ln")
    return monodisperse(radius) if variance is None else log_normal(radius, variance, n_sizes[kind])
