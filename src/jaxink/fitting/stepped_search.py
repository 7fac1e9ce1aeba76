"""The search of `BoundedLevenbergMarquardt`, step by step from Python, where something watches or limits it.

The expensive program, the residual with its Jacobian, is that of all methods; it is compiled, stored and
called by whoever evaluates. What the search adds is one small program for each number of parameters.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from jaxink.fitting.bounded import DECREMENT, Box, Reduced, reduced
from jaxink.fitting.compiled import Point
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.search_state import (
    FIRST_DAMPING,
    NEAR_DAMPING,
    SearchState,
    Status,
    Taken,
    advanced,
    begun,
)
from jaxink.numerics.compiling import hastily
from jaxink.numerics.fingerprint import fingerprint

_OUTCOMES = {
    Status.CONVERGED: Outcome.CONVERGED,
    Status.STALLED: Outcome.STALLED,
    Status.NO_SLOPE: Outcome.NO_SLOPE,
    Status.NOT_FINITE: Outcome.NOT_FINITE,
}


def descend(
    evaluate: Callable[[np.ndarray], Point],
    start: Float[np.ndarray, " parameters"],
    lower: Float[np.ndarray, " parameters"],
    upper: Float[np.ndarray, " parameters"],
    decrement: float = DECREMENT,
    follow: Callable[[], None] | None = None,
    damping: float = FIRST_DAMPING,
) -> tuple[Point, Outcome]:
    """Search a minimum; return where it ended, and how.

    Parameters
    ----------
    evaluate
        The residual with its Jacobian at a point; it may raise to end the search.
    start
        Inside the box.
    lower, upper
        The box; equal entries hold a variable fixed.
    decrement
        As of `DECREMENT`.
    follow
        Called after each trial point.
    damping
        Of the first step.
    """
    state: SearchState | None = None
    here = last = None
    while True:
        point = evaluate(start if state is None else np.asarray(state.proposal))
        if follow is not None:
            follow()
        found, basis = _reduced(point, None if here is None else here[1])
        if state is None:
            state = begun(start, Box(lower, upper), decrement / point.freedom, damping=damping)
        state = _advanced(state, found)
        taken = int(state.taken)
        if taken != Taken.NONE:
            here = last if taken == Taken.EARLIER else (point, basis)
        last = point, basis
        assert here is not None
        if int(state.status) != Status.RUNNING:
            return here[0], _OUTCOMES[Status(int(state.status))]


def linear_minimum(
    point: Point, lower: Float[np.ndarray, " parameters"], upper: Float[np.ndarray, " parameters"]
) -> Float[np.ndarray, " parameters"]:
    """Where the linear model at a point has its minimum within the box, or short of that if it is far."""
    state = begun(point.unit, Box(lower, upper), 0.0, damping=NEAR_DAMPING)
    return np.asarray(_advanced(state, _reduced(point)[0]).proposal)


def is_prepared(n_parameters: int) -> bool:
    """Whether the program of steps with so many parameters is compiled."""
    return n_parameters in _prepared


def prepare(n_parameters: int) -> None:
    """Compile the program of steps with so many parameters."""
    here = np.zeros(n_parameters)
    linear_minimum(Point(here, here, here, np.eye(n_parameters)), here, here)
    _prepared.add(n_parameters)


_prepared: set[int] = set()


def _reduced(point: Point, basis: np.ndarray | None = None) -> tuple[Reduced, np.ndarray]:
    assert point.jacobian is not None
    found, q = reduced(point.unit, point.residual, point.jacobian, basis)
    return found, np.asarray(q)


def _advanced(state: SearchState, found: Reduced) -> SearchState:
    """The next state, computed on the processor: matrices of a few rows are no work for an accelerator."""
    with jax.enable_x64(True), jax.default_device(_processor()):
        return jax.tree.unflatten(jax.tree.structure(state), _program()(state, found))


@cache
def _processor() -> Any:
    try:
        return jax.devices("cpu")[0]
    except RuntimeError:
        return None


@cache
def _program() -> Callable:
    # What is stored is for the default device.
    key = fingerprint("step of a search") if jax.default_backend() == "cpu" else None
    return hastily(lambda state, found: tuple(jax.tree.leaves(advanced(state, found))), key=key)
