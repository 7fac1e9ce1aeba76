"""Compiled residuals, shared by all objectives of one structure."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxink.fitting.objective import Objective
from jaxink.numerics.weak_cache import WeakCache


class Program(NamedTuple):
    """A residual, traced once for all programs that call it.

    Parameters
    ----------
    residual
        Function of (arrays, unit variables); see `Objective.residual`.
    arrays
        The objective's arrays.
    """

    residual: Callable
    arrays: Objective


@WeakCache
def _residual_of_structure(treedef, leaves):
    static = jax.tree.unflatten(treedef, leaves)
    return jax.jit(lambda arrays, unit: eqx.combine(arrays, static).residual(unit))


def program_of(objective: Objective) -> Program:
    """Compiled residual of an objective, shared by all objectives of the same structure.

    Plain `jax.jit` of the arrays alone: a call then costs microseconds; hashing the description of the sample
    at each call would cost milliseconds.
    """
    arrays, static = _split(objective)
    leaves, treedef = jax.tree.flatten(static)
    return Program(_residual_of_structure(treedef, tuple(leaves)), arrays)


def arrays_of(objective: Objective) -> Objective:
    """Arrays of an objective, the argument of a program of its structure."""
    return _split(objective)[0]


def _split(objective: Objective):
    return eqx.partition(
        jax.tree.map(lambda x: jnp.asarray(x) if isinstance(x, np.ndarray) else x, objective), eqx.is_array
    )
