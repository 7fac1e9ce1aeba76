"""An expensive function of a few numbers, on which many variables act."""

import dataclasses
from collections.abc import Callable
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Float

from jaxink.errors import NoDerivativeError
from jaxink.numerics.linear_map import linear_map


def by_own_inputs(function: Callable, *parts: Any) -> Any:
    """Value of a function whose derivatives are taken by its own inputs first.

    Forward differentiation by many variables would otherwise repeat the whole function for each of them,
    those included that it does not depend on. Inputs that do not depend on any variable cost nothing.

    Parameters
    ----------
    function
        From trees to a tree of real arrays.
    *parts
        Its arguments, with few numbers that vary. Derivatives by each are taken apart from the others, which
        saves whatever depends on those alone, and compiles the function once more.
    """
    varying, fixed = eqx.partition(parts, eqx.is_inexact_array)
    leaves, tree = jax.tree.flatten(varying)
    # Part to which each leaf belongs.
    owner = [k for k, part in enumerate(varying) for _ in jax.tree.leaves(part)]

    def plain(*leaves):
        found = function(*eqx.combine(jax.tree.unflatten(tree, leaves), fixed))
        # Within a batch, JAX needs a batch of values wherever it finds one of changes, which add up over all
        # inputs. The compiler removes this.
        everything = sum(jnp.sum(leaf) for leaf in leaves)
        return jax.tree.map(lambda value: jnp.where(False, everything, value), found)

    value = jax.custom_jvp(plain)

    @partial(value.defjvp, symbolic_zeros=True)
    def _(primals, tangents):
        found, total = None, None
        for part in range(len(parts)):
            moving = [i for i in range(len(leaves)) if owner[i] == part and not _is_zero(tangents[i])]
            if moving:
                found, change = _along(plain, primals, moving, [tangents[i] for i in moving])
                total = change if total is None else jax.tree.map(jnp.add, total, change)
        return found, total

    return value(*leaves)


def _is_zero(tangent) -> bool:
    return isinstance(tangent, SymbolicZero)


def _along(plain, primals, moving, tangents):
    """Value and its change, by one derivative for each number of the leaves at the positions ``moving``."""
    change, unravel = ravel_pytree(tangents)

    def of(*numbers):
        replaced = dict(zip(moving, numbers, strict=True))
        return plain(*(replaced.get(i, leaf) for i, leaf in enumerate(primals)))

    def along(seed):
        return jax.jvp(of, tuple(primals[i] for i in moving), tuple(unravel(seed)))

    found, slopes = jax.vmap(along, out_axes=(None, 0))(jnp.eye(change.size))
    return found, jax.tree.map(lambda slope: jnp.tensordot(change, slope, axes=1), slopes)


def point_by_point(function: Callable, *columns: Float[Array, " points"]) -> Float[Array, "points *numbers"]:
    """As `by_own_inputs`, for a function that treats each point by itself.

    Its derivatives are taken by each column, at all points at once.

    Parameters
    ----------
    function
        From columns to an array whose first axis is that of the points.
    *columns
        Its arguments.
    """
    value = jax.custom_jvp(function)

    @partial(value.defjvp, symbolic_zeros=True)
    def _(primals, tangents):
        moving = [i for i, change in enumerate(tangents) if not _is_zero(change)]

        def along(seed):
            seeds = tuple(jnp.full_like(column, 1) * one for column, one in zip(primals, seed, strict=True))
            return jax.jvp(function, primals, seeds)

        found, slopes = jax.vmap(along, out_axes=(None, 0))(jnp.eye(len(primals))[np.array(moving, int)])
        change = jnp.zeros_like(found)
        for i, slope in zip(moving, slopes, strict=True):
            change += tangents[i].reshape(-1, *[1] * (slope.ndim - 1)) * slope
        return found, change

    return value(*columns)


def differentiable_once(values: Any, sentence: str) -> Any:
    """The values themselves, whose second derivatives are refused.

    Parameters
    ----------
    values
        A tree of real arrays.
    sentence
        What the error says.

    Raises
    ------
    NoDerivativeError
        When a derivative by the values is differentiated by them.
    """
    refusal = _Refusal(sentence)

    @jax.custom_jvp
    def same(value):
        return value

    @same.defjvp
    def _(primals, tangents):
        # Where a derivative is taken matters to nothing but the refusal.
        (change,) = linear_map(_change, refusal, primals, tangents)
        return same(*primals), change

    return jax.tree.map(lambda value: same(jnp.asarray(value)), values)


def _change(value, change):
    del value
    return (change,)


@dataclasses.dataclass(frozen=True)
class _Refusal:
    """In place of what would be differentiated a second time."""

    sentence: str

    def __call__(self, *_):
        raise NoDerivativeError(self.sentence)
