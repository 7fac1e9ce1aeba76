"""Fits without some of the points, and their predictions of these points."""

from collections.abc import Callable

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float

from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.objective import Objective, make_objective
from jaxink.fitting.result import FitResult
from jaxink.numerics.precision import computing

# Factor of sigma of an excluded point: it affects neither the fit nor the scan's common factor.
_EXCLUDED = 1e12


def predict_left_out(
    result: FitResult, folds: Bool[np.ndarray, "folds points"], progress: Callable[[int], None] | None = None
) -> Float[np.ndarray, "folds points"]:
    """Refit without each fold's points, starting at the solution, and predict all points, 1/sr.

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
        found = []
        for number, left_out in enumerate(np.asarray(folds, bool)):
            search = GradientSearch(without(objective, left_out)).run(solution_of(objective, result))
            found.append(search.predicted)
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


def without(objective: Objective, left_out: Bool[np.ndarray, " points"]) -> Objective:
    """The objective without some of its points; it has the same structure, so that programs are shared."""
    return eqx.tree_at(
        lambda o: (o.weight, o.sigma),
        objective,
        (np.where(left_out, 0.0, objective.weight), np.where(left_out, _EXCLUDED, 1.0) * objective.sigma),
    )
