"""All methods by name.

Methods of optimistix, which has no bounds: variables x with unit = (1 + sin x) / 2 meet those of the box.

This is MINUIT's transformation (James, Roos 1975 Comput. Phys. Commun. 10, 343). Its slope vanishes at the
bounds, so that a search does not leave a bound once it is there: a start on a bound is moved inside.
"""

import abc
import dataclasses
import time
from collections.abc import Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.fitting.compiled import CompiledObjective, CompiledPrograms, Point
from jaxink.fitting.differentiable import differentiable
from jaxink.fitting.fit_objective import CompiledFit
from jaxink.fitting.gradient import Gradient
from jaxink.fitting.limits import SearchLimits
from jaxink.fitting.method import Method, WithJacobian, WithoutDerivatives
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.watched import WatchedObjective
from jaxink.numerics.compiling import jit_unoptimised
from jaxink.numerics.weak_cache import WeakCache

# A start is at least so far from the bounds, as a share of the ranges.
_INSIDE = 1e-3
_TOLERANCE = 1e-9
# Of the corners of a simplex, and its size at the start.
_COARSE_TOLERANCE, _FIRST_SIMPLEX = 1e-7, 0.1
_NO_TAGS: frozenset = frozenset()
# How far scipy's first corners are from the start: a share of it, or this if it is 0.
_SCIPY_STEP, _SCIPY_STEP_AT_0 = 0.05, 0.00025
# Resolution of the variables, as a share of their ranges, at which a method without derivatives ends.
_RESOLUTION = 1e-4
# Radius of the first steps and at the end, of the methods that have one, as a share of the ranges.
_FIRST_RADIUS, _LAST_RADIUS = 0.25, 1e-6
# Relative tolerance on the loss, of the first loss.
_RELATIVE = 1e-8
# Tolerances of the methods with derivatives: they end where rounding ends their progress.
_TIGHT = 1e-14


class _Programs:
    """Compiled steps of one solver on one structure of objective."""

    def __init__(self, programs: CompiledPrograms, kind: "type[OptimistixMethod]"):
        solver = kind().solver()
        self._static_state = None
        self.is_ready = False

        in_box = differentiable(programs)

        def function(x, given):
            residual, predicted = in_box(_unit(x), given)
            aux = residual, predicted
            return (residual if kind.is_least_squares else jnp.sum(residual**2)), aux

        def initial(given, x):
            f_struct, aux_struct = jax.eval_shape(function, x, given)
            state = solver.init(function, x, given, {}, f_struct, aux_struct, _NO_TAGS)
            dynamic, self._static_state = eqx.partition(state, eqx.is_array)
            return dynamic

        def advance(given, x, dynamic):
            state = eqx.combine(dynamic, self._static_state)
            x, state, _ = solver.step(function, x, given, {}, state, _NO_TAGS)
            done, _ = solver.terminate(function, x, given, {}, state, _NO_TAGS)
            return x, eqx.partition(state, eqx.is_array)[0], done

        self.initial, self.advance = jit_unoptimised(initial), jit_unoptimised(advance, 1)


_programs = WeakCache(_Programs)


def _unit(x):
    return 0.5 * (1 + jnp.sin(x))


def _variables(unit: np.ndarray):
    return jnp.asarray(np.arcsin(2 * np.clip(unit, _INSIDE, 1 - _INSIDE) - 1))


class OptimistixMethod(Method, abc.ABC):
    """A method of optimistix, driven step by step."""

    is_least_squares = False
    has_jacobian = True
    usual_limits = SearchLimits(steps=200)

    @abc.abstractmethod
    def solver(self):
        """The solver itself."""

    def effort(self, before, after) -> tuple[int, int]:
        """Evaluations without and with a Jacobian between two states: one Jacobian for each trial point."""
        del before, after
        return 0, 1

    def point(self, x, state) -> Point:
        """The last accepted point, where the variables are x."""
        return Point(np.asarray(_unit(x)), *map(np.asarray, state.aux))

    def prepare(self, compiled: CompiledFit, start: Float[np.ndarray, " parameters"]) -> float:
        """Compile the steps; return the seconds it took."""
        compiled = self._of_one(compiled)
        made = self._programs(compiled)
        seconds = compiled.prepare(start, jacobian=True) if self.has_jacobian else 0.0
        if made.is_ready:
            return seconds
        began = time.perf_counter()
        given, x = (compiled.arrays, compiled.colouring), _variables(start)
        state = made.initial(given, x)
        # The first state has weak types, for which the step is compiled apart.
        for _ in range(2):
            x, state, _ = made.advance(given, x, state)
        jax.block_until_ready(x)
        made.is_ready = True
        return seconds + time.perf_counter() - began

    def _of_one(self, compiled: CompiledFit) -> CompiledObjective:
        if not isinstance(compiled, CompiledObjective):
            raise InputRefusedError(
                f"method is '{self.name}', which compiles one program for all residuals; a project is fitted "
                "by gradient, simplex or a method of scipy."
            )
        return compiled

    def _programs(self, compiled: CompiledObjective) -> _Programs:
        return _programs(compiled.programs, type(self))

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        compiled, x = self._of_one(watched.compiled), _variables(start)
        made, given = self._programs(compiled), (compiled.arrays, compiled.colouring)
        state, done = made.initial(given, x), False
        while not done:
            before = state
            x, state, finished = made.advance(given, x, state)
            point = self.point(x, state)
            watched.note(point, *self.effort(before, state))
            watched.step()
            done = bool(finished) or not np.isfinite(point.loss)
        # One with a Jacobian is judged by the first-order conditions.
        return Outcome.STALLED if self.has_jacobian else Outcome.CONVERGED


