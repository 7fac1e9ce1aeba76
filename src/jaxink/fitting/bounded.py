"""Levenberg-Marquardt within a box, by an active set, clipped steps and a second-order correction.

A variable at its bound with the gradient pointing outward is excluded from the step, and the step of the
others is clipped at their bounds. The damping is judged by the clipped step, so a bound does not affect it.
"""

import dataclasses
from collections.abc import Callable
from functools import cached_property

import numpy as np
from jaxtyping import ArrayLike, Bool, Float

from jaxink.fitting.compiled import Point
from jaxink.fitting.curvature import Curvature, Factors
from jaxink.fitting.outcome import Outcome

# Singular values below this share of the largest are rounding: no step is made along their directions.
_RANK_TOLERANCE = 1e-11
# Decrement at which a search ends, relative to the sum of squares per degree of freedom. The distance to the
# minimum is then the root of it, 0.001 standard errors, in any units.
DECREMENT = 1e-6
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
# Refused steps in a row after which a search ends: the damping is then 2^66 times larger.
_MOST_REFUSALS = 12


def bounded_step(
    triangle: Float[ArrayLike, "parameters parameters"],
    projected: Float[ArrayLike, " parameters"],
    y: Float[ArrayLike, " parameters"],
    lower: Float[ArrayLike, " parameters"],
    upper: Float[ArrayLike, " parameters"],
    damping: float,
) -> Float[np.ndarray, " parameters"]:
    """Step d that minimises |R d + Q^T r|^2 + damping |D d|^2 within the box, D^2 = diag(R^T R).

    Parameters
    ----------
    triangle, projected
        R and Q^T r of the thin QR factorisation of the Jacobian.
    y
        Present point, inside the box.
    lower, upper
        The box; equal entries hold a variable fixed.
    damping
        0 or more, relative to the squared column norms.

    References
    ----------
    Marquardt 1963 J. SIAM 11, 431; Nocedal, Wright 2006 Numerical Optimization, section 16.7.
    """
    triangle, projected = np.asarray(triangle), np.asarray(projected)
    y, lower, upper = (np.asarray(values) for values in (y, lower, upper))
    n = len(y)
    norms = _norms(triangle)
    damped = np.concatenate([triangle / norms, np.sqrt(damping) * np.eye(n)])
    held = held_by_bounds(y, triangle.T @ projected, lower, upper)
    step = np.zeros(n)
    # Each pass fixes at least one more variable, or ends.
    for _ in range(n + 1):
        fixed = np.where(held, step, 0.0)
        target = np.concatenate([-(projected + triangle @ fixed), np.zeros(n)])
        solution = np.linalg.lstsq(damped * ~held, target, rcond=_RANK_TOLERANCE)[0]
        free = np.where(held, fixed, solution / norms)
        step = np.clip(free, lower - y, upper - y)
        tightened = held | (step != free)
        if np.array_equal(tightened, held):
            break
        held = tightened
    return step


def held_by_bounds(y, gradient, lower, upper) -> Bool[np.ndarray, " parameters"]:
    """Variables at a bound with the gradient pointing outward, or without any range."""
    outward = ((y <= lower) & (gradient > 0)) | ((y >= upper) & (gradient < 0))
    return outward | (lower >= upper)


def _norms(matrix):
    norms = np.linalg.norm(matrix, axis=0)
    return np.where(norms > 0, norms, 1.0)


@dataclasses.dataclass(frozen=True)
class Linearised:
    """A point with its factorised Jacobian, in a box.

    Parameters
    ----------
    point
        With its Jacobian.
    lower, upper
        The box.
    curvature
        Of the residual; None for Gauss-Newton's model.
    """

    point: Point
    lower: Float[np.ndarray, " parameters"]
    upper: Float[np.ndarray, " parameters"]
    curvature: Curvature | None = None

    @cached_property
    def factors(self) -> tuple[np.ndarray, np.ndarray]:
        """Q and R, the latter square, even if there are fewer rows than parameters."""
        jacobian = self.point.jacobian
        assert jacobian is not None
        missing = max(jacobian.shape[1] - jacobian.shape[0], 0)
        return np.linalg.qr(np.concatenate([jacobian, np.zeros((missing, jacobian.shape[1]))]))

    @property
    def triangle(self) -> Float[np.ndarray, "parameters parameters"]:
        """R."""
        return self.factors[1]

    @cached_property
    def projected(self) -> Float[np.ndarray, " parameters"]:
        """Q^T r."""
        return self.project(self.point.residual)

    @property
    def gradient(self) -> Float[np.ndarray, " parameters"]:
        """J^T r."""
        return self.triangle.T @ self.projected

    def project(self, rows: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " parameters"]:
        """Q^T of a vector of rows."""
        q = self.factors[0]
        return q[: len(rows)].T @ rows

    @cached_property
    def decrement(self) -> float:
        """Part of |Q^T r|^2 in the range of the columns that are not held: 0 at a constrained minimum."""
        if not np.all(np.isfinite(self.triangle)):
            return float("inf")
        held = held_by_bounds(self.point.unit, self.gradient, self.lower, self.upper)
        free = self.triangle * ~held
        left, singular, _ = np.linalg.svd(free / _norms(free))
        kept = singular > _RANK_TOLERANCE * np.max(singular)
        return float(np.sum(np.where(kept, left.T @ self.projected, 0.0) ** 2))

    def meets_conditions(self, decrement: float = DECREMENT) -> bool:
        """Whether the first-order conditions of a minimum hold."""
        freedom = max(len(self.point.residual) - len(self.point.unit), 1)
        return self.decrement <= decrement * self.point.loss / freedom

    @property
    def plain(self) -> Factors:
        """Gauss-Newton's model."""
        return Factors(self.triangle, self.projected)

    @cached_property
    def curved(self) -> Factors | None:
        """The model with what is known of the curvature; None if it has no minimum."""
        return None if self.curvature is None else self.curvature.added_to(self.plain)

    @property
    def model(self) -> Factors:
        """The better of the two."""
        is_better = self.curvature is not None and self.curvature.is_better
        return self.curved if is_better and self.curved is not None else self.plain

    @property
    def is_curved(self) -> bool:
        """Whether the model contains the curvature."""
        return self.model is self.curved

    def step(
        self, damping: float, bend: Float[np.ndarray, " rows"] | None = None
    ) -> Float[np.ndarray, " parameters"]:
        """Damped step, with the bend of the residual along a trial step added to the residual."""
        root, projected = self.model
        if bend is not None:
            projected = projected + self.project(bend)
        return bounded_step(root, projected, self.point.unit, self.lower, self.upper, damping)

    def moved_to(self, point: Point) -> "Linearised":
        """The same at the end of a step, which tells the curvature along it."""
        jacobian, end = self.point.jacobian, point.jacobian
        assert jacobian is not None
        assert end is not None
        n, step = len(point.unit), point.unit - self.point.unit
        curvature = self.curvature or Curvature(np.zeros((n, n)))
        plain = self.plain.decrease(step)
        foreseen = plain, plain - float(step @ curvature.matrix @ step)
        known = curvature.after(
            step,
            (end - jacobian).T @ point.residual,
            end.T @ point.residual - self.gradient,
            foreseen,
            self.point.loss - point.loss,
        )
        return dataclasses.replace(self, point=point, curvature=known)

    def without_curvature(self) -> "Linearised":
        """With Gauss-Newton's model for the next step."""
        assert self.curvature is not None
        return dataclasses.replace(self, curvature=dataclasses.replace(self.curvature, is_better=False))


