"""Many searches at once: one compiled program over a batch of starts, or of sheets of one structure."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from jaxink.fitting.bounded import DECREMENT, NEARLY
from jaxink.fitting.compiled import CompiledObjective, CompiledPrograms
from jaxink.fitting.differentiable import differentiable
from jaxink.fitting.levenberg_marquardt import BoundedLevenbergMarquardt
from jaxink.fitting.outcome import Outcome, Search, SearchPath
from jaxink.fitting.search_state import Status
from jaxink.numerics.compiling import LITTLE, jit_unoptimised
from jaxink.numerics.weak_cache import WeakCache

_OUTCOMES = {
    Status.RUNNING: Outcome.MAX_STEPS,
    Status.CONVERGED: Outcome.CONVERGED,
    Status.STALLED: Outcome.STALLED,
    Status.NO_SLOPE: Outcome.NO_SLOPE,
    Status.NOT_FINITE: Outcome.NOT_FINITE,
}
_MOST_STEPS = 200


class _Programs:
    """The compiled search of one structure of objective, over a batch of starts or of objectives."""

    def __init__(self, programs: CompiledPrograms):
        function = differentiable(programs)
        # mypy takes its defaults for abstract attributes.
        solver = BoundedLevenbergMarquardt()  # type: ignore[call-arg]
        box: dict[str, Any] = {"lower": 0.0, "upper": 1.0}
        tags: frozenset = frozenset()
        self.ready: set[tuple[int, tuple[bool, ...]]] = set()

        def one(shared, own, start, most_steps):
            given = eqx.combine(shared, own)
            shapes = jax.eval_shape(function, start, given)
            begun = jax.tree.map(jnp.asarray, solver.init(function, start, given, box, *shapes, tags))

            def goes_on(at):
                y, state, _, steps = at
                is_done, _ = solver.terminate(function, y, given, box, state, tags)
                return ~is_done & (steps < most_steps)

            def step(at):
                y, state, first, steps = at
                y, state, _ = solver.step(function, y, given, box, state, tags)
                return y, state, jnp.where(steps == 0, state.search.here.loss, first), steps + 1

            y, state, first, steps = jax.lax.while_loop(goes_on, step, (start, begun, jnp.inf, 0))
            search = state.search
            return {
                "unit": y,
                "loss_start": first,
                "loss": search.here.loss,
                "steps": steps,
                "rows": jnp.asarray(shapes[0].shape[0]),
                "decrement": search.decrement,
                "triangle": search.here.triangle,
                "gradient": search.here.gradient,
                "predicted": state.aux_here,
                "status": search.status,
            }

        self.run = jit_unoptimised(jax.vmap(one, (None, 0, 0, None)), LITTLE)


_programs = WeakCache(_Programs)


def searches_at_once(
    compiled: CompiledObjective,
    starts: Sequence[Float[np.ndarray, " parameters"]],
    at_once: int,
    most_steps: int = _MOST_STEPS,
    progress: Callable[[int, float], None] | None = None,
) -> list[Search]:
    """Searches by `BoundedLevenbergMarquardt` from many starts, without limits but that of steps.

    Each ends where it would end alone; all of a batch run until the last one has ended.

    Parameters
    ----------
    compiled
        What to minimise.
    starts
        Free parameters scaled to [0, 1].
    at_once
        Number of searches of one run of the program; the last run repeats starts up to that number.
    most_steps
        Limit of each search: a step is one Jacobian.
    progress
        Called with the number of searches that have ended and the lowest loss.

    Returns
    -------
    list
        A search for each start. Paths have two entries; of the time of a run, each has its share.
    """
    return searches_of_sheets([compiled] * len(starts), starts, at_once, most_steps, progress)


def searches_of_sheets(
    sheets: Sequence[CompiledObjective],
    starts: Sequence[Float[np.ndarray, " parameters"]],
    at_once: int,
    most_steps: int = _MOST_STEPS,
    progress: Callable[[int, float], None] | None = None,
) -> list[Search]:
    """As `searches_at_once`, each search of an objective of its own, all of one structure.

    What the objectives have in common, such as the directions, is neither repeated nor computed for each.

    Parameters
    ----------
    sheets
        What to minimise.
    starts
        A start for each of them.
    at_once, most_steps, progress
        See `searches_at_once`.

    Raises
    ------
    ValueError
        If their structures, or the shapes of their arrays, differ: then they have no program in common.
    """
    every = [(one.arrays, one.colouring) for one in sheets]
    if len({id(one.programs) for one in sheets}) > 1 or len({_shapes(one) for one in every}) > 1:
        raise ValueError("the objectives have no program in common; search those of one structure at once.")
    found, lowest = list[Search](), np.inf
    common = _common(every)
    for begin in range(0, len(starts), at_once):
        chunk = np.array(starts[begin : begin + at_once], float)
        # A run of fewer repeats them.
        chosen = np.arange(at_once) % len(chunk)
        shared, own = _batch([every[begin + k] for k in chosen], common)
        points = jnp.asarray(chunk[chosen])
        made, key, compile_seconds = _programs(sheets[begin].programs), (at_once, common), 0.0
        if key not in made.ready:
            began = time.perf_counter()
            # Of no steps.
            jax.block_until_ready(made.run(shared, own, points, 0))
            made.ready.add(key)
            compile_seconds = time.perf_counter() - began
        began = time.perf_counter()
        ends = {name: np.asarray(value) for name, value in made.run(shared, own, points, most_steps).items()}
        seconds = (time.perf_counter() - began) / len(chunk)
        for k, start in enumerate(chunk):
            row = {name: value[k] for name, value in ends.items()}
            found.append(_search(start, row, seconds, compile_seconds if k == 0 else 0.0))
            sheets[begin + k].count(0, found[-1].jacobians)
        lowest = min(lowest, *(search.loss for search in found[begin:]))
        if progress is not None:
            progress(len(found), lowest)
    return found


def _shapes(given: Any) -> tuple:
    leaves, tree = jax.tree.flatten(given)
    return tree, *((leaf.shape, leaf.dtype) for leaf in leaves)


def _common(every: Sequence[Any]) -> tuple[bool, ...]:
    """Which arrays are the same in all objectives."""
    first, *others = [jax.tree.leaves(one) for one in every]
    return tuple(
        all(one[k] is array or np.array_equal(one[k], array) for one in others)
        for k, array in enumerate(first)
    )


def _batch(chosen: Sequence[Any], common: tuple[bool, ...]) -> tuple[Any, Any]:
    """Arrays that objectives have in common, and those of their own, one after the other."""
    tree = jax.tree.structure(chosen[0])
    columns = list(zip(*map(jax.tree.leaves, chosen), strict=True))
    shared = [column[0] if same else None for column, same in zip(columns, common, strict=True)]
    own = [
        None if same else jnp.stack(list(map(jnp.asarray, column)))
        for column, same in zip(columns, common, strict=True)
    ]
    return jax.tree.unflatten(tree, shared), jax.tree.unflatten(tree, own)


def _search(start: np.ndarray, row: dict[str, Any], seconds: float, compile_seconds: float) -> Search:
    steps, loss_start, loss = int(row["steps"]), float(row["loss_start"]), float(row["loss"])
    outcome = _OUTCOMES[Status(int(row["status"]))]
    freedom = max(int(row["rows"]) - len(start), 1)
    if outcome is Outcome.STALLED and row["decrement"] <= NEARLY * DECREMENT * loss / freedom:
        outcome = Outcome.CONVERGED
    path = SearchPath(
        evaluations=np.zeros(2, int),
        jacobians=np.array([1, steps]),
        seconds=np.array([seconds / steps, seconds]),
        loss=np.array([loss_start, loss]),
        unit=np.stack([start, row["unit"]]),
    )
    return Search(
        method="gradient",
        outcome=outcome,
        start=start,
        unit=row["unit"],
        loss_start=loss_start,
        loss=loss,
        steps=steps,
        jacobians=steps,
        evaluations=0,
        run_seconds=seconds,
        compile_seconds=compile_seconds,
        decrement=float(row["decrement"]),
        triangle=row["triangle"],
        gradient=row["gradient"],
        predicted=row["predicted"],
        path=path,
    )
