"""Possible outcomes of a search for a minimum, and what is kept of it."""

import dataclasses
import enum
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from jaxink.display.brief import brief_repr
from jaxink.errors import NoDerivativeError

_GO_ON = "or go on from this result by giving its folder as the sample"


class Outcome(enum.Enum):
    """How a search ended: the value is a sentence, which may change; `code` does not."""

    CONVERGED = "converged: the first-order conditions hold within the bounds"
    # For methods without derivatives.
    SETTLED = "converged by the method's own criterion; the first-order conditions are not tested"
    GOAL = "stopped at its goal, which need not be a minimum"
    MAX_STEPS = f"did not converge: the limit of steps was reached; raise max_steps (--max-steps), {_GO_ON}"
    MAX_EVALUATIONS = (
        "did not converge: the limit of evaluations was reached; raise max_evaluations (--max-evaluations), "
        f"{_GO_ON}"
    )
    MAX_SECONDS = f"did not converge: the time limit was reached; raise max_seconds (--max-seconds), {_GO_ON}"
    STALLED = (
        "did not converge: no step lowers the misfit further, but the first-order conditions do not hold"
    )
    NO_SLOPE = "did not converge: the derivatives of the model are not finite at the end of the search"
    NOT_FINITE = "did not start: the model is not finite at the start values"

    @property
    def code(self) -> str:
        """Its word in ``result.json``, such as ``converged`` or ``max_steps``."""
        return self.name.lower()

    @property
    def converged(self) -> bool:
        """Whether a minimum was found, as far as the method can tell."""
        return self in (Outcome.CONVERGED, Outcome.SETTLED)

    @property
    def is_limited(self) -> bool:
        """Whether a limit of the user's ended the search."""
        return self in (Outcome.MAX_STEPS, Outcome.MAX_EVALUATIONS, Outcome.MAX_SECONDS)

    @property
    def is_as_asked(self) -> bool:
        """Whether the search ended as it should: in a minimum, or at the goal that the user set."""
        return self.converged or self is Outcome.GOAL


@dataclasses.dataclass(frozen=True)
class SearchPath:
    """The way of a search: one entry for each evaluation that lowered the loss, the start first.

    Parameters
    ----------
    evaluations, jacobians
        Number of evaluations of the objective alone and of Jacobians up to there.
    seconds
        Run time up to there, without compilation.
    loss
        Loss there.
    unit
        Free parameters there, scaled to [0, 1].
    """

    __repr__ = brief_repr

    evaluations: Int[np.ndarray, " entries"]
    jacobians: Int[np.ndarray, " entries"]
    seconds: Float[np.ndarray, " entries"]
    loss: Float[np.ndarray, " entries"]
    unit: Float[np.ndarray, "entries parameters"]


class EndDerivatives(NamedTuple):
    """R of the QR factorisation of the final Jacobian J, and J^T r with the final residual r."""

    triangle: np.ndarray
    gradient: np.ndarray


@dataclasses.dataclass(frozen=True)
class Search:
    """One search for a minimum, from one start.

    Parameters
    ----------
    method
        Name of the method; ``scan`` or ``profile`` for all searches of a scan or of the profiles combined.
    outcome
        How it ended.
    start, unit
        Free parameters scaled to [0, 1], at the start and at the end.
    loss_start, loss
        Sum of squares of the objective there.
    steps
        Number of steps.
    jacobians, evaluations
        Number of evaluations of the Jacobian, and of the objective alone. Each trial point of the
        gradient-based search is a Jacobian, accepted or not.
    run_seconds, compile_seconds
        Wall time of the search, and of compilation before it, 0 if the program was compiled already.
    decrement
        Decrease in the loss that the undamped step promises: the first-order test.
    triangle, gradient
        R of the QR factorisation of the final Jacobian J, and J^T r; None for a method without a Jacobian.
    predicted
        Predicted BSDF at the end, 1/sr.
    path
        The way to the end.
    """

    __repr__ = brief_repr

    method: str
    outcome: Outcome
    start: np.ndarray
    unit: np.ndarray
    loss_start: float
    loss: float
    steps: int
    jacobians: int
    evaluations: int
    run_seconds: float
    compile_seconds: float
    decrement: float
    triangle: np.ndarray | None
    gradient: np.ndarray | None
    predicted: np.ndarray
    path: SearchPath

    @property
    def derivatives(self) -> EndDerivatives:
        """Derivatives at the end.

        Raises
        ------
        NoDerivativeError
            If the method has no Jacobian.
        """
        if self.triangle is None or self.gradient is None:
            raise NoDerivativeError(f"a search by the method '{self.method}' ends without derivatives.")
        return EndDerivatives(self.triangle, self.gradient)
