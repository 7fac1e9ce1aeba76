"""Rough interfaces inside a stack: energy, reciprocity, the smooth limit, derivatives, and Monte Carlo."""

import dataclasses
import json

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxink
from jaxink import (
    ClearLayer,
    Directions,
    ScatteringLayer,
    SolverConfig,
    Stack,
    diffuse_bsdf,
    hemispherical_power,
)
from jaxink.errors import NoDerivativeError
from jaxink.optics.fresnel import propagating_cosine
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.plan import plan_channels
from jaxink.surfaces.facets import FacetRule
from jaxink.surfaces.interface import RoughSizes, rough_interface
from jaxink.surfaces.lobes import reflected_lobe, transmitted_lobe
from jaxink.surfaces.slopes import slope_density
from tests.surfaces.densities import gaussian_slopes

CONFIG = SolverConfig(12, 10, 16, 10)
PLATE = ClearLayer(1.5, 0.0)
ORDERS = ("exit face", "entry face", "both faces", "inner face")


def ink(optical_thickness, albedo=1.0, index=1.5):
    return ScatteringLayer(index, optical_thickness, albedo, HenyeyGreenstein(0.6))


def stack_of(order, density, albedo=1.0):
    """Layers with one or two rough faces."""
    if order == "exit face":
        stack = Stack((PLATE, ink(3.0, albedo)), 1.0, 1.0, (None, None, density))
    elif order == "entry face":
        stack = Stack((ink(0.5, albedo),), 1.0, 1.0, (density, None))
    elif order == "both faces":
        stack = Stack((ink(1.0, albedo),), 1.0, 1.0, (density, density))
    else:
        layers = PLATE, ink(1.0, albedo, 1.6)
        stack = Stack(layers, 1.0, 1.0, (None, density, None))
    return stack


@eqx.filter_jit
def _interface(grid, outer, inner, density, sizes):
    return rough_interface(grid, (outer, inner), density, CONFIG.n_orders, sizes)


def plan_with_interfaces(stack):
    """The faces computed by one compiled program, with the nodes of a table."""
    plan = plan_channels(stack)

    def computed(k):
        outer, inner = (jnp.asarray(stack.indices[side]) for side in stack.sides(k))
        n_outer = plan.n_outer(stack, k, CONFIG)
        fine = RoughSizes(FacetRule(72, 20), FacetRule(72, 16), n_outer, coarse_nodes=12)
        return _interface(plan.grid(stack, CONFIG), outer, inner, stack.faces[k], fine)

    interfaces = {k: computed(k) for k in stack.rough}
    return dataclasses.replace(plan, interfaces=interfaces)


@pytest.mark.parametrize("order", ORDERS)
def test_energy(order):
    """Without absorption all light comes out again; 26 degrees: the median facet is tilted by 30."""
    stack = stack_of(order, slope_density("beckmann", 26.0))
    plan = plan_with_interfaces(stack)
    # At the solver's own channels the power is not interpolated.
    sines = np.asarray(plan.grid(stack, CONFIG).kappa[: CONFIG.nodes_escaping])
    reflectance, transmittance = hemispherical_power(stack, sines, CONFIG, plan)
    np.testing.assert_allclose(reflectance + transmittance, 1.0, atol=1e-9)
    assert np.all(np.asarray(reflectance) > 0.02)
    assert np.all(np.asarray(transmittance) > 0.02)


@pytest.mark.parametrize("density", ["beckmann", "cauchy"])
def test_receivers_that_do_not_propagate_outside_may_be_left_out(density):
    """That their number is known changes the quadrature, and nothing else."""
    stack = stack_of("exit face", slope_density(density, 10.0))
    plan = plan_channels(stack)
    outer, inner = (jnp.asarray(stack.indices[side]) for side in stack.sides(2))
    grid, n_outer = plan.grid(stack, CONFIG), plan.n_outer(stack, 2, CONFIG)
    assert n_outer < grid.kappa.size
    rules = FacetRule(108, 24), FacetRule(72, 16)
    without, known = (
        _interface(grid, outer, inner, stack.faces[2], RoughSizes(*rules, n)).total for n in (None, n_outer)
    )
    # Rows are accurate for smooth light, not entry by entry.
    smooth = np.asarray(grid.kappa)[:, None] ** np.array([0, 2, 4])
    for name in ("outer_reflection", "inner_reflection", "leaving"):
        found, expected = (np.asarray(getattr(one, name))[0] @ smooth for one in (known, without))
        np.testing.assert_allclose(found, expected, rtol=2e-4, atol=2e-4 * np.max(expected))


@pytest.mark.parametrize("order", ORDERS)
def test_reciprocity(order):
    pairs = np.array([(20.0, 50.0), (50.0, 20.0), (75.0, 35.0), (35.0, 75.0)])
    directions = Directions.from_degrees(pairs[:, 0], pairs[:, 1], np.full(4, 140.0), np.zeros(4, bool))
    stack = stack_of(order, slope_density("beckmann", 10.0), 0.9)
    bsdf = np.asarray(diffuse_bsdf(stack, directions, CONFIG, plan_with_interfaces(stack)))
    np.testing.assert_allclose(bsdf[::2], bsdf[1::2], rtol=3e-3)


