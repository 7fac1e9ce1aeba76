"""A grid of starts over radius and index finds the lowest minimum where many lie side by side."""

import numpy as np

from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.limits import Budget, SearchLimits
from jaxink.fitting.sweep import index_beside, sweep_grid
from jaxink.sample import Parameter
from tests.fitting.test_sweep import Residual

# Waves along the product of the first two variables, as of the phase shift of light through a sphere, in a
# wide valley around (0.75, 0.6).
_WAVE, _VALLEY = 40.0, (0.75, 0.6)


def waves(u):
    """The lowest of many minima is the one closest to the bottom of the valley."""
    phase = _WAVE * (u[0] * u[1] - _VALLEY[0] * _VALLEY[1])
    return np.array([np.sin(phase / 2), 0.5 * (u[0] - _VALLEY[0]), 0.5 * (u[1] - _VALLEY[1]), u[2] - u[0]])


def wave_slopes(u):
    half = np.cos(_WAVE * (u[0] * u[1] - _VALLEY[0] * _VALLEY[1]) / 2) * _WAVE / 2
    return np.array([[half * u[1], half * u[0], 0.0], [0.5, 0, 0], [0, 0.5, 0], [-1.0, 0, 1.0]])


def made_engine():
    engine = GradientSearch.__new__(GradientSearch)
    engine.compiled, engine.max_jacobians = Residual(waves, wave_slopes), 200
    return engine


def test_the_lowest_minimum_of_the_plane_is_the_first_start():
    engine, told = made_engine(), []
    first = np.array([0.1, 0.1, 0.9])
    found = sweep_grid(engine, first, (0, 1), progress=lambda number, loss: told.append(number))
    np.testing.assert_allclose(found.starts[0], [0.75, 0.6, 0.75], atol=0.01)
    assert told == list(range(1, 16 * 6 + 32 + 1))
    assert found.whole.jacobians == engine.compiled.runs
    # A search from the start values alone ends in another one.
    assert found.direct.outcome.converged
    assert found.direct.loss > 0.05


def test_starts_are_apart_and_lowest_first():
    engine = made_engine()
    found = sweep_grid(engine, np.array([0.1, 0.1, 0.9]), (0, 1))
    losses = [float(np.sum(waves(unit) ** 2)) for unit in found.starts]
    assert losses == sorted(losses)
    assert 4 <= len(found.starts) <= 8
    assert found.minima == ()
    for i, one in enumerate(found.starts):
        assert all(np.max(np.abs(one - other)[:2]) >= 0.04 for other in found.starts[:i])


def test_a_limit_ends_the_grid_with_what_was_found():
    engine = made_engine()
    found = sweep_grid(engine, np.array([0.1, 0.1, 0.9]), (0, 1), within=Budget(SearchLimits(evaluations=60)))
    assert engine.compiled.runs <= 60
    assert np.isfinite(found.whole.loss)


def test_the_index_of_the_same_particles_is_swept_beside_the_radius():
    def free(*names):
        return [Parameter(name, 1.0, True, 0.5, 2.0) for name in names]

    assert index_beside(free("ink.particle_index", "ink.radius_nm"), 1) == 0
    assert index_beside(free("ink.radius_nm", "ink.volume_fraction"), 0) is None
    assert index_beside(free("ink.radius_nm", "varnish.particle_index"), 0) is None
