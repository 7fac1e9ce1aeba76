"""Channels of a stack: found from its refractive indices, or planned for those that vary."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink import ClearLayer, Directions, ScatteringLayer, SolverConfig, Stack, diffuse_bsdf, plan_channels
from jaxink.errors import InputRefusedError
from jaxink.particles.phase_function import HenyeyGreenstein

CONFIG = SolverConfig(8, 6, 12, 4)
DIRECTIONS = Directions.from_degrees([0.0, 30.0], [20.0, 70.0], [0.0, 180.0], [False, True])


def stack_of(index=1.5, albedo=0.9, **more):
    """An ink behind a plate of index 1.5, in air."""
    ink = ScatteringLayer(index, 2.0, albedo, HenyeyGreenstein(0.5))
    return Stack((ClearLayer(1.5, 0.0), ink), 1.0, 1.0, **more)


def test_media_that_need_channels():
    plan = plan_channels(stack_of())
    assert (plan.block_media, plan.exposed, plan.rarest) == ((0, 2), False, (0, 3))
    # An index that may go anywhere keeps a block of its own, and so does the plate beside it.
    assert plan_channels(stack_of(), free=[2]).block_media == (0, 1, 2)
    assert plan_channels(stack_of(), free=[0, 3]).rarest == ()
    in_air = Stack((ScatteringLayer(1.0, 2.0, 0.9, HenyeyGreenstein(0.5)),), 1.0, 1.0)
    assert plan_channels(in_air).exposed
    assert not plan_channels(in_air, free=[1]).exposed
    # A backing sends light into all directions of a medium above the ink's index.
    behind = Stack(stack_of().layers, 1.0, 1.6)
    assert plan_channels(behind).block_media == (0, 2)
    assert plan_channels(Stack(behind.layers, 1.0, 1.6, backing=jnp.asarray(0.5))).block_media == (0, 2, 3)


def test_plan_of_the_other_side():
    plan = plan_channels(Stack(stack_of(1.4).layers, 1.0, 1.33))
    assert plan.reversed(2) == plan_channels(Stack(stack_of(1.4).layers[::-1], 1.33, 1.0))
    assert plan.reversed(2).reversed(2) == plan


def test_known_indices_are_planned_within_a_compiled_function():
    @jax.jit
    def value_and_slope(albedo):
        return jax.jvp(lambda a: diffuse_bsdf(stack_of(albedo=a), DIRECTIONS, CONFIG), (albedo,), (1.0,))

    value, slope = value_and_slope(0.9)
    np.testing.assert_allclose(value, diffuse_bsdf(stack_of(), DIRECTIONS, CONFIG), rtol=1e-12)
    assert np.all(slope > 0)


@pytest.mark.parametrize("transformed", [jax.jit, jax.jacfwd, jax.jacrev])
def test_an_index_that_varies_has_to_be_planned_before(transformed, told):
    plan = plan_channels(stack_of(), free=[2])

    def bsdf(index, plan=None):
        return diffuse_bsdf(stack_of(index), DIRECTIONS, CONFIG, plan)

    with pytest.raises(InputRefusedError) as error:
        transformed(bsdf)(1.5)
    told(str(error.value), "refractive index", "plan_channels")
    planned = transformed(lambda index: bsdf(index, plan))(1.5)
    assert np.all(np.isfinite(planned))
    np.testing.assert_allclose(bsdf(1.5, plan), bsdf(1.5), rtol=1e-9)


def test_a_stack_that_does_not_scatter_is_refused(told):
    with pytest.raises(InputRefusedError) as error:
        diffuse_bsdf(Stack((ClearLayer(1.5, 0.0),), 1.0, 1.0), DIRECTIONS, CONFIG)
    told(str(error.value), "ScatteringLayer")