def test_flat_faces_are_smooth_ones():
    directions = Directions.from_degrees(
        [0.0, 30.0, 60.0] * 2, [40.0, 10.0, 75.0] * 2, [180.0, 0.0, 90.0] * 2, [False] * 3 + [True] * 3
    )
    smooth = Stack((PLATE, ink(3.0, 0.95)), 1.0, 1.0)
    expected = diffuse_bsdf(smooth, directions, CONFIG)
    for variance, within in ((0.0, 1e-3), (1e-5, 5e-3)):
        nearly = stack_of("exit face", gaussian_slopes(variance), 0.95)
        found = diffuse_bsdf(nearly, directions, CONFIG, plan_with_interfaces(nearly))
        np.testing.assert_allclose(found, expected, rtol=within)


def test_derivative_in_the_width():
    """Also at the flat surface, in the variance of the slopes."""
    directions = Directions.from_degrees([30.0, 30.0], [10.0, 20.0], [180.0, 0.0], [True, False])

    @jax.jit
    def value_and_slope(variance):
        def bsdf(v):
            return diffuse_bsdf(stack_of("entry face", gaussian_slopes(v), 0.95), directions, CONFIG)

        return jax.jvp(bsdf, (variance,), (1.0,))

    # The sum over facets has steps as they move with the density: only wide differences tell the slope.
    here, step = 0.01, 1e-3
    values = [value_and_slope(here + k * step)[0] for k in (-2, -1, 1, 2)]
    difference = np.array([1, -8, 8, -1]) @ np.array(values) / (12 * step)
    np.testing.assert_allclose(value_and_slope(here)[1], difference, rtol=0.05)
    flat = value_and_slope(0.0)[1]
    assert np.all(np.isfinite(flat))
    assert np.any(np.abs(flat) > 1e-3)


ROUGH = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = 63
radius_nm = 250
volume_fraction = 0.0177
particle_index = 1.8
particle_absorption_index = 0.001
back_roughness = { density = "cauchy", sigma_deg = 3.2 }
"""


def test_simulated_white_ink_with_a_rough_surface(shared_data):
    """Independent Monte Carlo of the plate with all bounces of its facets, without measurement noise."""
    data = jaxink.read(shared_data / "simulated" / "white_ink_rough.csv")
    truth = json.loads((shared_data / "simulated" / "white_ink_rough.truth.json").read_text())
    sample = jaxink.parse_sample(ROUGH)
    predicted = jaxink.predict(sample, data)
    expected, error = np.array(truth["noise_free"]), np.array(truth["monte_carlo_se"])
    deviation = (predicted - expected) / error
    assert np.sqrt(np.mean(deviation**2)) < 1.25
    assert np.sqrt(np.mean((predicted / expected - 1) ** 2)) < 3e-3
    smooth = jaxink.predict(jaxink.parse_sample(ROUGH.replace("sigma_deg = 3.2", "sigma_deg = 0")), data)
    assert np.sqrt(np.mean((smooth / expected - 1) ** 2)) > 0.03


@pytest.mark.parametrize("lobe", [reflected_lobe, transmitted_lobe])
def test_lobes_have_a_derivative_by_the_index_along_the_normal(lobe):
    """Of light inside, whose cosines follow from the index."""
    kappa = jnp.array([0.0, 0.3])

    def of_index(index):
        cosine = propagating_cosine(1 - (kappa / index) ** 2)
        outside = cosine if lobe is reflected_lobe else propagating_cosine(1 - kappa**2)
        return lobe(
            (jnp.asarray(index), jnp.asarray(1.0)), outside, cosine, jnp.zeros(2), gaussian_slopes(0.02)
        )

    _, slope = jax.jvp(of_index, (1.5,), (1.0,))
    step = 1e-6
    difference = (of_index(1.5 + step) - of_index(1.5 - step)) / (2 * step)
    np.testing.assert_allclose(slope, difference, rtol=1e-5)


def test_second_derivatives_by_an_index_beside_facets_are_refused_by_name():
    def stack(index):
        return Stack((PLATE, ink(1.0, index=index)), 1.0, 1.0, (None, gaussian_slopes(0.02), None))

    plan, direction = plan_channels(stack(1.6), (2,)), Directions.from_degrees([10.0], [20.0], [0.0], [False])

    def bsdf(index):
        return diffuse_bsdf(stack(index), direction, SolverConfig(4, 3, 6, 2), plan)

    with pytest.raises(NoDerivativeError, match="face 1 of the stack consists of facets"):
        jax.eval_shape(jax.jacfwd(jax.jacfwd(bsdf)), 1.6)
