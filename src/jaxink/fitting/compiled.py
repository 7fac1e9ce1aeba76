"""An objective's compiled programs, shared by all objectives of one structure and by all methods."""

import copy
import dataclasses
import time
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import PyTreeDef
from jaxtyping import Float

from jaxink.fitting.colouring import Colouring
from jaxink.fitting.objective import Objective
from jaxink.model import structure_of
from jaxink.numerics.compiling import LITTLE, NONE, Tiered, jit_unoptimised
from jaxink.numerics.fingerprint import fingerprint
from jaxink.numerics.weak_cache import WeakCache

# Number of runs above which optimised compilation pays: of Jacobians, and of residuals alone.
_MANY_JACOBIANS, _MANY_RESIDUALS = 1000, 3000
# Number of stacks above which a little optimisation pays for the few residuals of a screen.
_MANY_STACKS = 10


@dataclasses.dataclass(frozen=True, eq=False)
class Structure:
    """Everything but the arrays of an objective.

    Parameters
    ----------
    residual
        Function of (arrays, unit variables), traced once for all programs that call it; see
        `Objective.residual`.
    key
        Identifies it in every process; None if it contains what has no name there, such as a user's effect.
    n_stacks
        Number of stacks that one residual solves.
    """

    residual: Callable
    key: str | None
    n_stacks: int


class Program(NamedTuple):
    """A residual and what to call it with.

    Parameters
    ----------
    structure
        Shared by objectives that differ in their arrays only.
    arrays
        The objective's arrays.
    """

    structure: Structure
    arrays: Objective


@WeakCache
def _structure(treedef, leaves):
    static = jax.tree.unflatten(treedef, leaves)
    residual = jax.jit(lambda arrays, unit: eqx.combine(arrays, static).residual(unit))
    return Structure(residual, fingerprint(static), static.model.n_stacks)


def program_of(objective: Objective) -> Program:
    """Compiled residual of an objective, shared by all objectives of the same structure.

    Plain `jax.jit` of the arrays alone: a call then costs microseconds; hashing the description of the sample
    at each call would cost milliseconds.
    """
    arrays, *static = split(objective)
    return Program(_structure(*static), arrays)


def arrays_of(objective: Objective) -> Objective:
    """Arrays of an objective, the argument of a program of its structure."""
    return split(objective)[0]


def without_values(objective: Objective) -> Objective:
    """The objective of all samples that differ in their values only, which its variables and arrays give."""
    return structure_of(objective, frozenset((*objective.names, *objective.free)))


def split(objective: Objective) -> tuple[Objective, PyTreeDef, tuple]:
    """Arrays of an objective, and the tree and the leaves of the rest, which identify its structure."""
    arrays, static = eqx.partition(without_values(objective), eqx.is_array)
    leaves, treedef = jax.tree.flatten(static)
    return arrays, treedef, tuple(leaves)


class Point(NamedTuple):
    """An objective at one point.

    Parameters
    ----------
    unit
        Free parameters scaled to [0, 1].
    residual
        Residual vector, shape ``(rows,)``.
    predicted
        Predicted BSDF, 1/sr.
    jacobian
        Derivatives of the residual, shape ``(rows, parameters)``; None if they were not computed.
    """

    unit: np.ndarray
    residual: np.ndarray
    predicted: np.ndarray
    jacobian: np.ndarray | None = None

    @property
    def loss(self) -> float:
        """Sum of squares of the residual; infinite where the model is not finite."""
        # The square of a huge residual may overflow.
        with np.errstate(over="ignore", invalid="ignore"):
            loss = float(self.residual @ self.residual)
        return loss if np.isfinite(loss) else np.inf

    @property
    def freedom(self) -> int:
        """Degrees of freedom, at least 1."""
        return max(len(self.residual) - len(self.unit), 1)

    @classmethod
    def of_loss(cls, unit: Float[np.ndarray, " parameters"], loss: float) -> "Point":
        """A point of which only the loss is known."""
        return cls(unit, np.sqrt([loss]), np.zeros(0))


