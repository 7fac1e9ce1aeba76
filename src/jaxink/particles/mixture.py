"""Spheres of several sizes and kinds in one binder: coefficients and common phase function."""

from functools import lru_cache, partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.validity import as_float, is_known, require
from jaxink.optics import ScatteringMatrix
from jaxink.particles.mie import DEFAULT_MAX_SIZE_PARAMETER, MAX_RELATIVE_INDEX, mie_sphere
from jaxink.particles.mie_series import angular_quadrature, mie_orders
from jaxink.particles.phase_function import LegendreSeries
from jaxink.particles.size_distribution import SizeDistribution
from jaxink.particles.structure_factor import InterferingPhaseFunction, interfering, nodes_needed


class SpherePopulation(eqx.Module):
    """Spheres of one material.

    Parameters
    ----------
    sizes
        Distribution of their radius.
    particle_index
        Complex refractive index n + ik.
    volume_fraction
        Fraction of the layer's volume that they occupy.
    """

    sizes: SizeDistribution
    particle_index: Complex[Array, ""] = eqx.field(converter=lambda v: jnp.asarray(v, complex))
    volume_fraction: Float[Array, ""] = eqx.field(converter=as_float)


class LegendrePhaseFunction(LegendreSeries):
    """Computed phase function, whose moments need no check."""

    phase_moments: Float[Array, " moments"]


class MixtureCoefficients(NamedTuple):
    """Coefficients of all spheres of a layer together, and the phase function weighted by scattering."""

    phase_function: LegendrePhaseFunction | InterferingPhaseFunction
    scattering_coefficient_per_mm: Float[Array, ""]
    absorption_coefficient_per_mm: Float[Array, ""]


def mixture_coefficients(
    populations: tuple[SpherePopulation, ...],
    binder_index,
    wavelength_nm,
    structure_factor_weight=None,
    max_size_parameter: float = DEFAULT_MAX_SIZE_PARAMETER,
) -> MixtureCoefficients:
    """Scattering and absorption of populations of spheres in one binder.

    Parameters
    ----------
    populations
        The spheres.
    binder_index
        Real refractive index of the binder.
    wavelength_nm
        Wavelength in vacuum.
    structure_factor_weight
        s, 0 to 1: the phase function of each population is multiplied by 1 + s (S - 1) and its scattering
        coefficient by the mean of that product. S is `percus_yevick` for spheres of the population's mean
        volume at the volume fraction of all populations together. None: independent scattering.
    max_size_parameter
        As in `mie_sphere`; larger spheres in the tail of a distribution have the scattering efficiency and
        the phase function of a sphere of this size.

    Returns
    -------
    MixtureCoefficients
        Differentiable in every number, forward and reverse. All NaN if a radius outside a tail is out of
        range.

    Raises
    ------
    InputRefusedError
        If a known argument is out of range.

    Notes
    -----
    Each particle interferes as if all others were of its own kind at the same total volume fraction (local
    monodisperse approximation), so splitting a population in two changes nothing. This overestimates the
    order around a few large spheres among many small ones.

    References
    ----------
    Pedersen 1994 J. Appl. Cryst. 27, 595 (local monodisperse approximation).
    """
    if not populations:
        raise InputRefusedError("populations is empty; give at least one population of particles.")
    for name, value in (("binder_index", binder_index), ("wavelength_nm", wavelength_nm)):
        require(name, value, lambda v: v > 0, "be above 0")
    fractions = [p.volume_fraction for p in populations]
    if is_known(fractions):
        require("a volume_fraction", jnp.stack(fractions), lambda v: v >= 0, "be 0 or more")
        require("the volume fraction of all particles", sum(fractions), lambda v: v < 1, "be below 1")
    if structure_factor_weight is not None:
        weight = structure_factor_weight
        require("structure_factor_weight", weight, lambda v: (v >= 0) & (v <= 1), "be between 0 and 1")
    return _mixture(populations, binder_index, wavelength_nm, structure_factor_weight, max_size_parameter)


