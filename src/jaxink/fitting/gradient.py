"""Gradient-based fit: optimistix's Gauss-Newton family with a bounded descent, driven step by step."""

import copy
import dataclasses
import time
from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxink.fitting.bounded import BoundedLevenbergMarquardt
from jaxink.fitting.objective import Objective
from jaxink.fitting.outcome import Outcome, Search
from jaxink.fitting.programs import arrays_of, program_of
from jaxink.numerics.compiling import Tiered, hastily
from jaxink.numerics.weak_cache import WeakCache

# Rejected trial points in a row after which the search stops: the damping is then 1e12 times larger.
_MOST_REFUSALS = 12
# Minima along the radius of a sphere are about 5 % apart, so a range of 1 : 6 needs about 40 values.
_SCAN_VALUES = 48
_SCAN_JACOBIANS = 10
_SCAN_KEPT = 3
_NO_TAGS: frozenset = frozenset()
# Number of Jacobians above which optimised compilation pays.
_MANY = 1000


class _Programs:
    """Compiled programs of one structure of objective, shared by all objectives of that structure."""

    def __init__(self, evaluate):
        self._static_state = None
        self.ready: set[Callable] = set()

        # Jitted separately, so that it is traced once for both programs below.
        @jax.jit
        def with_jacobian(arrays, unit):
            def twice(u):
                value = evaluate(arrays, u)
                return value, value

            jacobian, value = jax.jacfwd(twice, has_aux=True)(unit)
            return value, jacobian

        @jax.custom_jvp
        def residual(unit, arrays):
            return evaluate(arrays, unit)

        @residual.defjvp
        def _(primals, tangents):
            # The Jacobian as one matrix: optimistix linearises once and applies the result several times;
            # the tangent program would otherwise be traced and compiled each time.
            unit, arrays = primals
            value, jacobian = with_jacobian(arrays, unit)
            return value, jax.tree.map(lambda block: block @ tangents[0], jacobian)

        def initial(arrays, unit, lower, upper):
            solver = BoundedLevenbergMarquardt(lower, upper)
            (f_struct, aux_struct), _ = jax.eval_shape(with_jacobian, arrays, unit)
            state = solver.init(residual, unit, arrays, {}, f_struct, aux_struct, _NO_TAGS)
            dynamic, self._static_state = eqx.partition(state, eqx.is_array)
            return dynamic

        def advance(arrays, unit, lower, upper, dynamic):
            solver = BoundedLevenbergMarquardt(lower, upper)
            state = eqx.combine(dynamic, self._static_state)
            unit, state, _ = solver.step(residual, unit, arrays, {}, state, _NO_TAGS)
            done, _ = solver.terminate(residual, unit, arrays, {}, state, _NO_TAGS)
            loss = jnp.sum(state.f_info.residual**2)
            return unit, eqx.partition(state, eqx.is_array)[0], done, loss

        def predicted(arrays, unit):
            return evaluate(arrays, unit)[1]

        self.initial, self.advance = hastily(initial), Tiered(advance, _MANY)
        self.predicted = hastily(predicted)


_programs = WeakCache(_Programs)


