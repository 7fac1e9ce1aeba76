"""A sweep: fits along a parameter whose misfit has many minima, before the searches of all parameters.

Users know it as the scan of a fit; here, a scan is one of a goniometer.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from jaxink.fitting.fit_objective import FitObjective
from jaxink.fitting.gradient import GradientSearch, together
from jaxink.fitting.joint_objective import JointObjective
from jaxink.fitting.limits import Budget
from jaxink.fitting.outcome import Search
from jaxink.sample import Parameter

# Minima along the radius of a sphere are about 5 % apart, so a range of 1 : 6 needs about 40 values.
_VALUES = 48
_KEPT = 3
_DIRECT_JACOBIANS, _JACOBIANS, _ANEW_JACOBIANS = 50, 10, 20
# Where the loss at the last value is so many times the lowest one, a fit only has to keep up.
_FAR, _FAR_JACOBIANS = 10.0, 5
# A sweep only ranks the values: their losses need not be exact.
_RANKING_DECREMENT = 0.1
# After fits anew that have lowered the loss by less than this share, more and more ends at a bound
# are left without one, up to so many.
_GAIN, _MOST_SKIPPED = 0.01, 4
# Of a grid: values of the radius and of the index. A grid of 12 by 5 misses minima that one of 16 by 6 finds.
_SHAPE = (16, 6)
_HELD_JACOBIANS, _RELEASED_JACOBIANS = 4, 8
# Fraction of the fits at grid points, lowest first, that are continued with all parameters free.
_RELEASED = 1 / 3
# This many are run to convergence: the lowest minimum, and the rivals that a result lists.
_KEPT_OF_GRID = 8
# Of ends that are closer in both unit variables, the lowest one is searched.
_SAME = 0.04


class Sweep(NamedTuple):
    """What a sweep has found.

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
        By the position of a swept parameter: other minima are further away along its unit variable.
    """

    starts: list[np.ndarray]
    whole: Search
    direct: Search
    minima: tuple[Search, ...]
    distances: Mapping[int, float]


def sweep_of(
    objective: FitObjective,
    free: Sequence[Parameter],
    first: Float[np.ndarray, " parameters"],
    progress: Callable[[int, float], None] | None = None,
    within: Budget | None = None,
) -> Sweep | None:
    """The sweep that an objective needs before its searches; None if no free parameter has many minima.

    Parameters
    ----------
    objective
        To be minimised.
    free
        Its free parameters.
    first
        Start values, scaled to [0, 1].
    progress
        Called with the number of the fit and the loss there.
    within
        Limits of the fit that the sweep belongs to; it ends where they are reached.
    """
    position = next((i for i, p in enumerate(free) if p.multimodal), None)
    if position is None:
        return None
    engine = GradientSearch(objective)
    index = index_beside(free, position) if isinstance(objective, JointObjective) else None
    if index is None:
        return sweep(engine, first, position, progress, within)
    return sweep_grid(engine, first, (position, index), progress, within)


def sweep(
    engine: GradientSearch,
    first: np.ndarray,
    position: int,
    progress: Callable[[int, float], None] | None = None,
    within: Budget | None = None,
) -> Sweep:
    """Find starts at the lowest minima along a parameter whose misfit has many.

    A search of all parameters from the start values comes first: it costs little, often ends in the right
    minimum, and leaves a good one where a limit cuts the sweep short. Then all other parameters are fitted at
    each value of the swept one, starting from the solution at the previous value, up the range and down
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
        The parameter to sweep.
    progress
        Called with the number of the value and the loss there.
    within
        Limits of the fit that the sweep belongs to; it ends where they are reached.
    """
    grid = np.linspace(0.0, 1.0, _VALUES)
    direct = engine.run(first, max_jacobians=_DIRECT_JACOBIANS, within=within)
    passes, number = _Passes(engine, position, within, [direct]), 0
    found: dict[int, Search] = {}
    up = range(_VALUES)
    for values, anew in ((up, first), (reversed(up), np.full_like(first, 0.5))):
        passes.turn(anew)
        for i in values:
            if passes.is_spent:
                break
            here = passes.fit(float(grid[i]))
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
    whole = together("scan", passes.every, ends[0])
    return Sweep([end.unit for end in ends], whole, direct, lowest, {position: 1.5 * float(grid[1])})


class _Passes:
    """Fits at one value after the other, up the range and down again."""

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
        """Begin a pass, whose fits are made anew from here."""
        self._anew, self._in_vain, self._to_skip = anew, 0, 0

    def fit(self, value: float) -> Search:
        """Fit all others at a value of the swept parameter: the better one of up to two fits."""
        here = self._run(self._at, value, _FAR_JACOBIANS if self._is_far else _JACOBIANS)
        if self._is_at_bound(here) and not self.is_spent:
            # A pass that has run into a bound may stay there and miss the minima beyond it.
            if self._to_skip:
                self._to_skip -= 1
            else:
                again = self._run(self._anew, value, _ANEW_JACOBIANS)
                is_gain = again.loss < here.loss * (1 - _GAIN)
                self._in_vain = 0 if is_gain else self._in_vain + 1
                self._to_skip = min(2**self._in_vain // 2, _MOST_SKIPPED)
                here = min(here, again, key=lambda search: search.loss)
        self._at = here.unit if np.isfinite(here.loss) else self._first
        self._lowest = min(self._lowest, here.loss)
        self._is_far = _FAR * self._lowest < here.loss < np.inf
        return here

    def _run(self, start: np.ndarray, value: float, jacobians: int) -> Search:
        held = {self._position: value}
        self.every.append(self._engine.run(start, held, None, jacobians, self._within, _RANKING_DECREMENT))
        return self.every[-1]

    def _is_at_bound(self, found: Search) -> bool:
        others = np.delete(found.unit, self._position)
        return not np.all((others > 0) & (others < 1))


def index_beside(free: Sequence[Parameter], radius: int) -> int | None:
    """Position of the refractive index of the particles whose radius is free, if it is free, too.

    Parameters
    ----------
    free
        The free parameters.
    radius
        Position of the radius.
    """
    particles = free[radius].name.rpartition(".")[0]
    names = [parameter.name for parameter in free]
    index = f"{particles}.particle_index"
    return names.index(index) if index in names else None


def sweep_grid(
    engine: GradientSearch,
    first: np.ndarray,
    positions: tuple[int, int],
    progress: Callable[[int, float], None] | None = None,
    within: Budget | None = None,
) -> Sweep:
    """Find starts at the lowest minima over two parameters.

    Scattering by a sphere varies with its size and with its refractive index through their product, so that
    minima lie side by side in the plane of both; a sweep along the radius, which follows one value of the
    index continuously, passes by some of them. Here each point of a grid is a start of its own, from the
    middle of all other ranges: a few steps with both parameters held, then, from the lowest third, a few
    steps of all parameters. A search from the start values comes first.

    Parameters
    ----------
    engine
        The search.
    first
        Start values, scaled to [0, 1].
    positions
        The radius and the index.
    progress
        Called with the number of the fit and the loss there.
    within
        Limits of the fit that the sweep belongs to; it ends where they are reached.
    """
    every = [engine.run(first, max_jacobians=_DIRECT_JACOBIANS, within=within)]
    direct = every[0]

    def run(start: np.ndarray, held: dict[int, float] | None, jacobians: int) -> Search | None:
        if within is not None and within.is_spent(min(one.loss for one in every)):
            return None
        every.append(engine.run(start, held, None, jacobians, within, _RANKING_DECREMENT))
        if progress is not None:
            progress(len(every) - 1, every[-1].loss)
        return every[-1]

    sides = [np.linspace(0.0, 1.0, count).tolist() for count in _SHAPE]
    points = [dict(zip(positions, (x, y), strict=True)) for x in sides[0] for y in sides[1]]
    middle = np.full_like(first, 0.5)
    held = _by_loss([run(middle, point, _HELD_JACOBIANS) for point in points])
    best = held[: round(len(points) * _RELEASED)]
    ends = _apart(_by_loss([direct, *(run(one.unit, None, _RELEASED_JACOBIANS) for one in best)]), positions)
    whole = together("scan", every, ends[0] if ends else direct)
    # Along a valley, other ends need not be separate minima: only a full search can tell.
    return Sweep([one.unit for one in ends[:_KEPT_OF_GRID]] or [direct.unit], whole, direct, (), {})


def _by_loss(found: Sequence[Search | None]) -> list[Search]:
    finite = [one for one in found if one is not None and np.isfinite(one.loss)]
    return sorted(finite, key=lambda one: one.loss)


def _apart(ends: Sequence[Search], positions: tuple[int, int]) -> list[Search]:
    """The lowest one of each group of ends that are close to each other."""
    chosen = list[Search]()
    for end in ends:
        here = end.unit[list(positions)]
        if all(np.max(np.abs(here - other.unit[list(positions)])) >= _SAME for other in chosen):
            chosen.append(end)
    return chosen
