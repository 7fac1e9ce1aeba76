"""Light scattered once and twice, polarised and scalar, against a Monte Carlo of its own and the solver."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.montecarlo.polarised import N_BATCHES, PolarisedLayer, rayleigh, simulate
from jaxink.optics.directions import Directions
from jaxink.optics.layers import ClearLayer, ScatteringLayer
from jaxink.particles.mixture import SpherePopulation, mixture_coefficients, mixture_matrix
from jaxink.particles.phase_function import Rayleigh
from jaxink.particles.size_distribution import log_normal
from jaxink.solver.bsdf import diffuse_bsdf
from jaxink.solver.config import SolverConfig
from jaxink.solver.stack import Stack
from jaxink.solver.two_orders import _second_difference, polarised_excess, two_orders

THETA_O = np.tile([5.0, 40.0, 70.0], 6)
PHI = np.repeat([180.0, 90.0, 30.0, 180.0, 90.0, 0.0], 3)
IS_TRANSMISSION = np.repeat([False, True], 9)
DETECTORS = THETA_O, PHI, IS_TRANSMISSION


def directions(theta_i):
    return Directions.from_degrees(np.full(THETA_O.size, theta_i), *DETECTORS)


class Orders(NamedTuple):
    """Light scattered once and twice at each direction."""

    vector: np.ndarray
    scalar: np.ndarray


def orders_of(stack, matrix, there, k=0, *nodes):
    found = jax.jit(lambda stack, matrix: two_orders(stack, k, matrix, there, *nodes))(stack, matrix)
    return Orders(*map(np.asarray, found))


def slab(thickness, albedo, index=1.0, phase_function=None):
    return Stack((ScatteringLayer(index, thickness, albedo, phase_function or Rayleigh()),), 1.0, 1.0)


@pytest.mark.parametrize(("index", "theta_i"), [(1.0, 30.0), (1.5, 50.0)])
def test_two_orders_are_those_of_a_monte_carlo(index, theta_i):
    found = simulate(PolarisedLayer(0.7, 0.9, index, rayleigh()), theta_i, DETECTORS, 20_000, 20261125)
    mine = orders_of(slab(0.7, 0.9, index), Rayleigh().matrix(), directions(theta_i))
    both = (mine.vector, found.vector), (mine.scalar, found.scalar)
    for expected, batches in (*both, (mine.vector - mine.scalar, found.vector - found.scalar)):
        mean, error = batches[:2].mean(-1), batches[:2].std(-1, ddof=1) / N_BATCHES**0.5
        # Between equal media, unpolarised light scattered once is the same in both theories.
        deviation = (expected - mean) / np.maximum(error, 1e-12)
        # The detectors share their photons, so that one fluctuation moves all of them.
        assert np.sqrt(np.mean(deviation**2)) < 2.5
        assert np.max(np.abs(deviation)) < 4


def test_polarisation_shows_in_all_orders_of_the_monte_carlo_as_in_two():
    found = simulate(PolarisedLayer(0.2, 1.0, 1.0, rayleigh()), 30.0, DETECTORS, 20_000, 7)
    mine = orders_of(slab(0.2, 1.0), Rayleigh().matrix(), directions(30.0))
    expected = (mine.vector - mine.scalar).sum(axis=0)
    mean = (found.vector - found.scalar)[2].mean(-1)
    share = expected @ mean / (expected @ expected)
    assert 1.0 < share < 1.4
    assert np.corrcoef(expected, mean)[0, 1] > 0.98


def test_the_scalar_orders_are_those_of_the_solver():
    config = SolverConfig(32, 24, 24, 24)
    there = directions(20.0)
    missed = []
    for thickness in (0.02, 0.04):
        stack = slab(thickness, 0.95)
        whole = np.asarray(diffuse_bsdf(stack, there, config))
        missed.append(whole - orders_of(stack, Rayleigh().matrix(), there, 0, 80, 16).scalar.sum(axis=0))
    # What is missing is light scattered three times: the third power of a small thickness, but for its
    # logarithm.
    assert np.max(np.abs(missed[0]) / whole) < 5e-3
    assert np.all(missed[0] > 0)
    ratio = missed[1] / missed[0]
    assert np.all((ratio > 5.5) & (ratio < 8))


def test_a_plate_in_front_polarises_light_but_is_passed_in_both_theories():
    ink = ScatteringLayer(1.5, 0.7, 0.9, Rayleigh())
    plate = ClearLayer(1.5, 0.1)
    behind = Stack((plate, ink), 1.0, 1.0)
    there = directions(50.0)
    through, alone = (
        orders_of(stack, Rayleigh().matrix(), there, k)
        for stack, k in ((behind, 1), (slab(0.7, 0.9, 1.5), 0))
    )
    # Reflected light passes the absorbing plate twice, transmitted light once.
    cosine = np.sqrt(1 - (np.sin(np.deg2rad([50.0, *THETA_O])) / 1.5) ** 2)
    loss = np.exp(-0.1 / cosine[0] - np.where(IS_TRANSMISSION, 0.0, 0.1 / cosine[1:]))
    np.testing.assert_allclose(through.vector, alone.vector * loss, rtol=1e-12)
    np.testing.assert_allclose(through.scalar, alone.scalar * loss, rtol=1e-12)


def test_the_nodes_suffice_for_a_white_ink():
    spheres = (SpherePopulation(log_normal(150.0, 0.05, 31), 2.6 + 0j, 0.1),)
    # An index of the binder, a wavelength and the largest size parameter.
    optics = 1.5, 550.0, 8.0
    stack = slab(3.0, 1.0, 1.5, mixture_coefficients(spheres, *optics[:2], None, optics[2]).phase_function)
    matrix, there = mixture_matrix(spheres, *optics), directions(20.0)
    bsdf = np.asarray(diffuse_bsdf(stack, there))
    coarse, fine = (orders_of(stack, matrix, there, 0, *n) for n in ((), (24, 48)))
    error = ((coarse.vector - coarse.scalar) - (fine.vector - fine.scalar)).sum(axis=0)
    assert np.max(np.abs(error / bsdf)) < 1e-3
    # The error of the scalar theory is far larger.
    assert np.max(np.abs((fine.vector - fine.scalar).sum(axis=0) / bsdf)) > 3e-3


@pytest.mark.parametrize(
    "exponents", [(1.0, 2.0, 4.0), (3.0, 0.0, 3.0), (2.0, 2.0, 2.0), (1.0, 1.0 + 1e-5, 1.0)]
)
@pytest.mark.parametrize("thickness", [1e-3, 1.0, 30.0])
def test_a_second_divided_difference_is_its_integral_over_a_triangle(exponents, thickness):
    # Hermite and Genocchi: the mean of the second derivative over the triangle, times its area.
    nodes, weights = np.polynomial.legendre.leggauss(60)
    u, w = (nodes + 1) / 2, weights / 2
    first, rest = u[:, None], u[None, :] * (1 - u[:, None])
    a, b, c = exponents
    exponent = a * first + b * rest + c * (1 - first - rest)
    expected = thickness**2 * np.sum(w[:, None] * w * (1 - first) * np.exp(-exponent * thickness))
    found = _second_difference(*map(jnp.asarray, exponents), thickness)
    np.testing.assert_allclose(found, expected, rtol=1e-8)


def test_the_excess_is_differentiable_in_the_thickness():
    matrices, there = {0: Rayleigh().matrix()}, directions(30.0)

    def excess(thickness):
        return polarised_excess(slab(thickness, 0.9, 1.5), matrices, there)

    slope = jax.jit(jax.jacfwd(excess))(0.7)
    step = 1e-4
    expected = (excess(0.7 + step) - excess(0.7 - step)) / (2 * step)
    np.testing.assert_allclose(slope, expected, rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize("theta_i", [0.0, 1e-6, 30.0])
@pytest.mark.parametrize("which", ["plate", "ink", "front", "back"])
@pytest.mark.parametrize("index", [1.0, 1.3, 1.5])
def test_the_excess_is_differentiable_in_every_index_along_the_normal_and_beside_it(theta_i, which, index):
    """A fit carries the tangents of all indices, so that one without a derivative would spoil all others."""
    theta_o = np.array([0.0, 1e-6, 20.0, 35.0, 70.0])
    at = np.tile(theta_o, 4), np.repeat([0.0, 180.0], 10), np.tile(np.repeat([False, True], 5), 2)
    there = Directions.from_degrees(np.full(20, theta_i), *at)
    given = {"plate": 1.5, "ink": 1.5, "front": 1.0, "back": 1.0}

    def excess(value):
        n = given | {which: value}
        ink = ScatteringLayer(n["ink"], 0.7, 0.9, Rayleigh())
        stack = Stack((ClearLayer(n["plate"], 0.1), ink), n["front"], n["back"])
        return polarised_excess(stack, {1: Rayleigh().matrix()}, there)

    value, slope = jax.jvp(excess, (index,), (1.0,))
    step = 1e-5
    expected = (excess(index + step) - excess(index - step)) / (2 * step)
    np.testing.assert_allclose(slope, expected, rtol=1e-5, atol=1e-7 * np.max(np.abs(value)))
