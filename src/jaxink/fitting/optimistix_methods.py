"""Methods of optimistix, which has no bounds: variables x with unit = (1 + sin x) / 2 meet those of the box.

This is MINUIT's transformation (James, Roos 1975 Comput. Phys. Commun. 10, 343). Its slope vanishes at the
bounds, so that a search does not leave a bound once it is there: a start on a bound is moved inside.
"""

import abc
import time

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.fitting.compiled import CompiledObjective, CompiledPrograms, Point
from jaxink.fitting.differentiable import differentiable
from jaxink.fitting.joint_objective import CompiledFit
from jaxink.fitting.limits import Limits
from jaxink.fitting.method import Method
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.watched import WatchedObjective
from jaxink.numerics.compiling import hastily
from jaxink.numerics.weak_cache import WeakCache

# A start is at least so far from the bounds, as a share of the ranges.
_INSIDE = 1e-3
_TOLERANCE = 1e-9
# Of the corners of a simplex, and its size at the start.
_COARSE_TOLERANCE, _FIRST_SIMPLEX = 1e-7, 0.1
_NO_TAGS: frozenset = frozenset()


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

        self.initial, self.advance = hastily(initial), hastily(advance, 1)


_programs = WeakCache(_Programs)


def _unit(x):
    return 0.5 * (1 + jnp.sin(x))


def _variables(unit: np.ndarray):
    return jnp.asarray(np.arcsin(2 * np.clip(unit, _INSIDE, 1 - _INSIDE) - 1))


class OptimistixMethod(Method, abc.ABC):
    """A method of optimistix, driven step by step."""

    is_least_squares = False
    has_jacobian = True
    usual_limits = Limits(steps=200)

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
    usual_limits = Limits(evaluations=2000)

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
