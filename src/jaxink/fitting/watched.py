"""An objective as methods see it: every evaluation is counted, limited and remembered if it is the best."""

import time
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from jaxink.fitting.compiled import Point
from jaxink.fitting.fit_objective import CompiledFit
from jaxink.fitting.limits import Budget
from jaxink.fitting.outcome import Outcome, SearchPath

# Stands for a loss that is not finite; methods that compare losses cannot take infinity.
_HUGE = 1e300


class LimitReached(Exception):  # noqa: N818 - it ends a search, and is no error
    """Ends a method at a limit or at the goal."""

    def __init__(self, outcome: Outcome):
        super().__init__(outcome.value)
        self.outcome = outcome


class WatchedObjective:
    """Evaluates an objective for one search, and keeps its best point and its path.

    Parameters
    ----------
    compiled
        The objective.
    lower, upper
        The box of the search within the unit box; equal entries hold a parameter.
    budget
        Limits; `LimitReached` is raised when one of them is reached.
    progress
        Called after each step with its number and the best loss.
    """

    def __init__(
        self,
        compiled: CompiledFit,
        lower: Float[np.ndarray, " parameters"],
        upper: Float[np.ndarray, " parameters"],
        budget: Budget,
        progress: Callable[[int, float], None] | None = None,
    ):
        self.compiled, self.lower, self.upper = compiled, lower, upper
        self._budget, self._progress = budget, progress
        self.steps = self.evaluations = self.jacobians = 0
        self.first: Point | None = None
        self.best: Point | None = None
        self._path: list[tuple[int, int, float, float, np.ndarray]] = []
        self._began = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Run time so far."""
        return time.perf_counter() - self._began

    def residual(self, unit: Float[np.ndarray, " parameters"]) -> Point:
        """The objective at a point, clipped to the box."""
        self.evaluations += 1
        return self._seen(self.compiled.residual(np.clip(unit, self.lower, self.upper)))

    def linearised(self, unit: Float[np.ndarray, " parameters"]) -> Point:
        """The objective and its Jacobian at a point, clipped to the box."""
        self.jacobians += 1
        return self._seen(self.compiled.linearised(np.clip(unit, self.lower, self.upper)))

    def loss(self, unit: Float[np.ndarray, " parameters"]) -> float:
        """The loss at a point, finite everywhere."""
        return min(self.residual(unit).loss, _HUGE)

    def note(self, point: Point, evaluations: int = 0, jacobians: int = 0) -> None:
        """Take note of evaluations that a compiled step has made itself, and of the point where it ended."""
        self.evaluations += evaluations
        self.jacobians += jacobians
        self._seen(point)

    def complete(self, has_jacobian: bool) -> Point:
        """The best point with its prediction, and its Jacobian if there is one, whatever the limits."""
        best = self.best
        assert best is not None
        if has_jacobian and best.jacobian is None:
            self.jacobians += 1
            best = self.compiled.linearised(best.unit)
        elif not best.predicted.size:
            self.evaluations += 1
            best = self.compiled.residual(best.unit)
        self.best = best
        return best

    def step(self) -> None:
        """Take note of the end of a step."""
        self.steps += 1
        if self._progress is not None and self.best is not None:
            self._progress(self.steps, self.best.loss)
        self._check()

    def path(self) -> SearchPath:
        """The way so far."""
        evaluations, jacobians, seconds, loss, unit = zip(*self._path, strict=True)
        return SearchPath(
            np.array(evaluations), np.array(jacobians), np.array(seconds), np.array(loss), np.array(unit)
        )

    def _seen(self, point: Point) -> Point:
        if self.first is None:
            self.first = self.best = point
        elif self.best is None or not point.loss < self.best.loss:
            self._check()
            return point
        self.best = point
        self._path.append((self.evaluations, self.jacobians, self.seconds, point.loss, point.unit))
        self._check()
        return point

    def _check(self) -> None:
        best = np.inf if self.best is None else self.best.loss
        reached = self._budget.reached(self.steps, self.evaluations + self.jacobians, self.seconds, best)
        if reached is not None:
            raise LimitReached(reached)
