"""Conservation, reciprocity and additivity over a wide seeded grid of optics, in every order of layers."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.optics.directions import Directions
from jaxink.optics.layers import ClearLayer, ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.layer_response import LAYER_METHODS, layer_method
from jaxink.solver.plan import ChannelPlan
from jaxink.solver.stack import Stack
from tests.physics.probe import pair_angles

CONFIG = SolverConfig(10, 8, 20, 6)
N_SEEDED = 60


def seeded(albedo=None):
    """Columns albedo, g, tau, ink index, plate index; the corners of the ranges come first."""
    random = np.random.default_rng(11)
    corners = np.meshgrid([0.0, 1.0], [-0.95, 0.0, 0.95], [1e-6, 1.0, 1e4], [1.0, 1.5, 2.5], [1.0, 1.5])
    corners = np.column_stack([c.ravel() for c in corners])
    inside = np.column_stack(
        [
            1 - 10 ** random.uniform(-6, 0, N_SEEDED),
            random.uniform(-0.95, 0.95, N_SEEDED),
            10 ** random.uniform(-6, 4, N_SEEDED),
            random.uniform(1.0, 2.5, N_SEEDED),
            random.uniform(1.0, 2.5, N_SEEDED),
        ]
    )
    optics = np.concatenate([corners, inside])
    if albedo is not None:
        optics[:, 0] = albedo
    return optics


def ink(x, share=1.0):
    return ScatteringLayer(x[3], share * x[2], x[0], HenyeyGreenstein(x[1]))


def half(x):
    return ink(x, 0.5)


def plate(x):
    return ClearLayer(x[4], 0.0)


def second_ink(x):
    return ScatteringLayer(x[4], 0.3 * x[2], x[0], HenyeyGreenstein(-0.5 * x[1]))


ORDERS = {
    "ink": (ink,),
    "plate, ink": (plate, ink),
    "ink, plate": (ink, plate),
    "ink, plate, ink": (ink, plate, second_ink),
    "plate, ink, second ink": (plate, ink, second_ink),
}
LAYERS = ORDERS | {"two halves": (half, half)}


def make_stack(order, x, surroundings=None):
    """Stack of a row of optics in air, or between two media: then all indices may differ."""
    layers = tuple(layer(x) for layer in LAYERS[order])
    return Stack(layers, *((1.0, 1.0) if surroundings is None else surroundings))


def plan_of(order, surroundings=None):
    """Channels of such a stack, wherever its indices go."""
    if surroundings is None:
        # At most two indices: that of the ink, and that of the plate and the second ink.
        return ChannelPlan(tuple(range(min(len(set(LAYERS[order])), 2) + 1)))
    return ChannelPlan(tuple(range(len(LAYERS[order]) + 2)))


@eqx.filter_jit
def total_power(order, optics):
    """R + T of light entering by each channel, for every row of optics."""

    def one(x):
        stack, plan = make_stack(order, x), plan_of(order)
        kappa = plan.grid(stack, CONFIG).kappa[: CONFIG.nodes_escaping]
        return sum(hemispherical_power(stack, kappa, CONFIG, plan))

    return jax.vmap(one)(optics)


@pytest.mark.parametrize("order", ORDERS)
def test_energy_is_conserved_where_nothing_absorbs(order):
    optics = seeded(albedo=1.0)
    total = np.asarray(total_power(order, jnp.asarray(optics)))
    thick = optics[:, 2] > 1e3
    np.testing.assert_allclose(total[~thick], 1.0, atol=1e-10)
    np.testing.assert_allclose(total[thick], 1.0, atol=1e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_absorption_only_takes_away(order):
    total = np.asarray(total_power(order, jnp.asarray(seeded())))
    assert np.all((total > -1e-10) & (total < 1 + 1e-9))


def pairs():
    """From a to b, and from b to a, in reflection and then in transmission."""
    a, b, azimuth = pair_angles()
    there, back = np.rad2deg(np.concatenate([a, b])), np.rad2deg(np.concatenate([b, a]))
    phi = 180 - np.rad2deg(np.tile(azimuth, 2))
    side = np.repeat([False, True], len(there))
    return Directions.from_degrees(np.tile(there, 2), np.tile(back, 2), np.tile(phi, 2), side)


@eqx.filter_jit
def bsdf_of_pairs(order, optics, surroundings=None, config=CONFIG):
    """BSDF of the pairs, shape ``(optics, 2 sides, 2 ways, pairs)``."""
    directions, plan = pairs(), plan_of(order, surroundings)

    def one(x):
        return diffuse_bsdf(make_stack(order, x, surroundings), directions, config, plan)

    values = jax.vmap(one)(optics)
    return values.reshape(len(optics), 2, 2, -1)


def close(found, expected, rounding):
    """Agree relative to the largest value of each row of optics."""
    size = np.max(np.abs(expected), axis=-1, keepdims=True)
    # An absolute rounding shows where a layer is so thin or black that it scatters next to nothing.
    assert np.all(np.abs(found - expected) <= rounding * size + 1e-12)


@pytest.mark.parametrize("order", ORDERS)
def test_reciprocity(order):
    reflected = np.asarray(bsdf_of_pairs(order, jnp.asarray(seeded())))[:, 0]
    close(reflected[:, 0], reflected[:, 1], 1e-10)


@pytest.mark.parametrize(
    ("order", "turned"), [("ink", "ink"), ("plate, ink", "ink, plate"), ("ink, plate", "plate, ink")]
)
def test_reciprocity_between_media_of_different_index(order, turned):
    # f(i, o) / n_o^2 = f(o, i) / n_i^2, the stack turned about.
    optics, front, back = seeded(), jnp.asarray(1.0), jnp.asarray(1.33)
    there = np.asarray(bsdf_of_pairs(order, jnp.asarray(optics), (front, back)))[:, 1, 0]
    back_again = np.asarray(bsdf_of_pairs(turned, jnp.asarray(optics), (back, front)))[:, 1, 1]
    # As of the energy: the zero eigenvalue of a thick layer carries a rounding that grows with its thickness,
    # to between 1e-8 and 2e-8 at an optical thickness of 1e4, depending on the processor.
    close(there / 1.33**2, back_again, np.maximum(1e-10, 2e-12 * optics[:, 2:3]))


@pytest.mark.parametrize("order", ["ink", "plate, ink, second ink"])
def test_adding_doubling_agrees_with_discrete_ordinates(order):
    optics = jnp.asarray(seeded())
    (other,) = set(LAYER_METHODS) - {layer_method(CONFIG.layer_method)}
    by_method = [
        np.asarray(bsdf_of_pairs(order, optics, config=config)).reshape(len(optics), -1)
        for config in (CONFIG, SolverConfig(10, 8, 20, 6, other))
    ]
    close(*by_method, 1e-8)


def test_two_layers_of_half_the_thickness_are_one_layer():
    optics = jnp.asarray(seeded())
    one, two = (np.asarray(bsdf_of_pairs(order, optics)) for order in ("ink", "two halves"))
    close(two, one, 1e-9)
