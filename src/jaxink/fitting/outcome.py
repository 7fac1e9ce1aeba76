"""How a search for a minimum can end, each with its sentence."""

import dataclasses
import enum

import numpy as np


class Outcome(enum.Enum):
    """How a search ended."""

    CONVERGED = "converged: the first-order conditions hold within the bounds"
    MAX_STEPS = "did not converge: the allowed number of evaluations was used up"
    STALLED = (
        "did not converge: no step lowers the misfit any more, but the first-order conditions do not hold"
    )
    NO_SLOPE = "did not converge: the model has no finite derivatives where the search ended"
    NOT_FINITE = "did not start: the model is not finite at the start values"

    @property
    def converged(self) -> bool:
        """Whether the minimum was found."""
        return self is Outcome.CONVERGED


@dataclasses.dataclass(frozen=True)
class Search:
    """One search for a minimum, from one start.

    Parameters
    ----------
    method
        ``gradient`` or ``simplex``; ``scan`` or ``profile`` for all searches of such a purpose together.
    outcome
        How it ended.
    start, unit
        Free parameters scaled to 0 ... 1, at the start and at the end.
    loss_start, loss
        Sum of squares of the objective there.
    jacobians, evaluations
        How often the Jacobian, and the objective alone, was computed. Each trial point of the gradient
        search is a Jacobian, accepted or not.
    run_seconds, compile_seconds
        Wall time of the search and of what was compiled for it before, 0 where that was there.
    decrement
        How much lower the undamped step promises to bring the loss; the first-order test.
    triangle, gradient
        R of the QR factorisation of the final Jacobian J, and J^T r; None for the simplex.
    predicted
        Predicted BSDF at the end.
    path
        Loss after each step.
    """

    method: str
    outcome: Outcome
    start: np.ndarray
    unit: np.ndarray
    loss_start: float
    loss: float
    jacobians: int
    evaluations: int
    run_seconds: float
    compile_seconds: float
    decrement: float
    triangle: np.ndarray | None
    gradient: np.ndarray | None
    predicted: np.ndarray
    path: tuple[float, ...]
