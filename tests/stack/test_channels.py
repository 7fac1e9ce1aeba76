"""Which media end the blocks of channels, and stacks in which light of some channels is trapped."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.bsdf import diffuse_bsdf
from jaxink.channels import ChannelGrid
from jaxink.geometry import Directions
from jaxink.optics import ClearLayer, ScatteringLayer
from jaxink.stack import Stack, block_media
from physics.probe import SMALL, Light, ink


@pytest.mark.parametrize(
    ("indices", "scattering", "free", "expected"),
    [
        ([1, 1.5, 1], "-s-", "---", (0, 1)),
        ([1, 1.0, 1], "-s-", "---", (1,)),
        # A plate above the ink's index holds no scattered light; one of its index adds no block.
        ([1, 1.6, 1.5, 1], "--s-", "----", (0, 2)),
        ([1, 1.5, 1.5, 1], "--s-", "----", (0, 2)),
        ([1, 1.4, 1.5, 1], "--s-", "----", (0, 1, 2)),
        # A free index may go anywhere, so that its medium always has a block.
        ([1, 1.5, 1.5, 1], "--s-", "--f-", (0, 2, 1)),
        ([1, 1.6, 1.5, 1], "--s-", "-f--", (0, 2, 1)),
        ([1, 1.5, 1.33], "-s-", "---", (0, 2, 1)),
    ],
)
def test_block_media(indices, scattering, free, expected):
    indices = [float(n) for n in indices]
    assert block_media(indices, [s == "s" for s in scattering], [f == "f" for f in free]) == expected


@pytest.mark.parametrize("exposed", [False, True])
def test_channels_are_a_quadrature_of_etendue(exposed):
    # Half the etendue of the hemisphere in the last medium, n^2 / 2, block by block.
    grid = ChannelGrid(jnp.array([1.0, 1.4, 1.5]), (6, 4, 3), exposed)
    weight, kappa = np.asarray(grid.etendue_weight), np.asarray(grid.kappa)
    sums = [np.sum(weight[low <= kappa][kappa[low <= kappa] < high]) for low, high in ((0, 1), (1, 1.4), (1.4, 1.5))]
    np.testing.assert_allclose(sums, [0.5, 0.48, 0.145], rtol=1e-13)


def test_interpolation_meets_smooth_functions_and_nodes():
    grid = ChannelGrid(jnp.array([1.0, 1.5]), (8, 6))
    kappa = np.sin(np.linspace(0, np.pi / 2, 7))
    rows = np.asarray(grid.interpolation(jnp.asarray(kappa)))
    assert np.all(rows[:, 8:] == 0)
    cosine = np.sqrt(1 - np.asarray(grid.kappa)[:8] ** 2)
    np.testing.assert_allclose(rows[:, :8] @ cosine**5, np.sqrt(1 - kappa**2) ** 5, atol=1e-13)
    at_nodes = np.asarray(grid.interpolation(grid.kappa))
    np.testing.assert_allclose(at_nodes, np.eye(14), atol=1e-9)


def stack_of(*layers):
    media = [1.0, *(layer.refractive_index for layer in layers), 1.0]
    inks = [False, *(isinstance(layer, ScatteringLayer) for layer in layers), False]
    return Stack(layers, 1.0, 1.0, block_media([float(n) for n in media], inks, [False] * len(media)))


AIR_GAP = (ClearLayer(1.5, 0.0), ClearLayer(1.0, 0.0))


@pytest.mark.parametrize(
    "layers",
    [
        # Light that is totally reflected at both faces of the plate: nothing excites it.
        (*AIR_GAP, ink(1.5, albedo=1.0)),
        (ClearLayer(1.5, 0.0), ink(1.45, albedo=1.0), ink(1.52, albedo=1.0)),
    ],
    ids=["air gap", "low index between"],
)
def test_energy_with_channels_that_are_trapped_without_loss(layers):
    np.testing.assert_allclose(Light(stack_of(*layers)).total, 1.0, atol=1e-10)


DIRECTIONS = Directions.from_degrees([0, 30, 30, 60], [10, 20, 20, 80], [180, 0, 0, 0], [False, False, True, False])


@eqx.filter_jit
def value_and_slope(make_stack, index, config):
    """BSDF and its derivative by the index."""

    def bsdf(n):
        value = diffuse_bsdf(make_stack(n), DIRECTIONS, config)
        return value, value

    slope, value = jax.jacfwd(bsdf, has_aux=True)(index)
    return value, slope


def free_ink_on_plate(index):
    return Stack((ClearLayer(1.5, 0.0), ink(index)), 1.0, 1.0, (0, 1, 2))


def free_plate_under_ink(index):
    return Stack((ClearLayer(index, 0.0), ink(1.5)), 1.0, 1.0, (0, 2, 1))


@pytest.mark.parametrize("make_stack", [free_ink_on_plate, free_plate_under_ink])
def test_index_that_passes_the_one_of_the_neighbour(make_stack):
    # Value and slope go smoothly through equal indices, where a fit of the ink's index often starts.
    steps = np.array([-0.012, -0.006, -0.003, -0.001, -1e-4, 0.0, 1e-4, 0.001, 0.003, 0.006, 0.012])
    found = [value_and_slope(make_stack, jnp.asarray(1.5 + step), SMALL) for step in steps]
    values, slopes = (np.array(column) for column in zip(*found, strict=True))
    smooth = np.polynomial.Polynomial.fit
    for point in range(values.shape[1]):
        line = smooth(steps, values[:, point], 3)
        np.testing.assert_allclose(line(steps), values[:, point], rtol=5e-5)
        np.testing.assert_allclose(line.deriv()(steps), slopes[:, point], rtol=0.02)


def test_free_index_gives_the_same_as_a_fixed_one():
    free, fixed = Light(free_ink_on_plate(1.5)), Light(stack_of(ClearLayer(1.5, 0.0), ink(1.5)))
    np.testing.assert_allclose(free.reflected_pairs, fixed.reflected_pairs, rtol=1e-6)
    np.testing.assert_allclose(free.transmitted_pairs, fixed.transmitted_pairs, rtol=1e-6)