class OptimistixLevenbergMarquardt(OptimistixMethod):
    """Levenberg-Marquardt."""

    name, title = "optimistix_levenberg_marquardt", "Levenberg-Marquardt method of optimistix"
    is_least_squares = True

    def solver(self):
        """The solver itself."""
        import optimistix as optx

        return optx.LevenbergMarquardt(_TOLERANCE, _TOLERANCE)


class OptimistixDogleg(OptimistixMethod):
    """Powell's dogleg."""

    name, title = "optimistix_dogleg", "dogleg method of optimistix"
    is_least_squares = True

    def solver(self):
        """The solver itself."""
        import optimistix as optx

        return optx.Dogleg(_TOLERANCE, _TOLERANCE)


class OptimistixBfgs(OptimistixMethod):
    """BFGS with a backtracking line search; the gradient is made of the Jacobian."""

    name, title = "optimistix_bfgs", "BFGS method of optimistix"

    def solver(self):
        """The solver itself."""
        import optimistix as optx

        return optx.BFGS(_TOLERANCE, _TOLERANCE)


class OptimistixNelderMead(OptimistixMethod):
    """Nelder-Mead."""

    name, title = "optimistix_nelder_mead", "Nelder-Mead method of optimistix"
    has_jacobian = False
    usual_limits = SearchLimits(evaluations=2000)

    def solver(self):
        """The solver itself."""
        import optimistix as optx

        return optx.NelderMead(_COARSE_TOLERANCE, _COARSE_TOLERANCE, adelta=_FIRST_SIMPLEX)

    def effort(self, before, after) -> tuple[int, int]:
        """The whole simplex at the beginning and when it shrinks, otherwise two evaluations."""
        shrunk = int(after.stats.n_shrink) - int(before.stats.n_shrink)
        return (0 if bool(before.first_pass) else 2) + shrunk * len(after.f_simplex), 0

    def point(self, x, state) -> Point:
        """The best corner, of which only the loss is known."""
        del x
        best = int(np.argmin(state.f_simplex))
        return Point.of_loss(np.asarray(_unit(state.simplex[best])), float(state.f_simplex[best]))


class ScipyMinimize(WithoutDerivatives):
    """A method of `scipy.optimize.minimize` without derivatives."""

    scipy_name: ClassVar[str]
    scipy_options: ClassVar[Mapping[str, Any]]

    def options_for(self, loss_start: float, start: Float[np.ndarray, " parameters"]) -> Mapping[str, Any]:
        """Options of scipy for a start and the loss there."""
        del loss_start, start
        return self.scipy_options

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        from scipy import optimize

        loss_start = watched.loss(start)

        def step(*_):
            watched.step()

        found = optimize.minimize(
            watched.loss,
            start,
            method=self.scipy_name,
            bounds=optimize.Bounds(watched.lower, watched.upper),
            callback=step,
            options=dict(self.options_for(max(loss_start, 1e-300), start)),
        )
        return Outcome.CONVERGED if found.success else Outcome.STALLED


@dataclasses.dataclass(frozen=True)
class Simplex(ScipyMinimize):
    """Nelder-Mead: the baseline (Gao, Han 2012 Comput. Optim. Appl. 51, 259; scipy's, with bounds).

    Parameters
    ----------
    steps
        From the start to the first corner along each variable; 0 for scipy's step. Empty: 0 for all.
    """

    name, title, scipy_name = "simplex", "simplex", "Nelder-Mead"

    steps: tuple[float, ...] = ()

    def options_for(self, loss_start: float, start: Float[np.ndarray, " parameters"]) -> Mapping[str, Any]:
        """Ends when the values agree to a share of the first one, and the corners to one of the ranges."""
        n = len(start)
        corners = {} if not self.steps else {"initial_simplex": self._corners(start)}
        return corners | {
            "maxfev": np.inf,
            "maxiter": np.inf,
            "xatol": _RESOLUTION,
            "fatol": _RELATIVE * loss_start,
            "adaptive": n > 4,
        }

    def _corners(self, start: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "corners parameters"]:
        usual = np.where(start == 0, _SCIPY_STEP_AT_0, _SCIPY_STEP * start)
        return np.vstack([start, start + np.diag(np.where(self.steps, self.steps, usual))])


