"""Gradient-based fit: bounded Levenberg-Marquardt, from one start or several."""

import copy
import dataclasses
import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from jaxtyping import Float

from jaxink.fitting.bounded import DECREMENT
from jaxink.fitting.compiled import CompiledObjective, Point
from jaxink.fitting.fit_objective import CompiledFit, FitObjective, compile_objective
from jaxink.fitting.limits import Budget, SearchLimits
from jaxink.fitting.method import WithJacobian, search
from jaxink.fitting.objective import Objective
from jaxink.fitting.outcome import Outcome, Search, SearchPath
from jaxink.fitting.search_state import FIRST_DAMPING
from jaxink.fitting.stepped_search import descend, is_prepared, prepare
from jaxink.fitting.watched import LimitReached, WatchedObjective
from jaxink.numerics.threads import in_threads

# See `DECREMENT`; for a search that only prepares another one.
_ROUGH_DECREMENT = 0.1


@dataclasses.dataclass(frozen=True)
class Descent(WithJacobian):
    """jaxink's bounded Levenberg-Marquardt; see `jaxink.fitting.BoundedLevenbergMarquardt`.

    Parameters
    ----------
    damping
        Of the first step.
    """

    name, title = "gradient", "gradient method"

    damping: float = FIRST_DAMPING

    def prepare(self, compiled: CompiledFit, start: Float[np.ndarray, " parameters"]) -> float:
        """Compile what the method calls, its own small program beside the objective's; return the seconds."""
        if is_prepared(len(start)):
            return super().prepare(compiled, start)
        began, objective = time.perf_counter(), super().prepare
        in_threads(lambda work: work(), (lambda: objective(compiled, start), lambda: prepare(len(start))))
        return time.perf_counter() - began

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        box = watched.lower, watched.upper
        _, outcome = descend(watched.linearised, start, *box, self.decrement, watched.step, self.damping)
        return outcome


class Gradient(Descent):
    """The same, and again with the parameters that have ended at a bound elsewhere in their ranges.

    A search may have been driven to a bound far from the minimum, where it stays. It is continued from the
    middle of the range and, if it comes back, from the quarter on the other side, where the others are first
    fitted alone: the way there may lead over a saddle.
    """

    @property
    def near_solution(self) -> Descent:
        """Without a second search: the bounds at which the start lies have been left and come back to."""
        return Descent(self.seed, self.decrement)

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        outcome = super().descend(watched, start)
        for again in (self._from_middle, self._from_other_side):
            end = watched.best
            assert end is not None
            low, high = _at_bounds(end.unit, watched.lower, watched.upper)
            if outcome is not Outcome.CONVERGED or not (low | high).any():
                return outcome
            try:
                again(watched, end.unit, low, high)
            except LimitReached:
                if watched.best is not end:
                    raise
                return outcome
        return outcome

    def _from_middle(
        self, watched: WatchedObjective, end: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> None:
        super().descend(watched, np.where(low | high, (watched.lower + watched.upper) / 2, end))

    def _from_other_side(
        self, watched: WatchedObjective, end: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> None:
        lower, upper = watched.lower, watched.upper
        share = np.where(low, 0.75, 0.25)
        there = np.where(low | high, lower + share * (upper - lower), end)
        box = np.where(low | high, there, lower), np.where(low | high, there, upper)
        held, _ = descend(watched.linearised, there, *box, _ROUGH_DECREMENT, watched.step)
        super().descend(watched, held.unit)


def _at_bounds(
    unit: Float[np.ndarray, " parameters"],
    lower: Float[np.ndarray, " parameters"],
    upper: Float[np.ndarray, " parameters"],
) -> tuple[np.ndarray, np.ndarray]:
    """Whether variables with a range are at its lower, and at its upper end."""
    return (upper > lower) & (unit <= lower), (upper > lower) & (unit >= upper)


class GradientSearch:
    """The gradient method on one objective; compiled once, for any number of starts.

    Parameters
    ----------
    objective
        To be minimised.
    max_jacobians
        Limit of one search.
    """

    def __init__(self, objective: FitObjective, max_jacobians: int = 200):
        self.compiled = compile_objective(objective)
        self.max_jacobians = max_jacobians

    def on(self, objective: Objective) -> "GradientSearch":
        """The same programs for another objective of the same structure, of one measurement."""
        assert isinstance(self.compiled, CompiledObjective)
        other = copy.copy(self)
        other.compiled = self.compiled.on(objective)
        return other

    def predicted(self, unit: np.ndarray) -> np.ndarray:
        """Predicted BSDF at free parameters scaled to [0, 1], shape ``(points,)``, 1/sr."""
        return self.compiled.predicted(unit)

    def linearised(self, unit: np.ndarray) -> Point:
        """Residual, prediction and Jacobian at free parameters scaled to [0, 1]."""
        return self.compiled.linearised(unit)

    def run(
        self,
        start: np.ndarray,
        held: Mapping[int, float] | None = None,
        progress: Callable[[int, float], None] | None = None,
        max_jacobians: int | None = None,
        within: Budget | None = None,
        decrement: float = DECREMENT,
        damping: float = FIRST_DAMPING,
    ) -> Search:
        """Search from one start.

        Parameters
        ----------
        start
            Free parameters scaled to [0, 1].
        held
            Parameters, by position, that are held at a value in [0, 1].
        progress
            Called after each step with its number and the loss.
        max_jacobians
            Limit of this search; None for that of the engine.
        within
            Limits of the fit that this search belongs to.
        decrement
            See `jaxink.fitting.bounded.DECREMENT`.
        damping
            Of the first step.
        """
        own = SearchLimits(steps=max_jacobians or self.max_jacobians)
        method = Descent(decrement=decrement, damping=damping)
        return search(method, self.compiled, start, within, progress, held, own)


def together(method: str, every: Sequence[Search], end: Search) -> Search:
    """Combine searches into one named `method`: the effort of all, from the first start to `end`."""
    return dataclasses.replace(
        end,
        method=method,
        start=every[0].start,
        loss_start=every[0].loss_start,
        steps=sum(s.steps for s in every),
        jacobians=sum(s.jacobians for s in every),
        evaluations=sum(s.evaluations for s in every),
        run_seconds=sum(s.run_seconds for s in every),
        compile_seconds=sum(s.compile_seconds for s in every),
        path=_joined(every),
    )


def _joined(every: Sequence[Search]) -> SearchPath:
    """The lowest loss so far along searches one after the other."""
    rows: list[tuple] = []
    evaluations, jacobians, seconds, lowest = 0, 0, 0.0, np.inf
    for one in every:
        path = one.path
        for i, loss in enumerate(path.loss):
            if loss < lowest or not rows:
                lowest = min(loss, lowest)
                effort = (evaluations + path.evaluations[i], jacobians + path.jacobians[i])
                rows.append((*effort, seconds + path.seconds[i], loss, path.unit[i]))
        evaluations += one.evaluations
        jacobians += one.jacobians
        seconds += one.run_seconds
    return SearchPath(*(np.array(column) for column in zip(*rows, strict=True)))


def starts(first: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """Start points in the unit box: the given one, then `count` - 1 from a seeded Latin hypercube."""
    if count == 1:
        return [np.asarray(first, float)]
    from scipy.stats import qmc

    more = qmc.LatinHypercube(len(first), rng=np.random.default_rng(seed)).random(count - 1)
    return [np.asarray(first, float), *more]
