"""A sweep finds all minima along a parameter, and spends little where there is nothing to find."""

import numpy as np
import pytest

from jaxink.fitting.compiled import CompiledObjective, Point
from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.sweep import sweep


class Residual(CompiledObjective):
    """Stands for a compiled objective."""

    def __init__(self, residual, jacobian):
        self.of, self.slopes, self.runs = residual, jacobian, 0

    def prepare(self, start, jacobian):
        return 0.0

    def count(self, evaluations, jacobians):
        self.runs += jacobians

    def linearised(self, unit):
        return Point(np.array(unit), self.of(unit), np.zeros(3), self.slopes(unit))


def wavy(u):
    """Minima along the first variable at 0.2, 0.5 and 0.8; the lowest is at 0.8."""
    return np.array([np.sin(np.pi * (u[0] - 0.2) / 0.3), 0.3 * (0.8 - u[0]), u[1] - u[0] ** 2, 0.05])


def wavy_slopes(u):
    slope = np.pi / 0.3 * np.cos(np.pi * (u[0] - 0.2) / 0.3)
    return np.array([[slope, 0.0], [-0.3, 0.0], [-2 * u[0], 1.0], [0.0, 0.0]])


def test_a_sweep_keeps_all_minima_and_starts_at_the_lowest():
    engine = GradientSearch.__new__(GradientSearch)
    engine.compiled, engine.max_jacobians = Residual(wavy, wavy_slopes), 200
    told = []
    found = sweep(engine, np.array([0.1, 0.9]), 0, progress=lambda number, loss: told.append(number))
    assert told == list(range(1, 97))
    assert [one.unit[0] for one in found.minima[:3]] == pytest.approx([0.8, 0.5, 0.2], abs=0.02)
    assert found.starts[0] == pytest.approx([0.8, 0.64], abs=0.05)
    assert found.whole.jacobians == engine.compiled.runs
    assert found.direct.unit[0] == pytest.approx(0.2, abs=0.05)


def test_fits_that_end_at_a_bound_are_made_anew_less_and_less_often():
    # The second variable belongs at its lower bound everywhere: fits anew are in vain.
    bound = Residual(lambda u: np.array([u[0] - 0.5, u[1] + 0.5]), lambda u: np.eye(2))
    engine = GradientSearch.__new__(GradientSearch)
    engine.compiled, engine.max_jacobians = bound, 200
    starts = []
    run = engine.run

    def noted(start, *arguments, **options):
        starts.append(start)
        return run(start, *arguments, **options)

    engine.run = noted
    sweep(engine, np.array([0.1, 0.9]), 0)
    anew = sum(start[1] in (0.9, 0.5) for start in starts[2:])
    # At the first values of each pass, then at every fifth.
    assert 96 / 5 < anew < 96 / 5 + 8
