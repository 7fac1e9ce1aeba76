"""Possible outcomes of a search for a minimum."""

import dataclasses
import enum

import numpy as np

from jaxink.display.brief import brief_repr


class Outcome(enum.Enum):
    """How a search ended."""

    CONVERGED = "converged: the first-order conditions hold within the bounds"
    MAX_STEPS = "did not converge: the limit on the number of evaluations was reached"
    STALLED = (
        "did not converge: no step lowers the misfit further, but the first-order conditions do not hold"
    )
    NO_SLOPE = "did not converge: the derivatives of the model are not finite at the end of the search"
    NOT_FINITE = "did not start: the model is not finite at the start values"

    @property
    def converged(self) -> bool:
        """Whether a minimum was found."""
        return self is Outcome.CONVERGED


@dataclasses.dataclass(frozen=True)
class Search:
    """One search for a minimum, from one start.

    Parameters
    ----------
    method
        ``gradient`` or ``simplex``; ``scan`` or ``profile`` for all searches of a scan or of the profiles
        combined.
    outcome
        How it ended.
    start, unit
        Free parameters scaled to [0, 1], at the start and at the end.
    loss_start, loss
        Sum of squares of the objective there.
    jacobians, evaluations
        Number of evaluations of the Jacobian, and of the objective alone. Each trial point of the
        gradient-based search is a Jacobian, accepted or not.
    run_seconds, compile_seconds
        Wall time of the search, and of compilation before it, 0 if the program was compiled already.
    decrement
        Decrease in the loss that the undamped step promises: the first-order test.
    triangle, gradient
        R of the QR factorisation of the final Jacobian J, and J^T r; None for the simplex.
    predicted
        Predicted BSDF at the end, 1/sr.
    path
        Loss after each step.
    """

    __repr__ = brief_repr

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
