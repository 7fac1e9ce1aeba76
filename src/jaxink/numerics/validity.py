"""Refusal of parameter values that have no physical meaning."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from jaxink.errors import InputRefusedError


def is_known(value) -> bool:
    """Say whether a value, or every one of a tree, can be looked at: whether JAX is not tracing it."""
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(value))


def known_array(value) -> Array:
    """`jnp.asarray`, of which a known number stays known while a function is being compiled."""
    if not is_known(value):
        return jnp.asarray(value)
    with jax.ensure_compile_time_eval():
        return jnp.asarray(value)


def require(name: str, value, is_right: Callable[[np.ndarray], np.ndarray], requirement: str) -> None:
    """Refuse a value that is known and wrong; a traced value passes.

    Parameters
    ----------
    name
        Name of the parameter.
    value
        Number or array.
    is_right
        Tells for each element whether it is right; false for NaN.
    requirement
        What would be right, to complete "must ...".

    Raises
    ------
    InputRefusedError
        With the name, the first wrong value and the requirement.
    """
    if not is_known(value):
        return
    values = np.atleast_1d(np.asarray(value))
    right = np.broadcast_to(is_right(values), values.shape)
    if not np.all(right):
        raise InputRefusedError(f"{name} is {values[~right][0]:.6g}, but it must {requirement}.")