class CompiledPrograms:
    """Compiled programs of one structure of objective, shared by all objectives of that structure."""

    def __init__(self, structure: Structure):
        self.ready: set = set()
        evaluate = structure.residual

        def with_slopes(arrays, unit, seeds):
            def along(seed):
                value, change = jax.jvp(lambda u: evaluate(arrays, u), (unit,), (seed,))
                return *value, change[0]

            return jax.vmap(along, out_axes=(None, None, 1))(seeds)

        def alone(arrays, unit):
            return evaluate(arrays, unit)

        # Traced once for all programs that call them.
        self.traced_alone = evaluate
        self.traced_with_slopes = jax.jit(with_slopes)
        keys = [structure.key and fingerprint(structure.key, name) for name in ("with_slopes", "alone")]
        self.with_slopes = Tiered(with_slopes, _MANY_JACOBIANS, keys[0], (evaluate,))
        self.alone = Tiered(alone, _MANY_RESIDUALS, keys[1], (evaluate,))
        level = LITTLE if structure.n_stacks > _MANY_STACKS else NONE
        self.once = jit_unoptimised(alone, level, keys[1], (evaluate,))


_programs = WeakCache(CompiledPrograms)


class CompiledObjective:
    """The residual of an objective and its Jacobian by forward differentiation, compiled on demand.

    Parameters
    ----------
    objective
        To be evaluated; programs are shared by all objectives of the same structure.
    """

    def __init__(self, objective: Objective):
        structure, self.arrays = program_of(objective)
        self.programs = _programs(structure)
        self.colouring = Colouring.of(objective)

    def on(self, objective: Objective) -> "CompiledObjective":
        """The same programs for another objective of the same structure."""
        other = copy.copy(self)
        other.arrays, other.colouring = arrays_of(objective), Colouring.of(objective)
        return other

    def residual(self, unit: Float[np.ndarray, " parameters"]) -> Point:
        """The residual at a point."""
        residual, predicted = self.programs.alone.now()(self.arrays, jnp.asarray(unit))
        return Point(np.array(unit, float), np.asarray(residual), np.asarray(predicted))

    def linearised(self, unit: Float[np.ndarray, " parameters"]) -> Point:
        """The residual and its Jacobian at a point."""
        program = self.programs.with_slopes.now()
        at, runs = jnp.asarray(unit), np.split(self.colouring.seeds, self.colouring.n_runs)
        found = [program(self.arrays, at, jnp.asarray(seeds)) for seeds in runs]
        self.programs.ready.add(program)
        residual, predicted, _ = map(np.asarray, found[0])
        slopes = np.concatenate([slopes for _, _, slopes in found], axis=1)
        return Point(np.array(unit, float), residual, predicted, np.asarray(self.colouring.expand(slopes)))

    def predicted(self, unit: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " points"]:
        """Predicted BSDF, 1/sr."""
        if self.programs.with_slopes.now() in self.programs.ready:
            # This program computes more, but is already compiled.
            return self.linearised(unit).predicted
        return np.asarray(self.programs.once(self.arrays, jnp.asarray(unit))[1])

    def prepare(self, unit: Float[np.ndarray, " parameters"], jacobian: bool) -> float:
        """Compile what a search needs, if necessary; return the seconds it took."""
        programs = self.programs
        program = (programs.with_slopes if jacobian else programs.alone).now()
        if program in programs.ready:
            return 0.0
        began = time.perf_counter()
        _ = self.linearised(unit) if jacobian else self.residual(unit)
        programs.ready.add(program)
        return time.perf_counter() - began

    def count(self, evaluations: int, jacobians: int) -> None:
        """Take note of runs; programs that have run often are optimised before the next search."""
        self.programs.alone.now(evaluations)
        self.programs.with_slopes.now(jacobians)
