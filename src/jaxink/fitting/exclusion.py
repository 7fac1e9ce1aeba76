"""Fits without some of the points, and their predictions of these points."""

from collections.abc import Callable, Mapping

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float

from jaxink.fitting.bounded import DECREMENT, NEAR_DAMPING, linear_minimum
from jaxink.fitting.compiled import Point
from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.objective import Objective, make_objective
from jaxink.fitting.outcome import Search
from jaxink.fitting.result import FitResult
from jaxink.numerics.precision import computing

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
    """
    objective = objective_of(result)
    with computing():
        search, found = GradientSearch(objective), []
        end = search.compiled.linearised(solution_of(objective, result))
        for number, left_out in enumerate(np.asarray(folds, bool)):
            found.append(fit_without(search, objective, end, left_out).predicted)
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


def fit_without(
    search: GradientSearch,
    objective: Objective,
    end: Point,
    left_out: Bool[np.ndarray, " points"],
    held: Mapping[int, float] | None = None,
    max_jacobians: int | None = None,
    decrement: float = DECREMENT,
) -> Search:
    """Fit without some of the points, after a fit of all of them.

    The Jacobian at the end of that fit serves for the first step of every fit without some points, which is
    then nearly always in the minimum after one or two Jacobians of its own.

    Parameters
    ----------
    search
        Runs the programs of the objective.
    objective
        Of all points.
    end
        A point where it has been linearised, a minimum as a rule.
    left_out
        True for the points to ignore.
    held, max_jacobians, decrement
        As of `GradientSearch.run`.
    """
    rest = without(objective, left_out)
    engine, n = search.on(rest), len(left_out)
    residual, jacobian = np.array(end.residual), np.array(end.jacobian)
    # Exact unless points within a scan are left out that has a common factor.
    residual[:n][left_out] = jacobian[:n][left_out] = 0.0
    box = np.zeros_like(end.unit), np.ones_like(end.unit)
    there = linear_minimum(Point(end.unit, residual, end.predicted, jacobian), *box)
    found = engine.run(there, held, None, max_jacobians, None, decrement, NEAR_DAMPING)
    here = np.concatenate([np.asarray(rest.rows(end.predicted)), end.residual[n:]])
    if not found.loss_start <= here @ here:
        # The model is not linear on so long a way.
        found = engine.run(end.unit, held, None, max_jacobians, None, decrement)
    return found


def without(objective: Objective, left_out: Bool[np.ndarray, " points"]) -> Objective:
    """The objective without some of its points; it has the same structure, so that programs are shared."""
    return eqx.tree_at(
        lambda o: (o.weight, o.sigma),
        objective,
        (np.where(left_out, 0.0, objective.weight), np.where(left_out, _EXCLUDED, 1.0) * objective.sigma),
    )
