"""Methods of minimisation as types, and one search by any of them."""

import abc
import dataclasses
from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from jaxink.fitting.bounded import DECREMENT, NEARLY, Box, Reduced, reduced
from jaxink.fitting.fit_objective import CompiledFit
from jaxink.fitting.limits import Budget, SearchLimits
from jaxink.fitting.outcome import Outcome, Search
from jaxink.fitting.watched import LimitReached, WatchedObjective

# A loss that has fallen to this share of the first one, residuals to 1e-10 of theirs, is 0.
_EXACT = 1e-20


@dataclasses.dataclass(frozen=True)
class Method(abc.ABC):
    """A method that minimises an objective in a box.

    Parameters
    ----------
    seed
        Of random numbers, for a method that draws them.
    decrement
        See `jaxink.fitting.bounded.DECREMENT`, for the test of the first-order conditions.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    # Limits of a search where the user sets none.
    usual_limits: ClassVar[SearchLimits]
    # Whether it computes Jacobians, so that its result has standard errors.
    has_jacobian: ClassVar[bool]

    seed: int = 0
    decrement: float = DECREMENT

    @abc.abstractmethod
    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start by evaluating an objective, which keeps the best point; return how it ended."""

    @property
    def near_solution(self) -> "Method":
        """The method for a start that another search, at a lower resolution, has found."""
        return self

    def prepare(self, compiled: CompiledFit, start: Float[np.ndarray, " parameters"]) -> float:
        """Compile what the method calls; return the seconds it took."""
        return compiled.prepare(start, self.has_jacobian)


class WithJacobian(Method):
    """A method that uses derivatives; its result is tested by the first-order conditions."""

    has_jacobian = True
    usual_limits = SearchLimits(steps=200)


class WithoutDerivatives(Method):
    """A method that only compares values; it ends by its own criterion."""

    has_jacobian = False
    usual_limits = SearchLimits(evaluations=2000)


def search(
    method: Method,
    compiled: CompiledFit,
    start: Float[np.ndarray, " parameters"],
    budget: Budget | None = None,
    progress: Callable[[int, float], None] | None = None,
    held: Mapping[int, float] | None = None,
    own: SearchLimits | None = None,
) -> Search:
    """One search from one start.

    Parameters
    ----------
    method
        How to search.
    compiled
        What to minimise.
    start
        Free parameters scaled to [0, 1].
    budget
        Limits of the fit that this search belongs to; None for none.
    progress
        Called after each step with its number and the best loss.
    held
        Parameters, by position, that are held at a value in [0, 1].
    own
        Limits of this search alone; None for the usual ones of the method unless the fit has limits.
    """
    budget = Budget(SearchLimits()) if budget is None else budget
    if own is None:
        own = method.usual_limits if budget.limits.is_open else SearchLimits()
    lower, upper = np.zeros_like(start, float), np.ones_like(start, float)
    at = np.clip(np.asarray(start, float), lower, upper)
    for position, value in (held or {}).items():
        lower[position] = upper[position] = at[position] = value
    compile_seconds = method.prepare(compiled, at)
    watched = WatchedObjective(compiled, lower, upper, budget.narrowed(own), progress)
    try:
        outcome = method.descend(watched, at)
    except LimitReached as reached:
        outcome = reached.outcome
    outcome, end, decrement = _ended(method, watched, outcome)
    seconds = watched.seconds
    budget.spend(watched.evaluations + watched.jacobians, seconds)
    compiled.count(watched.evaluations, watched.jacobians)
    first, best = watched.first, watched.best
    assert first is not None
    assert best is not None
    return Search(
        method=method.name,
        outcome=outcome,
        start=np.asarray(start),
        unit=best.unit,
        loss_start=first.loss,
        loss=best.loss,
        steps=watched.steps,
        jacobians=watched.jacobians,
        evaluations=watched.evaluations,
        run_seconds=seconds,
        compile_seconds=compile_seconds,
        decrement=decrement,
        triangle=None if end is None else np.asarray(end.triangle),
        gradient=None if end is None else np.asarray(end.gradient),
        predicted=best.predicted,
        path=watched.path(),
    )


def _ended(
    method: Method, watched: WatchedObjective, outcome: Outcome
) -> tuple[Outcome, Reduced | None, float]:
    """How a search ended, and the derivatives at its best point with the decrement if the method has them."""
    best = watched.complete(method.has_jacobian)
    if best.jacobian is None:
        if not np.isfinite(best.loss):
            outcome = Outcome.NOT_FINITE
        elif outcome is Outcome.CONVERGED:
            outcome = Outcome.SETTLED
        return outcome, None, float("nan")
    end, _ = reduced(best.unit, best.residual, best.jacobian)
    decrement = float(end.decrement(Box(watched.lower, watched.upper)))
    if not np.isfinite(best.loss):
        outcome = Outcome.NOT_FINITE
    elif not np.all(np.isfinite(end.triangle)):
        outcome = Outcome.NO_SLOPE
    elif outcome in (Outcome.CONVERGED, Outcome.STALLED):
        # As many points as parameters can be met exactly; rounding is then all that is left.
        is_exact = watched.first is not None and best.loss <= _EXACT * watched.first.loss
        allowed = method.decrement * (NEARLY if outcome is Outcome.STALLED else 1.0)
        is_minimum = is_exact or decrement <= allowed * best.loss / best.freedom
        outcome = Outcome.CONVERGED if is_minimum else Outcome.STALLED
    return outcome, end, decrement