@partial(jax.jit, static_argnums=3)
def mixture_matrix(
    populations: tuple[SpherePopulation, ...],
    binder_index,
    wavelength_nm,
    max_size_parameter: float = DEFAULT_MAX_SIZE_PARAMETER,
) -> ScatteringMatrix:
    """Scattering matrix of populations of spheres in one binder, which scatter independently.

    The arguments are those of `mixture_coefficients`.
    """
    spheres, per_mm, _ = _spheres(populations, binder_index, wavelength_nm, max_size_parameter)
    _, weights, plus, minus, polynomials = _quadrature(max_size_parameter)
    elements = jax.vmap(lambda sphere: sphere.matrix_elements(plus, minus))(spheres)
    elements = jnp.tensordot(per_mm / spheres.size_parameter**2, elements, 1)
    scattering = elements[0] @ weights / 2
    # As the phase function of `mixture_coefficients`: isotropic if nothing scatters.
    isotropic = jnp.array([1.0, 0.0, 0.0])[:, None]
    elements = jnp.where(scattering == 0, isotropic, elements / jnp.where(scattering == 0, 1.0, scattering))
    return ScatteringMatrix((elements * weights / 2) @ polynomials)


@partial(jax.jit, static_argnums=4)
def _mixture(populations, binder_index, wavelength_nm, weight, max_size_parameter):
    wavenumber = 2 * jnp.pi * binder_index / wavelength_nm
    spheres, per_mm, total = _spheres(populations, binder_index, wavelength_nm, max_size_parameter)
    absorption = jnp.sum(per_mm * spheres.absorption_efficiency)

    nodes, weights, plus, minus, polynomials = _quadrature(max_size_parameter)
    intensity = jax.vmap(lambda sphere: sphere.intensity(plus, minus))(spheres)
    intensity = (per_mm / spheres.size_parameter**2)[:, None] * intensity
    sizes = [p.sizes.radius_nm.shape[0] for p in populations]
    of_population = np.repeat(np.arange(len(sizes)), sizes)
    angular = jax.ops.segment_sum(intensity, of_population, len(sizes))
    scattering = jnp.sum(angular @ weights) / 2
    # Spheres with the index of the binder do not scatter; their phase function is isotropic.
    angular = jnp.where(
        scattering == 0, 1 / len(sizes), angular / jnp.where(scattering == 0, 1.0, scattering)
    )
    moments = (angular * weights / 2) @ polynomials
    if weight is None:
        phase_function = LegendrePhaseFunction(jnp.sum(moments, axis=0))
    else:
        diameter = 2 * jnp.stack([p.sizes.volume_mean_radius_nm for p in populations])
        squared_phase = 2 * (wavenumber * diameter) ** 2
        n_nodes = nodes_needed(max_size_parameter)
        phase_function, left = interfering(moments, squared_phase, total, weight, n_nodes)
        scattering = scattering * left
    return MixtureCoefficients(phase_function, total * scattering, total * absorption)


def _spheres(populations, binder_index, wavelength_nm, max_size_parameter):
    """All spheres, their projected area per volume of particles in 1/mm, and the fraction of particles."""
    fractions = jnp.stack([p.volume_fraction for p in populations])
    total = jnp.sum(fractions)
    # Without particles the coefficients still have a derivative, which needs a phase function.
    parts = jnp.where(total > 0, fractions / jnp.where(total > 0, total, 1.0), 1 / len(populations))
    radius = jnp.concatenate([p.sizes.radius_nm for p in populations])
    share = jnp.concatenate([part * p.sizes.volume_share for part, p in zip(parts, populations, strict=True)])
    index = jnp.concatenate(
        [jnp.full(p.sizes.radius_nm.shape, p.particle_index / binder_index) for p in populations]
    )
    is_tail = jnp.concatenate([p.sizes.is_tail for p in populations])
    x = 2 * jnp.pi * binder_index / wavelength_nm * radius
    largest = max_size_parameter * jnp.minimum(1.0, MAX_RELATIVE_INDEX / jnp.real(index))
    x = jnp.where(is_tail, jnp.minimum(x, largest), x)
    spheres = jax.vmap(lambda x, m: mie_sphere(x, m, max_size_parameter))(x, index)
    return spheres, 0.75 * share / (radius * 1e-6), total


@lru_cache(maxsize=8)
def _quadrature(max_size_parameter: float):
    """Nodes, weights, angular functions and Legendre polynomials, shape ``(nodes, moments)``."""
    n_orders = mie_orders(max_size_parameter)
    # The phase function of a sphere is a polynomial of degree 2 n_orders: its moments are exact.
    n_moments = 2 * n_orders + 1
    quadrature = angular_quadrature(n_orders, n_moments)
    return *quadrature, np.polynomial.legendre.legvander(quadrature[0], n_moments - 1)