class Powell(ScipyMinimize):
    """Powell's conjugate directions."""

    name, title, scipy_name = "powell", "Powell method", "Powell"
    scipy_options: ClassVar = {"maxfev": np.inf, "maxiter": np.inf, "xtol": _RESOLUTION, "ftol": _RELATIVE}


class Cobyla(ScipyMinimize):
    """COBYLA: linear models in a trust region. It may step outside the box; points are clipped to it."""

    name, title, scipy_name = "cobyla", "COBYLA method", "COBYLA"
    scipy_options: ClassVar = {"rhobeg": _FIRST_RADIUS, "tol": _LAST_RADIUS, "maxiter": 10**6}


class Cobyqa(ScipyMinimize):
    """COBYQA: quadratic models in a trust region."""

    name, title, scipy_name = "cobyqa", "COBYQA method", "COBYQA"
    scipy_options: ClassVar = {
        "initial_tr_radius": _FIRST_RADIUS,
        "final_tr_radius": _LAST_RADIUS,
        "maxfev": 10**6,
        "maxiter": 10**6,
    }


class DifferentialEvolution(WithoutDerivatives):
    """Differential evolution: a population from a Latin hypercube, one member of which is the start."""

    name, title = "differential_evolution", "differential evolution"

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        from scipy import optimize

        found = optimize.differential_evolution(
            watched.loss,
            optimize.Bounds(watched.lower, watched.upper),
            x0=start,
            rng=self.seed,
            maxiter=10**6,
            tol=1e-6,
            polish=False,
            callback=lambda *_, **__: watched.step(),
        )
        return Outcome.CONVERGED if found.success else Outcome.STALLED


class LimitedMemoryBfgs(WithJacobian):
    """L-BFGS-B, with the exact gradient 2 J^T r of the loss, relative to the first loss."""

    name, title = "l_bfgs_b", "L-BFGS-B method"

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        from scipy import optimize

        scale = max(watched.linearised(start).loss, 1e-300)

        def loss(unit):
            point = watched.linearised(unit)
            assert point.jacobian is not None
            return point.loss / scale, 2 * point.jacobian.T @ point.residual / scale

        optimize.minimize(
            loss,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=optimize.Bounds(watched.lower, watched.upper),
            callback=lambda *_: watched.step(),
            options={"maxfun": 10**6, "maxiter": 10**6, "ftol": _TIGHT, "gtol": _TIGHT},
        )
        # Judged by the first-order conditions.
        return Outcome.STALLED


class LeastSquares(WithJacobian):
    """A method of `scipy.optimize.least_squares`, with the exact Jacobian."""

    def descend(self, watched: WatchedObjective, start: Float[np.ndarray, " parameters"]) -> Outcome:
        """Search from a start."""
        from scipy import optimize

        last: list[Point] = []

        def linearised(unit):
            # The residual and the Jacobian are asked for separately; a trial point is one Jacobian, as it is
            # for jaxink's own method.
            if not last or not np.array_equal(last[-1].unit, unit):
                last[:] = [watched.linearised(unit)]
                watched.step()
            return last[-1]

        optimize.least_squares(
            lambda unit: linearised(unit).residual,
            start,
            jac=lambda unit: linearised(unit).jacobian,
            bounds=(watched.lower, watched.upper),
            method=self.name,
            x_scale="jac",
            ftol=_TIGHT,
            xtol=_TIGHT,
            gtol=_TIGHT,
            max_nfev=10**6,
        )
        # Judged by the first-order conditions.
        return Outcome.STALLED


class TrustRegionReflective(LeastSquares):
    """Trust region reflective."""

    name, title = "trf", "trust-region reflective method"


class Dogbox(LeastSquares):
    """Dogleg steps in a rectangular trust region."""

    name, title = "dogbox", "dogbox method"


METHODS: dict[str, type[Method]] = {
    method.name: method
    for method in (
        Gradient,
        Simplex,
        Powell,
        Cobyla,
        Cobyqa,
        DifferentialEvolution,
        LimitedMemoryBfgs,
        TrustRegionReflective,
        Dogbox,
        OptimistixLevenbergMarquardt,
        OptimistixDogleg,
        OptimistixBfgs,
        OptimistixNelderMead,
    )
}
