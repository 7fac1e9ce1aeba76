"""A scan along a parameter whose misfit has many minima, before the searches of all parameters."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from jaxink.fitting.gradient import GradientSearch, together
from jaxink.fitting.limits import Budget
from jaxink.fitting.outcome import Search

# Minima along the radius of a sphere are about 5 % apart, so a range of 1 : 6 needs about 40 values.
_VALUES = 48
_KEPT = 3
DIRECT_JACOBIANS, _JACOBIANS, _ANEW_JACOBIANS = 50, 10, 20
# Where the loss at the last value is so many times the lowest one, a fit only has to keep up.
_FAR, _FAR_JACOBIANS = 10.0, 5
# A scan only ranks the values: their losses need not be exact.
RANKING_DECREMENT = 0.1
# After fits anew that have lowered the loss by less than this share, more and more ends at a bound pass
# without one, up to so many.
_GAIN, _MOST_PASSED = 0.01, 4


class Scan(NamedTuple):
    """What a scan has found.

    Parameters
    ----------
    starts
        Where to search: the lowest minima among its values, unit variables.
    whole
        All of it as one search.
    direct
        The search of all parameters that came first.
    minima
        Fits along the way that are lower than their neighbours, lowest first.
    distances
        By the position of a scanned parameter: other minima are further away along its unit variable.
    """

    starts: list[np.ndarray]
    whole: Search
    direct: Search
    minima: tuple[Search, ...]
    distances: Mapping[int, float]


def scan(
    engine: GradientSearch,
    first: np.ndarray,
    position: int,
    progress: Callable[[int, float], None] | None = None,
    within: Budget | None = None,
) -> Scan:
    """Find starts at the lowest minima along a parameter whose misfit has many.

    A search of all parameters from the start values comes first: it costs little, often ends in the right
    minimum, and leaves a good one where a limit cuts the scan short. Then all other parameters are fitted at
    each value of the scanned one, starting from the solution at the previous value, up the range and down
    again. A fit that ends at a bound is made anew: from the start values on the way up, from the middle of
    the ranges on the way down; where that is in vain, it is tried less often. There are up to `_KEPT` starts,
    lowest first, after the end of the first search where that is lower; the search ends at the lowest.

    Parameters
    ----------
    engine
        The search.
    first
        Start values, scaled to [0, 1].
    position
        The parameter to scan.
    progress
        Called with the number of the value and the loss there.
    within
        Limits of the fit that the scan belongs to; it ends where they are reached.
    """
    grid = np.linspace(0.0, 1.0, _VALUES)
    direct = engine.run(first, max_jacobians=DIRECT_JACOBIANS, within=within)
    sweeps, number = _Sweeps(engine, position, within, [direct]), 0
    found: dict[int, Search] = {}
    up = range(_VALUES)
    for values, anew in ((up, first), (reversed(up), np.full_like(first, 0.5))):
        sweeps.turn(anew)
        for i in values:
            if sweeps.is_spent:
                break
            here = sweeps.fit(float(grid[i]))
            if i not in found or here.loss < found[i].loss:
                found[i] = here
            number += 1
            if progress is not None:
                progress(number, here.loss)
    loss = np.array([found[i].loss if i in found else np.inf for i in up])
    loss = np.where(np.isfinite(loss), loss, np.inf)
    padded = np.concatenate([[np.inf], loss, [np.inf]])
    minima = [i for i in found if loss[i] <= min(padded[i], padded[i + 2])]
    lowest = tuple(found[i] for i in sorted(minima, key=lambda i: (loss[i], i)))
    ends = list(lowest[:_KEPT])
    if not ends or direct.loss < ends[0].loss:
        ends.insert(0, direct)
    whole = together("scan", sweeps.every, ends[0])
    return Scan([end.unit for end in ends], whole, direct, lowest, {position: 1.5 * float(grid[1])})


class _Sweeps:
    """Fits at one value after the other."""

    def __init__(self, engine: GradientSearch, position: int, within: Budget | None, every: list[Search]):
        self._engine, self._position, self._within = engine, position, within
        self.every = every
        self._lowest = every[0].loss
        self._first = self._at = every[0].start
        self._is_far = False

    @property
    def is_spent(self) -> bool:
        """Whether nothing is left of the limits."""
        return self._within is not None and self._within.is_spent(min(one.loss for one in self.every))

    def turn(self, anew: np.ndarray) -> None:
        """Begin a sweep, whose fits are made anew from here."""
        self._anew, self._in_vain, self._to_pass = anew, 0, 0

    def fit(self, value: float) -> Search:
        """Fit all others at a value of the scanned parameter: the better one of up to two fits."""
        here = self._run(self._at, value, _FAR_JACOBIANS if self._is_far else _JACOBIANS)
        if self._is_at_bound(here) and not self.is_spent:
            # A sweep that has run into a bound may stay there and miss the minima beyond it.
            if self._to_pass:
                self._to_pass -= 1
            else:
                again = self._run(self._anew, value, _ANEW_JACOBIANS)
                is_gain = again.loss < here.loss * (1 - _GAIN)
                self._in_vain = 0 if is_gain else self._in_vain + 1
                self._to_pass = min(2**self._in_vain // 2, _MOST_PASSED)
                here = min(here, again, key=lambda search: search.loss)
        self._at = here.unit if np.isfinite(here.loss) else self._first
        self._lowest = min(self._lowest, here.loss)
        self._is_far = _FAR * self._lowest < here.loss < np.inf
        return here

    def _run(self, start: np.ndarray, value: float, jacobians: int) -> Search:
        held = {self._position: value}
        self.every.append(self._engine.run(start, held, None, jacobians, self._within, RANKING_DECREMENT))
        return self.every[-1]

    def _is_at_bound(self, found: Search) -> bool:
        others = np.delete(found.unit, self._position)
        return not np.all((others > 0) & (others < 1))
