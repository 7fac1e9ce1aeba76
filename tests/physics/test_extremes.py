"""Stacks at the edges of what can be described: dim, grazing, almost matched, with narrow peaks."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.validation.accuracy.random_stacks import examined
from jaxink import (
    ClearLayer,
    Directions,
    ScatteringLayer,
    SolverConfig,
    Stack,
    choose_sizes,
    diffuse_bsdf,
    hemispherical_power,
)
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.single_scattering import single_scattering_kernels

DIRECTIONS = Directions.from_degrees(
    [0.0, 0.0, 45.0, 45.0, 80.0], [0.0, 60.0, 30.0, 60.0, 45.0], [180.0, 180.0, 90.0, 180.0, 0.0], [False] * 5
)


def ink(refractive_index=1.5, optical_thickness=1.0, albedo=0.9, asymmetry=0.5) -> ScatteringLayer:
    return ScatteringLayer(refractive_index, optical_thickness, albedo, HenyeyGreenstein(asymmetry))


def behind(absorption, index=1.0062, layer=None) -> Stack:
    """An ink behind a clear layer that absorbs."""
    return Stack((ClearLayer(index, absorption), layer or ink(1.7426, 0.0276)), 1.0, 1.0)


@pytest.mark.parametrize("absorption", [36.0, 40.0, 50.0, 67.39, 100.0, 400.0, 1e4])
def test_an_ink_behind_an_opaque_layer_is_dark(absorption):
    config = SolverConfig(8, 6, 12, 3)
    found, slope = jax.jvp(lambda x: diffuse_bsdf(behind(x), DIRECTIONS, config), (absorption,), (1.0,))
    np.testing.assert_allclose(found, 0.0, atol=1e-12)
    np.testing.assert_allclose(slope, 0.0, atol=1e-12)


def test_light_of_a_dim_ink_keeps_its_digits():
    # Of a layer as thin as this, light is scattered once: nothing is interpolated but rounding.
    config, index = SolverConfig(12, 8, 8, 3), 1.0008
    thin = ink(1.6, 1e-6, 0.9, 0.0)
    for absorption in (1.0, 4.0):
        found = diffuse_bsdf(behind(absorption, index, thin), DIRECTIONS, config)
        clear = diffuse_bsdf(behind(0.0, index, thin), DIRECTIONS, config)
        angles = np.deg2rad([[0, 0, 45, 45, 80], [0, 60, 30, 60, 45]])
        sines = np.sin(angles) / index
        way = sum(1 / np.sqrt(1 - sine**2) for sine in sines)
        # Light that is reflected back and forth in the film without an index step passes it more often.
        np.testing.assert_allclose(found, clear * np.exp(-absorption * way), rtol=0.15)


@pytest.mark.parametrize("index", [1.0001, 1.001, 1.01, 1.05])
def test_a_layer_almost_of_the_index_of_air_is_as_accurate_as_asked(index):
    for thickness in (0.01, 0.1, 1.0):
        stack = Stack((ink(index, thickness, 1.0, 0.3),), 1.0, 1.0)
        total = sum(hemispherical_power(stack, np.sin(np.deg2rad([0.0, 45.0, 80.0, 85.0]))))
        np.testing.assert_allclose(total, 1.0, atol=1e-4)


def test_power_of_grazing_light_is_a_share_of_it_or_refused(refused):
    stack = Stack((ink(1.0, 0.01, 1.0, 0.3),), 1.0, 1.0)
    total = sum(hemispherical_power(stack, np.sin(np.deg2rad([60.0, 89.5, 89.9]))))
    np.testing.assert_allclose(total, 1.0, atol=1e-3)
    isotropic = Stack((ink(1.0, 0.001, 1.0, 0.0),), 1.0, 1.0)
    with refused("nodes_escaping"):
        hemispherical_power(isotropic, np.sin(np.deg2rad([89.99])), SolverConfig(42, 8, 16, 1))


@pytest.mark.parametrize("asymmetry", [-0.999, -0.99])
def test_a_backward_peak_that_nothing_resolves_is_refused(refused, asymmetry):
    with refused("asymmetry parameter"):
        choose_sizes(Stack((ink(asymmetry=asymmetry),), 1.0, 1.0))
    assert choose_sizes(Stack((ink(asymmetry=-asymmetry),), 1.0, 1.0)).n_moments > 100


@pytest.mark.parametrize("asymmetry", [-0.999, -0.9])
def test_moments_that_remain_of_a_backward_peak_are_possible(asymmetry):
    # With too few moments for the peak, a negative power would show moments beyond 1.
    stack = Stack((ink(1.5, 2.0, 1.0, asymmetry),), 1.0, 1.0)
    reflected, transmitted = hemispherical_power(stack, np.array([0.0, 0.5]), SolverConfig(16, 16, 12, 1))
    assert np.all(np.asarray(reflected) > 0)
    assert np.all(np.asarray(transmitted) > 0)
    np.testing.assert_allclose(reflected + transmitted, 1.0, atol=1e-3)


@pytest.mark.parametrize("apart", [0.0, 1e-8, 1e-4, 5e-4, 2e-3])
def test_depth_integrals_are_smooth_where_both_cosines_are_equal(apart):
    def transmitted(cosine):
        return single_scattering_kernels(cosine, jnp.asarray(0.9428), 0.7)[1]

    x, h = 0.9428 + apart, 1e-3
    slope, curvature = jax.grad(transmitted)(x), jax.grad(jax.grad(transmitted))(x)
    values = np.array([transmitted(x + k * h) for k in range(-3, 4)])
    np.testing.assert_allclose(slope, values @ [-1, 9, -45, 0, 45, -9, 1] / (60 * h), rtol=1e-8)
    np.testing.assert_allclose(curvature, values @ [2, -27, 270, -490, 270, -27, 2] / (180 * h**2), rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("structure", ["cs", "ss"])
def test_random_stacks(structure):
    faults = examined(structure, 40, 3)
    faults.pop("numbers")
    assert faults.pop("second derivative").max() < 1e-5
    for name, fault in faults.items():
        assert fault.max() < 2e-6, name
