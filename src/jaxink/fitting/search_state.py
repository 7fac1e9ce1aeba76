"""A bounded Levenberg-Marquardt search as a machine that proposes points and is told what is found there.

Whoever evaluates the residual and its Jacobian at the points proposed searches: a compiled loop, or Python
step by step. A step that brings less than a quarter of what it promises reveals the curvature of the residual
along it. The step is then corrected for it, at the same damping, which follows a curved valley far more
quickly than shorter steps do. A correction takes one proposal more.
"""

import dataclasses
import enum

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float, Int

from jaxink.fitting.bounded import NEARLY, Box, Curvature, Factors, Reduced, bounded_step, column_norms

# Damping of the first step: from any start, and from one that a linear model has found.
FIRST_DAMPING, NEAR_DAMPING = 1e-3, 1e-6
# Share of the promised decrease that a step must bring to be accepted; below which it is corrected, and the
# damping stays; and above which the damping falls quickly.
_ACCEPTED, _POOR, _GOOD = 1e-4, 0.25, 0.75
_QUICKLY, _SLOWLY = 0.1, 1 / 3
# The first accepted steps are at most so long, as a share of the box: far from a minimum, the linear model
# promises too much, and a search that leaps to the far side of the box may end in another minimum.
_FIRST_STEPS, _LONGEST_FIRST_STEP, _MORE_DAMPING = 3, 0.3, 4.0
_LARGEST_DAMPING = 1e6
# The largest correction relative to the step, in units of the scaled variables.
_LARGEST_CORRECTION = 0.75
# Steps in a row after which a search ends if they are refused, the damping being then 2^66 times larger, or
# if they are taken where the decrement is nearly small enough: it will not become so.
_MOST_REFUSALS = 12
_Either = Array | np.ndarray


class Status(enum.IntEnum):
    """Where a search is."""

    RUNNING = 0
    CONVERGED = 1
    STALLED = 2
    NO_SLOPE = 3
    NOT_FINITE = 4


class Proposed(enum.IntEnum):
    """What a proposed point is."""

    START = 0
    STEP = 1
    CORRECTED_STEP = 2


class Taken(enum.IntEnum):
    """Which evaluation has become the point of the search: none, the one before the last, or the last."""

    NONE = 0
    EARLIER = 1
    LAST = 2


class SearchState(eqx.Module):
    """A search before its next evaluation.

    Parameters
    ----------
    box
        The bounds.
    relative, absolute
        The search ends where the decrement is at most `relative` times the loss plus `absolute`.
    proposal
        Where to evaluate next.
    proposed
        See `Proposed`.
    here
        The point of the search: the last one accepted.
    earlier
        End of the step while the corrected step is tried.
    curvature
        What is known of the curvature.
    model, is_curved
        Model of the step, and whether it contains the curvature.
    step, promised
        The step before its correction, and the decrease in the loss that it promises.
    gain
        Share of this that the end of the step brought, while the corrected step is tried.
    damping, growth
        Of the step, and the factor of the damping after a refusal.
    accepted, refusals
        Number of accepted steps, and of those in a row that lead no further: refused, or nearly at the end.
    decrement
        At the point of the search.
    taken, status
        See `Taken`, after the last evaluation, and `Status`.
    """

    box: Box
    relative: Float[_Either, ""]
    absolute: Float[_Either, ""]
    proposal: Float[_Either, " parameters"]
    proposed: Int[_Either, ""]
    here: Reduced
    earlier: Reduced
    curvature: Curvature
    model: Factors
    is_curved: Bool[_Either, ""]
    step: Float[_Either, " parameters"]
    promised: Float[_Either, ""]
    gain: Float[_Either, ""]
    damping: Float[_Either, ""]
    growth: Float[_Either, ""]
    accepted: Int[_Either, ""]
    refusals: Int[_Either, ""]
    decrement: Float[_Either, ""]
    taken: Int[_Either, ""]
    status: Int[_Either, ""]

    def tolerance(self, loss: Float[_Either, ""]) -> Float[_Either, ""]:
        """Decrement at which the search ends."""
        return self.relative * loss + self.absolute


