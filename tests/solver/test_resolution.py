"""Sizes chosen for an accuracy: what they depend on, and that other layers keep it, too."""

import jax
import numpy as np
import pytest

from jaxink.optics.directions import Directions
from jaxink.optics.layers import ScatteringLayer
from jaxink.particles.phase_function import (
    HenyeyGreenstein,
    Rayleigh,
    TabulatedByMoments,
    TwoTermHenyeyGreenstein,
)
from jaxink.solver.bsdf import diffuse_bsdf
from jaxink.solver.config import SolverConfig
from jaxink.solver.resolution import choose_sizes
from jaxink.solver.stack import Stack

SIZES = ("nodes_escaping", "nodes_trapped", "n_moments", "n_orders")


def film(phase_function, thickness=1.0, index=1.5, albedo=0.99):
    layer = ScatteringLayer(index, thickness, albedo, phase_function)
    return Stack((layer,), 1.0, 1.0)


def sizes(stack, accuracy=1e-4):
    config = choose_sizes(stack, accuracy)
    return np.array([getattr(config, size) for size in SIZES])


def test_sizes_grow_with_the_asymmetry_and_with_the_accuracy():
    peaks = [sizes(film(HenyeyGreenstein(g))) for g in (0.0, 0.5, 0.8, 0.9)]
    digits = [sizes(film(HenyeyGreenstein(0.7)), accuracy) for accuracy in (1e-2, 1e-4, 1e-6)]
    for grown in (peaks, digits):
        assert np.all(np.diff(grown, axis=0) >= 0)
        assert np.all(grown[-1] > grown[0])


def test_isotropic_scattering_needs_one_order():
    assert choose_sizes(film(HenyeyGreenstein(0.0))).n_orders == 1
    assert choose_sizes(film(Rayleigh())).n_orders == 3


def test_thick_layers_blur_the_forward_peak():
    thin, thick = (choose_sizes(film(HenyeyGreenstein(0.9), t)) for t in (1.0, 30.0))
    assert thick.n_orders < thin.n_orders


# Seeded random layers, none of those that the rule was made with.
RANDOM = np.random.default_rng(20)
LAYERS = {
    "two lobes": film(TwoTermHenyeyGreenstein(0.75, -0.3, 0.2), 1.7),
    "Rayleigh": film(Rayleigh(), 0.4, 1.6),
    "moments": film(TabulatedByMoments([1.0, 0.6, 0.3, 0.1, 0.02]), 3.0, 1.0),
    "thin, matched": film(HenyeyGreenstein(0.6), 0.15, 1.0),
    "thick, matched": film(HenyeyGreenstein(0.83), 45.0, 1.0),
    **{
        f"g {g:.2f}, tau {tau:.2f}, n {n:.2f}": film(HenyeyGreenstein(g), tau, n)
        for g, tau, n in zip(
            RANDOM.uniform(-0.3, 0.85, 5),
            10 ** RANDOM.uniform(-0.5, 1.3, 5),
            RANDOM.uniform(1.3, 1.8, 5),
            strict=True,
        )
    },
}
DIRECTIONS = Directions.from_degrees(
    *(axis.ravel() for axis in np.meshgrid([0.0, 5, 45, 75], [5.0, 40, 70, 85, 89], [0.0, 90, 180], [0, 1]))
)


@pytest.mark.parametrize("name", LAYERS)
def test_the_accuracy_is_kept(name):
    stack = LAYERS[name]
    fine = diffuse_bsdf(stack, DIRECTIONS, choose_sizes(stack, 1e-7))
    for accuracy in (1e-3, 1e-4):
        found = diffuse_bsdf(stack, DIRECTIONS, choose_sizes(stack, accuracy))
        np.testing.assert_allclose(found, fine, rtol=2 * accuracy)


@pytest.mark.parametrize(("index_inside", "g"), [(1.5, 0.8), (1.53, 0.6)])
def test_an_ink_lit_from_within_a_plate_is_resolved_beyond_the_critical_angle(index_inside, g):
    layer = ScatteringLayer(1.5, 4.0, 0.99, HenyeyGreenstein(g))
    stack = Stack((layer,), index_inside, 1.0)
    from_within = Directions.from_degrees(
        *(a.ravel() for a in np.meshgrid([0.0, 45, 60], [5.0, 40, 50, 70, 85], [0.0, 180], indexing="ij")),
        np.zeros(30, bool),
    )
    fine = np.asarray(diffuse_bsdf(stack, from_within, SolverConfig(24, 36, 56, 24)))
    found = np.asarray(diffuse_bsdf(stack, from_within))
    assert np.max(np.abs(found - fine)) < 2e-4 * np.max(fine)


def test_without_a_config_the_sizes_are_chosen():
    stack = film(HenyeyGreenstein(0.8))
    np.testing.assert_array_equal(
        diffuse_bsdf(stack, DIRECTIONS), diffuse_bsdf(stack, DIRECTIONS, choose_sizes(stack))
    )


def test_sizes_cannot_be_chosen_while_differentiating(refused):
    with refused("choose_sizes"):
        jax.grad(lambda g: diffuse_bsdf(film(HenyeyGreenstein(g)), DIRECTIONS)[0])(0.5)


@pytest.mark.parametrize("accuracy", [0.0, 1e-9, 0.5, np.nan])
def test_accuracies_out_of_range_are_refused(accuracy, refused):
    with refused("1"):
        choose_sizes(film(Rayleigh()), accuracy)


def test_at_least_takes_the_larger_of_each_size():
    larger = SolverConfig(8, 20, 30, 4, "adding_doubling").at_least(SolverConfig(16, 12, 32, 12))
    assert larger == SolverConfig(16, 20, 32, 12, "adding_doubling")
