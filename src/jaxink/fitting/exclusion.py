"""Fits to nearly the same data as another one, above all without some of the points."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TypeVar

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float

from jaxink.errors import NotFiniteError
from jaxink.fitting.bounded import DECREMENT
from jaxink.fitting.compiled import Point
from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.objective import Objective, make_objective
from jaxink.fitting.outcome import Outcome, Search
from jaxink.fitting.result import FitResult
from jaxink.fitting.search_state import NEAR_DAMPING
from jaxink.fitting.stepped_search import linear_minimum
from jaxink.numerics.precision import computing

AnyObjective = TypeVar("AnyObjective", bound=Objective)
# Factor of sigma of an excluded point: it affects neither the fit nor the scan's common factor.
_EXCLUDED = 1e12


def predict_left_out(
    result: FitResult, folds: Bool[np.ndarray, "folds points"], progress: Callable[[int], None] | None = None
) -> Float[np.ndarray, "folds points"]:
    """Refit without each fold's points, and predict all points, 1/sr.

    One compiled program serves all folds.

    Parameters
    ----------
    result
        The fit of all points.
    folds
        True for the used points that a fold leaves out.
    progress
        Called with the number of folds completed.

    Raises
    ------
    NotFiniteError
        See `fit_near`.
    """
    objective = objective_of(result)
    with computing():
        search, found = GradientSearch(objective), []
        end = search.linearised(solution_of(objective, result))
        for number, left_out in enumerate(np.asarray(folds, bool)):
            rest = without(objective, left_out)
            found.append(fit_near(search.on(rest), rest, end).predicted)
            if progress is not None:
                progress(number + 1)
    return np.array(found)


def objective_of(result: FitResult) -> Objective:
    """The objective that a fit minimised, at its final resolution."""
    with computing():
        return make_objective(result.data, result.sample, result.objective, result.config)


def solution_of(objective: Objective, result: FitResult) -> Float[np.ndarray, " parameters"]:
    """Solution of a fit in the variables of its objective."""
    return objective.scale.to_unit(np.array([result.values[name] for name in objective.free]))


def fit_near(
    search: GradientSearch,
    objective: Objective,
    end: Point,
    held: Mapping[int, float] | None = None,
    max_jacobians: int | None = None,
    decrement: float = DECREMENT,
) -> Search:
    """Fit to some of the points, or to other measured values, after a fit to all of them.

    The Jacobian at the end of that fit serves for the first step, which is nearly always so close to the
    minimum that one or two further Jacobians do.

    Parameters
    ----------
    search
        Of the objective.
    objective
        Without some of the points, or with other measured values.
    end
        Where the objective of all of them has been linearised, a minimum as a rule.
    held, max_jacobians, decrement
        See `GradientSearch.run`.

    Raises
    ------
    NotFiniteError
        The model or its derivatives are not finite where the search would have to begin or ends.
    """
    jacobian = np.array(end.jacobian)
    if not np.all(np.isfinite(jacobian)):
        raise NotFiniteError("the derivatives of the model are not finite at the fit to all points")
    n = len(objective.measured)
    residual = np.concatenate([np.asarray(objective.rows(end.predicted)), end.residual[n:]])
    # Not exact if some of the points of a scan with a common factor are left out; what follows corrects it.
    jacobian[:n][objective.weight == 0] = 0.0
    box = np.zeros_like(end.unit), np.ones_like(end.unit)
    near = linear_minimum(Point(end.unit, residual, end.predicted, jacobian), *box)
    run = partial(search.run, held=held, max_jacobians=max_jacobians, decrement=decrement)
    found = run(near, damping=NEAR_DAMPING)
    if not found.loss_start <= residual @ residual:
        # The model is not linear on so long a way.
        found = run(end.unit)
    require_slope(found)
    return found


def require_slope(found: Search) -> None:
    """Raise `NotFiniteError` if a search ended where the model or its derivatives are not finite."""
    if found.outcome in (Outcome.NOT_FINITE, Outcome.NO_SLOPE):
        what = "the model is" if found.outcome is Outcome.NOT_FINITE else "the derivatives of the model are"
        raise NotFiniteError(f"{what} not finite at the end of its search")


def without(objective: AnyObjective, left_out: Bool[np.ndarray, " points"]) -> AnyObjective:
    """The objective without some of its points; it has the same structure, so that programs are shared."""
    return eqx.tree_at(
        lambda o: (o.weight, o.sigma),
        objective,
        (np.where(left_out, 0.0, objective.weight), np.where(left_out, _EXCLUDED, 1.0) * objective.sigma),
    )
