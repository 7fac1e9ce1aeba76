"""A function at each row of some columns."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp


def at_each(of: Callable, *columns):
    """What a function gives at each row; a single row needs no batch, which takes longer to trace.

    Parameters
    ----------
    of
        The function; as many arguments as there are columns.
    columns
        Trees of arrays with the rows along the leading axis.
    """
    if jax.tree.leaves(columns)[0].shape[0] > 1:
        return eqx.filter_vmap(of)(*columns)
    found = of(*jax.tree.map(lambda column: column[0], columns))
    return jax.tree.map(lambda value: jnp.asarray(value)[None], found)
