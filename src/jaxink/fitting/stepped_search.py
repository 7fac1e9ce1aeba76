"""The search of `BoundedLevenbergMarquardt`, step by step from Python, where something watches or limits it.

The expensive program, the residual with its Jacobian, is that of all methods; it is compiled, stored and
called by whoever evaluates. What the search adds is one small program for each number of parameters.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

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
from jaxink.numerics.compiling import jit_unoptimised
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
        See `DECREMENT`.
    follow
        Called after each trial point.
    damping
        Of the first step.
    """
    proposal, packed = start, None
    here = last = None
    while True:
        point = evaluate(proposal)
        if follow is not None:
            follow()
        found, basis = _reduced(point, None if here is None else here[1])
        if packed is None:
            box = Box(lower, upper)
            packed = _packed(begun(point.unit, box, decrement / point.freedom, damping=damping))
        packed, said = _advanced(packed, found)
        status, taken, proposal = int(said[0]), int(said[1]), said[2:]
        if taken != Taken.NONE:
            here = last if taken == Taken.EARLIER else (point, basis)
        last = point, basis
        assert here is not None
        if status != Status.RUNNING:
            return here[0], _OUTCOMES[Status(status)]


def linear_minimum(
    point: Point, lower: Float[np.ndarray, " parameters"], upper: Float[np.ndarray, " parameters"]
) -> Float[np.ndarray, " parameters"]:
    """Where the linear model at a point has its minimum within the box, or short of that if it is far."""
    packed = _packed(begun(point.unit, Box(lower, upper), 0.0, damping=NEAR_DAMPING))
    return _advanced(packed, _reduced(point)[0])[1][2:]


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


def _advanced(packed: Any, found: Reduced) -> tuple[Any, np.ndarray]:
    """The next state in a row, and its status, what it has taken and its proposal in another one.

    It is computed on the processor: matrices of a few rows are no work for an accelerator.
    """
    numbers = found.y, found.loss, found.triangle, found.projected, found.crossed
    with jax.enable_x64(True), jax.default_device(_processor()):
        packed, said = _program()(packed, *numbers)
        return packed, np.asarray(said)


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

    def advance(packed, *numbers):
        n = len(numbers[0])
        state = _unpacked(packed, begun(np.zeros(n), Box(np.zeros(n), np.ones(n)), 0.0))
        state = advanced(state, Reduced(*numbers))
        return _packed(state), jnp.concatenate([jnp.stack([state.status, state.taken]), state.proposal])

    return jit_unoptimised(advance, key=key)


def _packed(state: SearchState) -> Any:
    """All numbers of a state in a row: one array is passed in a fraction of the time of thirty."""
    leaves = jax.tree.leaves(state)
    xp = leaves[0].__array_namespace__()
    return xp.concatenate([xp.ravel(leaf).astype(float) for leaf in leaves])


def _unpacked(row: Float[Array, " numbers"], like: SearchState) -> SearchState:
    """The state of a row, with the shapes and kinds of another one."""
    leaves, tree = jax.tree.flatten(like)
    ends = np.cumsum([leaf.size for leaf in leaves])
    found = [
        row[end - leaf.size : end].reshape(leaf.shape).astype(leaf.dtype)
        for leaf, end in zip(leaves, ends, strict=True)
    ]
    return jax.tree.unflatten(tree, found)