def begun(
    start: Float[_Either, " parameters"],
    box: Box,
    relative: Float[ArrayLike, ""],
    absolute: Float[ArrayLike, ""] = 0.0,
    damping: Float[ArrayLike, ""] = FIRST_DAMPING,
) -> SearchState:
    """A search before its first evaluation, of arrays of the kind of the start.

    Parameters
    ----------
    start
        Moved into the box.
    box
        The bounds.
    relative, absolute
        See `SearchState`.
    damping
        Of the first step.
    """
    xp, kind, n = start.__array_namespace__(), start.dtype, len(start)
    none, square = xp.zeros(n, kind), xp.zeros((n, n), kind)

    def number(value, dtype=kind):
        return xp.asarray(value, dtype)

    def count(value):
        return xp.asarray(value, np.int32)

    at = xp.clip(start, box.lower, box.upper)
    nowhere = Reduced(at, number(np.inf), square, none, none)
    return SearchState(
        box=box,
        relative=number(relative),
        absolute=number(absolute),
        proposal=at,
        proposed=count(Proposed.START),
        here=nowhere,
        earlier=nowhere,
        curvature=Curvature(square, number(False, bool)),
        model=nowhere.plain,
        is_curved=number(False, bool),
        step=none,
        promised=number(1.0),
        gain=number(0.0),
        damping=number(damping),
        growth=number(2.0),
        accepted=count(0),
        refusals=count(0),
        decrement=number(np.inf),
        taken=count(Taken.NONE),
        status=count(Status.RUNNING),
    )


def advanced(state: SearchState, found: Reduced) -> SearchState:
    """The search after an evaluation at the proposed point.

    Parameters
    ----------
    state
        Before it.
    found
        What was found there; it has been seen from the point of the search.

    References
    ----------
    Nielsen 1999 Damping parameter in Marquardt's method, IMM-REP-1999-05 (growth of the damping); Transtrum,
    Sethna 2012 arXiv:1201.5885 (the correction, here from the trial point instead of a second derivative).
    """
    gain = jnp.where(jnp.isfinite(found.loss), (state.here.loss - found.loss) / state.promised, -jnp.inf)
    is_poor = (gain < _POOR) & jnp.isfinite(found.loss)
    may_try = (state.proposed == Proposed.STEP) & is_poor & ~state.is_curved
    none = jnp.zeros_like(state.step), jnp.array(False)
    corrected, is_tried = jax.lax.cond(may_try, lambda: _corrected(state, found), lambda: none)
    trying = dataclasses.replace(
        state,
        proposal=_inside(state.box, state.here.y + corrected),
        proposed=_count(Proposed.CORRECTED_STEP),
        earlier=found,
        gain=gain,
        taken=_count(Taken.NONE),
    )
    return jax.lax.cond(is_tried, lambda: trying, lambda: _with_step(_settled(state, found, gain)))


def _corrected(state: SearchState, found: Reduced) -> tuple[Float[Array, " parameters"], Bool[Array, ""]]:
    """The step corrected for the bend of the residual along it, and whether that is short enough."""
    here, step = state.here, state.step
    bend = found.crossed - here.projected - here.triangle @ step
    bent = Factors(here.triangle, here.projected + bend)
    corrected = bounded_step(bent, here.y, state.box, state.damping)
    norms = column_norms(here.triangle)
    change = jnp.linalg.norm(norms * (corrected - step))
    return corrected, change <= _LARGEST_CORRECTION * jnp.linalg.norm(norms * step)


