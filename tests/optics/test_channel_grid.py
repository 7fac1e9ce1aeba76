"""Which media end the blocks of channels, and stacks in which light of some channels is trapped."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.optics.channels import ChannelGrid
from jaxink.optics.directions import Directions
from jaxink.optics.layers import ClearLayer, ScatteringLayer
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.bsdf import diffuse_bsdf
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import block_media, plan_channels
from jaxink.solver.stack import Stack
from tests.physics.probe import Light, ink


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
    ],
)
def test_block_media(indices, scattering, free, expected):
    indices = [float(n) for n in indices]
    assert block_media(indices, [s == "s" for s in scattering], [f == "f" for f in free]) == expected


def test_media_of_one_source_share_a_block():
    free, scatters = [False, True, True, False], [False, True, True, False]
    assert block_media([1.0, 1.5, 1.5, 1.0], scatters, free) == (0, 1, 2)
    assert block_media([1.0, 1.5, 1.5, 1.0], scatters, free, ["air", "ink", "ink", "air"]) == (0, 1)


@pytest.mark.parametrize("exposed", [False, True])
def test_channels_are_a_quadrature_of_etendue(exposed):
    grid = ChannelGrid(jnp.array([1.0, 1.4, 1.5]), jnp.array([False, False, True]), (6, 4, 3), exposed)
    weight, kappa = np.asarray(grid.etendue_weight), np.asarray(grid.kappa)
    sums = [np.sum(weight[(low <= kappa) & (kappa < high)]) for low, high in ((0, 1), (1, 1.4), (1.4, 1.5))]
    # Half the etendue of the hemisphere in the last medium, n^2 / 2, block by block.
    np.testing.assert_allclose(sums, [0.5, 0.48, 0.145], rtol=1e-13)


def test_interpolation_meets_smooth_functions():
    grid = ChannelGrid(jnp.array([1.0, 1.5]), jnp.array([False, True]), (8, 6))
    kappa = np.sin(np.linspace(0, np.pi / 2, 7))
    rows = np.asarray(grid.interpolation(jnp.asarray(kappa)))
    assert np.all(rows[:, 8:] == 0)
    cosine = np.sqrt(1 - np.asarray(grid.kappa)[:8] ** 2)
    np.testing.assert_allclose(rows[:, :8] @ cosine**5, np.sqrt(1 - kappa**2) ** 5, atol=1e-13)


def test_energy_with_light_that_both_faces_of_the_plate_trap():
    layers = (ClearLayer(1.5, 0.0), ClearLayer(1.0, 0.0), ink(1.5, albedo=1.0))
    np.testing.assert_allclose(Light(Stack(layers, 1.0, 1.0)).total, 1.0, atol=1e-10)


DIRECTIONS = Directions.from_degrees(
    [0.0, 0.0, 30.0, 60.0], [20.0, 70.0, 45.0, 5.0], [0.0, 180.0, 90.0, 0.0], [0, 1, 0, 1]
)


def beside_index(ink_index, plate_absorption=0.0):
    """A plate of index 1.5 and an ink of about that index."""
    layers = ClearLayer(1.5, plate_absorption), ScatteringLayer(ink_index, 2.0, 0.99, HenyeyGreenstein(0.5))
    return Stack(layers, 1.0, 1.0)


FREE_INDEX = plan_channels(beside_index(1.5), free=[2])


@eqx.filter_jit
def bsdf_beside_index(ink_index, plate_absorption, config):
    return diffuse_bsdf(beside_index(ink_index, plate_absorption), DIRECTIONS, config, FREE_INDEX)


@pytest.mark.parametrize("plate_absorption", [0.0, 0.1])
@pytest.mark.parametrize("step", [-1e-2, -1e-3, -1e-5, 0.0, 1e-7, 1e-5, 4.4e-4, 4.6e-4, 1e-3, 1e-2])
def test_indices_may_come_as_close_as_they_like(step, plate_absorption):
    found, fine = (
        bsdf_beside_index(jnp.asarray(1.5 + step), jnp.asarray(plate_absorption), config)
        for config in (SolverConfig(), SolverConfig(20, 32, 40, 12))
    )
    np.testing.assert_allclose(found, fine, rtol=5e-5)


@pytest.mark.parametrize("step", [-1e-3, -1e-4, 1e-4, 3e-4])
def test_slope_beside_an_equal_index(step):
    def of_index(index):
        return bsdf_beside_index(jnp.asarray(index), jnp.asarray(0.0), SolverConfig())

    h = 2e-5
    slope = jax.jacfwd(of_index)(1.5 + step)
    difference = (of_index(1.5 + step + h) - of_index(1.5 + step - h)) / (2 * h)
    np.testing.assert_allclose(slope, difference, rtol=1e-4, atol=1e-6)