def descend(
    evaluate: Callable[[np.ndarray], Point],
    start: Float[np.ndarray, " parameters"],
    lower: Float[np.ndarray, " parameters"],
    upper: Float[np.ndarray, " parameters"],
    decrement: float = DECREMENT,
    follow: Callable[[], None] | None = None,
    damping: float = FIRST_DAMPING,
) -> tuple[Linearised, Outcome]:
    """Search a minimum by damped Gauss-Newton steps; return where it ended, and how.

    A step that brings less than a quarter of what it promises reveals the curvature of the residual along it.
    The step is then corrected for it, at the same damping, which follows a curved valley far more quickly
    than shorter steps do.

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

    References
    ----------
    Nielsen 1999 Damping parameter in Marquardt's method, IMM-REP-1999-05 (growth of the damping); Transtrum,
    Sethna 2012 arXiv:1201.5885 (the correction, here from the trial point instead of a second derivative).
    """
    follow = follow or (lambda: None)
    here = Linearised(evaluate(start), lower, upper)
    follow()
    if not np.isfinite(here.point.loss):
        return here, Outcome.NOT_FINITE
    growth, refusals, accepted = 2.0, 0, 0
    while refusals < _MOST_REFUSALS:
        if not np.all(np.isfinite(here.triangle)):
            return here, Outcome.NO_SLOPE
        if here.meets_conditions(decrement):
            return here, Outcome.CONVERGED
        if accepted < _FIRST_STEPS:
            damping = _damping_of_short_step(here, damping)
        point, gain = _trial(evaluate, here, damping, follow)
        if gain > _ACCEPTED:
            accepted += 1
            here = here.moved_to(point)
            damping *= _QUICKLY if gain > _GOOD else _SLOWLY if gain > _POOR else 1.0
            growth, refusals = 2.0, 0
        elif here.is_curved:
            here, refusals = here.without_curvature(), refusals + 1
        else:
            damping, growth, refusals = damping * growth, 2 * growth, refusals + 1
    return here, Outcome.STALLED


def linear_minimum(
    point: Point, lower: Float[np.ndarray, " parameters"], upper: Float[np.ndarray, " parameters"]
) -> Float[np.ndarray, " parameters"]:
    """Where the linear model at a point has its minimum within the box, or short of that if it is far."""
    here = Linearised(point, lower, upper)
    step = here.step(_damping_of_short_step(here, NEAR_DAMPING))
    return np.clip(point.unit + step, lower, upper)


def _damping_of_short_step(here: Linearised, damping: float) -> float:
    """The damping, or as much more as keeps the step short."""
    span = np.where(here.upper > here.lower, here.upper - here.lower, 1.0)
    while damping < _LARGEST_DAMPING and np.max(np.abs(here.step(damping)) / span) > _LONGEST_FIRST_STEP:
        damping *= _MORE_DAMPING
    return damping


def _trial(evaluate, here: Linearised, damping: float, follow: Callable[[], None]) -> tuple[Point, float]:
    """The point of one step, corrected if that is better, and its share of the promised decrease."""
    step = here.step(damping)
    promised = max(here.model.decrease(step), 1e-300)

    def at(change):
        point = evaluate(np.clip(here.point.unit + change, here.lower, here.upper))
        follow()
        return point, (here.point.loss - point.loss) / promised

    point, gain = at(step)
    if gain >= _POOR or not np.isfinite(point.loss) or here.is_curved:
        return point, gain
    bend = point.residual - here.point.residual - here.point.jacobian @ step
    corrected = here.step(damping, bend)
    norms = _norms(here.triangle)
    if np.linalg.norm(norms * (corrected - step)) > _LARGEST_CORRECTION * np.linalg.norm(norms * step):
        return point, gain
    return max((point, gain), at(corrected), key=lambda trial: trial[1])
