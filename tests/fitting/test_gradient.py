"""The gradient method leaves a bound that is far from the minimum."""

import numpy as np
import pytest

from jaxink.fitting.compiled import CompiledObjective, Point
from jaxink.fitting.gradient import Descent, Gradient
from jaxink.fitting.limits import Budget, SearchLimits
from jaxink.fitting.method import search
from jaxink.fitting.outcome import Outcome


class Curve(CompiledObjective):
    """Stands for a compiled objective: a residual f(u), a second variable of 0.4, and a constant."""

    def __init__(self, f, slope):
        self.f, self.slope = f, slope

    def prepare(self, start, jacobian):
        return 0.0

    def count(self, evaluations, jacobians):
        pass

    def linearised(self, unit):
        residual = np.array([self.f(unit[0]), unit[1] - 0.4, 0.1])
        jacobian = np.array([[self.slope(unit[0]), 0.0], [0.0, 1.0], [0.0, 0.0]])
        return Point(np.array(unit), residual, np.zeros(3), jacobian)


# From 2 at the lower bound over a hill of 2.6 at 0.2 down to 0 at 0.8.
TWO_MINIMA = Curve(
    lambda u: 2.6 - (u - 0.2) ** 2 * (15 if u < 0.2 else 2.6 / 0.36),
    lambda u: -2 * (u - 0.2) * (15 if u < 0.2 else 2.6 / 0.36),
)
# The same with the hill at 0.6, beyond the middle, and 0 at 0.9.
FAR_MINIMUM = Curve(
    lambda u: 2.6 - (u - 0.6) ** 2 * (0.6 / 0.36 if u < 0.6 else 2.6 / 0.09),
    lambda u: -2 * (u - 0.6) * (0.6 / 0.36 if u < 0.6 else 2.6 / 0.09),
)
START = np.array([0.1, 0.9])


def test_a_search_that_ends_at_a_bound_is_continued_from_the_middle():
    stays, leaves = (search(method(), TWO_MINIMA, START) for method in (Descent, Gradient))
    assert stays.unit == pytest.approx([0.0, 0.4], abs=1e-3)
    assert leaves.unit == pytest.approx([0.8, 0.4], abs=1e-3)
    assert leaves.outcome is stays.outcome is Outcome.CONVERGED
    assert leaves.jacobians > stays.jacobians


def test_a_search_that_comes_back_to_a_bound_is_continued_from_the_other_side():
    stays, leaves = (search(method(), FAR_MINIMUM, START) for method in (Descent, Gradient))
    assert stays.unit == pytest.approx([0.0, 0.4], abs=1e-3)
    assert leaves.unit == pytest.approx([0.9, 0.4], abs=1e-3)


def test_a_minimum_at_a_bound_is_kept_whatever_the_limits():
    at_bound = Curve(lambda u: 1 + u, lambda u: 1.0)
    alone = search(Descent(), at_bound, START)
    for limit in (None, alone.jacobians + 1):
        found = search(Gradient(), at_bound, START, Budget(SearchLimits(evaluations=limit)))
        assert found.unit == pytest.approx([0.0, 0.4], abs=1e-3)
        assert found.outcome is Outcome.CONVERGED
        assert found.triangle is not None
    held = search(Gradient(), at_bound, START, held={0: 0.5})
    assert held.unit == pytest.approx([0.5, 0.4], abs=1e-3)