class GradientSearch:
    """Bounded Levenberg-Marquardt on one objective; compiled once, for any number of starts.

    Parameters
    ----------
    objective
        To be minimised.
    max_jacobians
        Limit of one search.
    """

    def __init__(self, objective: Objective, max_jacobians: int = 100):
        residual, self._arrays = program_of(objective)
        self._compiled = _programs(residual)
        self.max_jacobians = max_jacobians

    def on(self, objective: Objective) -> "GradientSearch":
        """The same programs for another objective of the same structure."""
        other = copy.copy(self)
        other._arrays = arrays_of(objective)
        return other

    def predicted(self, unit: np.ndarray) -> np.ndarray:
        """Predicted BSDF at free parameters scaled to [0, 1], shape ``(points,)``, 1/sr."""
        if self._compiled.ready:
            # This program computes more, but is already compiled.
            return np.asarray(self._first_step(unit).aux)
        return np.asarray(self._compiled.predicted(self._arrays, jnp.asarray(unit)))

    def linearised(self, unit: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residual ``(rows,)`` and Jacobian ``(rows, parameters)`` at free parameters scaled to [0, 1]."""
        state = self._first_step(unit)
        return np.asarray(state.f_info.residual), np.asarray(state.descent_state.jacobian)

    def _first_step(self, unit: np.ndarray):
        """State of a search after its first step, which includes everything computed at the start."""
        start, box = jnp.asarray(unit), (jnp.zeros(len(unit)), jnp.ones(len(unit)))
        state = self._compiled.initial(self._arrays, start, *box)
        advance = self._compiled.advance.now(1)
        _, state, _, _ = advance(self._arrays, start, *box, state)
        self._compiled.ready.add(advance)
        return state

    def run(
        self,
        start: np.ndarray,
        held: dict[int, float] | None = None,
        progress: Callable[[int, float], None] | None = None,
        max_jacobians: int | None = None,
    ) -> Search:
        """Search from one start.

        Parameters
        ----------
        start
            Free parameters scaled to [0, 1].
        held
            Parameters, by position, that are held at a value in [0, 1].
        progress
            Called after each step with its number and the loss.
        max_jacobians
            Limit of this search; None for that of the engine.
        """
        lower, upper = np.zeros_like(start), np.ones_like(start)
        unit = np.clip(start, lower, upper)
        for position, value in (held or {}).items():
            lower[position] = upper[position] = unit[position] = value
        unit, box = jnp.asarray(unit), (jnp.asarray(lower), jnp.asarray(upper))
        advance = self._compiled.advance.now()
        compile_seconds = self._make_ready(advance, unit, box)
        began = time.perf_counter()
        unit, state, path, outcome = self._descend(
            advance, unit, box, progress, max_jacobians or self.max_jacobians
        )
        descent = state.descent_state
        if outcome is not Outcome.NOT_FINITE and not np.all(np.isfinite(descent.triangle)):
            outcome = Outcome.NO_SLOPE
        return Search(
            method="gradient",
            outcome=outcome,
            start=np.asarray(start),
            unit=np.asarray(unit),
            loss_start=path[0],
            loss=path[-1],
            jacobians=len(path),
            evaluations=0,
            run_seconds=time.perf_counter() - began,
            compile_seconds=compile_seconds,
            decrement=float(descent.decrement),
            triangle=np.asarray(descent.triangle),
            gradient=np.asarray(descent.triangle).T @ np.asarray(descent.projected),
            predicted=np.asarray(state.aux),
            path=tuple(path),
        )

    def _make_ready(self, advance: Callable, unit, box) -> float:
        """Compile what a search needs, if necessary; return the seconds it took."""
        compiled, arrays = self._compiled, self._arrays
        if advance in compiled.ready:
            return 0.0
        began = time.perf_counter()
        state = compiled.initial(arrays, unit, *box)
        jax.block_until_ready(advance(arrays, unit, *box, state))
        compiled.ready.add(advance)
        return time.perf_counter() - began

    def _descend(
        self, advance: Callable, unit, box, progress: Callable[[int, float], None] | None, max_jacobians: int
    ):
        """Step until a search ends: final point and state, loss after each step, and outcome."""
        compiled, arrays = self._compiled, self._arrays
        path, outcome = [], Outcome.MAX_STEPS
        state = compiled.initial(arrays, unit, *box)
        for step in range(1, max_jacobians + 1):
            unit, state, done, loss = advance(arrays, unit, *box, state)
            path.append(float(loss))
            if progress is not None:
                progress(step, path[-1])
            if not np.isfinite(path[-1]):
                outcome = Outcome.NOT_FINITE
                break
            if bool(done):
                outcome = Outcome.CONVERGED
                break
            if int(state.num_steps_since_acceptance) >= _MOST_REFUSALS:
                outcome = Outcome.STALLED
                break
        compiled.advance.now(len(path))
        return unit, state, path, outcome


def scan(
    engine: GradientSearch,
    first: np.ndarray,
    position: int,
    progress: Callable[[int, float], None] | None = None,
) -> tuple[list[np.ndarray], Search]:
    """Starts at the lowest minima along a parameter whose misfit has many, and the scan as one search.

    All other parameters are fitted at each value of the scanned one, starting from the solution at the
    previous value, up the range and down again. There are up to `_SCAN_KEPT` starts, lowest first; the search
    ends at the lowest.

    Parameters
    ----------
    engine
        The search.
    first
        Start values, scaled to [0, 1].
    position
        The parameter to scan.
    progress
        Called with the number of the value and the loss there.
    """
    grid = np.linspace(0.0, 1.0, _SCAN_VALUES)
    found: dict[int, Search] = {}
    every: list[Search] = []
    at = first
    for number, i in enumerate([*range(_SCAN_VALUES), *reversed(range(_SCAN_VALUES))]):
        search = engine.run(at, {position: float(grid[i])}, max_jacobians=_SCAN_JACOBIANS)
        every.append(search)
        at = search.unit if np.isfinite(search.loss) else first
        if i not in found or search.loss < found[i].loss:
            found[i] = search
        if progress is not None:
            progress(number + 1, search.loss)
    loss = np.array([found[i].loss for i in range(_SCAN_VALUES)])
    loss = np.where(np.isfinite(loss), loss, np.inf)
    padded = np.concatenate([[np.inf], loss, [np.inf]])
    minima = [i for i in range(_SCAN_VALUES) if loss[i] <= min(padded[i], padded[i + 2])]
    best = sorted(minima, key=lambda i: loss[i])[:_SCAN_KEPT]
    return [found[i].unit for i in best], together("scan", every, found[best[0]])


def together(method: str, every: Sequence[Search], end: Search) -> Search:
    """Combine searches into one named `method`: the effort of all, from the first start to `end`."""
    return dataclasses.replace(
        end,
        method=method,
        start=every[0].start,
        loss_start=every[0].loss_start,
        jacobians=sum(s.jacobians for s in every),
        run_seconds=sum(s.run_seconds for s in every),
        compile_seconds=sum(s.compile_seconds for s in every),
    )


def starts(first: np.ndarray, count: int, seed: int) -> list[np.ndarray]:
    """Start points in the unit box: the given one, then `count` - 1 from a seeded Latin hypercube."""
    if count == 1:
        return [np.asarray(first, float)]
    from scipy.stats import qmc

    more = qmc.LatinHypercube(len(first), rng=np.random.default_rng(seed)).random(count - 1)
    return [np.asarray(first, float), *more]
