"""Rejection of parameter values without physical meaning."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from jaxink.errors import InputRefusedError


def is_known(value) -> bool:
    """Whether a value, or every leaf of a tree, is concrete, that is, not being traced by JAX."""
    return not any(isinstance(leaf, jax.core.Tracer) for leaf in jax.tree.leaves(value))


def as_float(value) -> Array:
    """Array of floats of JAX's precision.

    Integers, Python's floats and NumPy's, which are three types in `jnp.asarray`, share compiled programs.
    """
    return jnp.asarray(value, float)


def known_float(value) -> Array:
    """`as_float`, of which a known number stays known while a function is being compiled."""
    if not is_known(value):
        return as_float(value)
    with jax.ensure_compile_time_eval():
        return as_float(value)


def require(name: str, value, is_right: Callable[[np.ndarray], np.ndarray], requirement: str) -> None:
    """Reject a known, invalid value; a traced value passes.

    Parameters
    ----------
    name
        Name of the parameter.
    value
        Number or array.
    is_right
        Whether each element is valid; false for NaN.
    requirement
        End of the sentence "it must ...".
    """
    if not is_known(value):
        return
    values = np.atleast_1d(np.asarray(value))
    right = np.broadcast_to(is_right(values), values.shape)
    if not np.all(right):
        raise InputRefusedError(f"{name} is {values[~right][0]:.6g}; it must {requirement}.")
