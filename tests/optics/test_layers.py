"""Layers of known numbers without physical meaning are refused, traced ones pass."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxink
from jaxink.data import SIMULATED_TRUTH, simulated_example
from jaxink.optics.layers import ClearLayer, ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.stack import Stack

PHASE = HenyeyGreenstein(0.6)
LAYERS = {
    "refractive_index": lambda value: ClearLayer(value, 0.1),
    "index of an ink": lambda value: ScatteringLayer(value, 2.0, 0.9, PHASE),
    "optical_thickness": lambda value: ClearLayer(1.5, value),
    "thickness of an ink": lambda value: ScatteringLayer(1.5, value, 0.9, PHASE),
    "single_scattering_albedo": lambda value: ScatteringLayer(1.5, 2.0, value, PHASE),
}


@pytest.mark.parametrize("make", LAYERS.values(), ids=LAYERS)
@pytest.mark.parametrize("value", [-0.5, np.nan])
def test_a_layer_that_cannot_exist_is_refused_where_it_is_made(make, value, refused):
    with refused(f"{value:g}", "must be"):
        make(value)


def test_an_albedo_above_1_is_refused_but_not_for_rounding(refused):
    with refused("1.2", "from 0 to 1"):
        ScatteringLayer(1.5, 2.0, 1.2, PHASE)
    assert ScatteringLayer(1.5, 2.0, 1 + 1e-15, PHASE).single_scattering_albedo >= 1


def test_traced_numbers_pass_so_that_derivatives_at_the_edge_exist():
    def thickness(value):
        return ScatteringLayer(1.5, value, 0.9, PHASE).optical_thickness

    assert jax.jit(thickness)(-1.0) == -1.0
    assert jax.grad(thickness)(0.0) == 1.0
    # What JAX takes apart and puts together again is not judged.
    layer = ScatteringLayer(1.5, 2.0, 0.9, PHASE)
    assert jax.tree.map(jnp.negative, layer).optical_thickness == -2.0


@pytest.mark.parametrize("number", [int, float, np.float64, np.float32, jnp.asarray])
def test_whatever_the_type_of_a_number_it_is_the_same_program(number):
    def leaves(one):
        stack = Stack((ClearLayer(one, one), ScatteringLayer(one, one, one, HenyeyGreenstein(0))), one, one)
        return [(x.dtype, x.shape, x.weak_type) for x in jax.tree.leaves(stack)]

    assert leaves(number(1)) == leaves(1.0)


@pytest.mark.parametrize("name", ["ink.scattering_per_mm", "ink.absorption_per_mm", "ink.thickness_um"])
def test_a_sample_with_a_negative_coefficient_or_thickness_is_refused(name, coarse, refused):
    data, sample = jaxink.read(simulated_example()[0]), jaxink.load_sample(simulated_example()[1])
    table = sample.parameters.replace(name, value=-3.0, minimum=-5.0)
    negative = dataclasses.replace(sample, parameters=table)
    with refused(name, "-3"):
        jaxink.predict(negative, data, coarse)
    model = jaxink.forward_model(sample, data, coarse)
    with refused(name, "-3"):
        model.coefficients({**SIMULATED_TRUTH, name: -3.0})
