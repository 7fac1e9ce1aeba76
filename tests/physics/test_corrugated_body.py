"""Relief of an opaque body against photons at a random surface, within 4 standard errors; seeded."""

import numpy as np

from benchmarks.montecarlo import HenyeyGreenstein, Result
from benchmarks.montecarlo.relief import Body, reflected
from benchmarks.validation.photons.relief import sample_text, solved

LIMIT = 4.0
RING_EDGES = (0.0, 40.0, 60.0, 75.0), (0.0, 60.0, 120.0, 180.0)
ALBEDO, ASYMMETRY, THETA_DEG = 0.8, 0.5, 60.0


def photons(slope_variance, index=1.0, correlation_length=100.0):
    """Mean and standard error of the BSDF in each bin."""
    body = Body(HenyeyGreenstein(ASYMMETRY), ALBEDO, slope_variance, correlation_length, index)
    rings, _ = reflected(body, THETA_DEG, 50_000, RING_EDGES, seed=3)
    return Result.mean_and_error(rings)


def predicted(**faces):
    return solved(sample_text(ALBEDO, **faces), THETA_DEG, RING_EDGES)


def test_an_even_surface_is_that_of_the_plane_body():
    value, error = photons(1e-9)
    assert np.all(np.abs(value - predicted()) < LIMIT * error)


def test_a_large_relief_is_one_of_facets():
    value, error = photons(0.1)
    assert np.all(np.abs(value - predicted(slope_variance=0.1)) < LIMIT * error)
    assert np.max(np.abs(value - predicted()) / error) > 2 * LIMIT


def test_a_relief_far_below_the_transport_length_is_a_rough_face():
    value, error = photons(0.05, index=1.4, correlation_length=0.3)
    rough = predicted(index=1.4, rough_variance=0.05)
    assert np.all(np.abs(value - rough) < LIMIT * error)
    assert np.max(np.abs(value - predicted(index=1.4)) / error) > 2 * LIMIT