def _settled(state: SearchState, found: Reduced, gain) -> SearchState:
    """The search after a step with its correction, if there was one: accepted or refused."""
    is_start = state.proposed == Proposed.START
    is_earlier = (state.proposed == Proposed.CORRECTED_STEP) & (state.gain >= gain)
    end, gain = _where(is_earlier, state.earlier, found), jnp.where(is_earlier, state.gain, gain)
    moves = is_start | (gain > _ACCEPTED)
    is_accepted = moves & ~is_start
    here = _where(moves, end, state.here)
    curvature = _where(is_accepted, _curvature_after(state, end), state.curvature)
    # A refusal of a step with the curvature is the curvature's fault, not that of the damping.
    is_damped = ~moves & ~state.is_curved
    is_better = curvature.is_better & (moves | ~state.is_curved)
    factor = jnp.where(gain > _GOOD, _QUICKLY, jnp.where(gain > _POOR, _SLOWLY, 1.0))
    decrement = jnp.where(moves, here.decrement(state.box), state.decrement)
    meets = decrement <= state.tolerance(here.loss)
    leads_on = moves & (decrement > NEARLY * state.tolerance(here.loss))
    refusals = jnp.where(leads_on, 0, state.refusals + 1)
    status = jnp.where(meets, Status.CONVERGED, Status.RUNNING)
    status = jnp.where(jnp.all(jnp.isfinite(here.triangle)), status, Status.NO_SLOPE)
    status = jnp.where(refusals < _MOST_REFUSALS, status, Status.STALLED)
    status = jnp.where(jnp.isfinite(here.loss), status, Status.NOT_FINITE)
    return dataclasses.replace(
        state,
        here=here,
        curvature=Curvature(curvature.matrix, is_better),
        damping=state.damping * jnp.where(is_accepted, factor, jnp.where(is_damped, state.growth, 1.0)),
        growth=jnp.where(moves, 2.0, state.growth * jnp.where(is_damped, 2.0, 1.0)).astype(gain.dtype),
        accepted=state.accepted + is_accepted,
        refusals=_count(refusals),
        decrement=decrement,
        taken=_count(jnp.where(moves, jnp.where(is_earlier, Taken.EARLIER, Taken.LAST), Taken.NONE)),
        status=_count(status),
    )


def _curvature_after(state: SearchState, end: Reduced) -> Curvature:
    """What a step to another point tells of the curvature along it."""
    here, step = state.here, end.y - state.here.y
    change = end.gradient - here.triangle.T @ end.crossed
    foreseen = here.plain.decrease(step)
    return state.curvature.after(step, change, end.gradient - here.gradient, foreseen, here.loss - end.loss)


def _with_step(state: SearchState) -> SearchState:
    """The search with a new step from its point, short if it is one of the first."""
    here, box = state.here, state.box
    plain = here.plain, jnp.array(False)
    model, is_curved = jax.lax.cond(
        state.curvature.is_better, lambda: state.curvature.added_to(here.plain), lambda: plain
    )
    span = jnp.where(box.upper > box.lower, box.upper - box.lower, 1.0)

    def more(at):
        damping, step = at
        is_long = jnp.max(jnp.abs(step) / span) > _LONGEST_FIRST_STEP
        return (state.accepted < _FIRST_STEPS) & (damping < _LARGEST_DAMPING) & is_long

    def damped(at):
        damping = at[0] * _MORE_DAMPING
        return damping, bounded_step(model, here.y, box, damping)

    first = state.damping, bounded_step(model, here.y, box, state.damping)
    damping, step = jax.lax.while_loop(more, damped, first)
    return dataclasses.replace(
        state,
        proposal=_inside(box, here.y + step),
        proposed=_count(Proposed.STEP),
        model=model,
        is_curved=is_curved,
        step=step,
        promised=jnp.maximum(model.decrease(step), jnp.finfo(step.dtype).tiny),
        damping=damping,
    )


def _inside(box: Box, y: Float[Array, " parameters"]) -> Float[Array, " parameters"]:
    return jnp.clip(y, box.lower, box.upper)


def _count(value) -> Int[Array, ""]:
    return jnp.asarray(value, jnp.int32)


def _where(condition, one, other):
    """One of two trees."""
    return jax.tree.map(lambda x, y: jnp.where(condition, x, y), one, other)
