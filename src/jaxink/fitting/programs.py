"""Compiled residuals, shared by all objectives of one structure."""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.tree_util import PyTreeDef

from jaxink.fitting.objective import Objective
from jaxink.model.build import StackBuilder
from jaxink.numerics.fingerprint import fingerprint
from jaxink.numerics.weak_cache import WeakCache


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
    given = frozenset((*objective.names, *objective.free))

    def kept(x):
        if isinstance(x, StackBuilder):
            return x.without_values(given)
        return jnp.asarray(x) if isinstance(x, np.ndarray) else x

    return jax.tree.map(kept, objective, is_leaf=lambda x: isinstance(x, StackBuilder))


def split(objective: Objective) -> tuple[Objective, PyTreeDef, tuple]:
    """Arrays of an objective, and the tree and the leaves of the rest, which identify its structure."""
    arrays, static = eqx.partition(without_values(objective), eqx.is_array)
    leaves, treedef = jax.tree.flatten(static)
    return arrays, treedef, tuple(leaves)
