"""Residuals in units of their noise, one unknown factor being common to each scan."""

from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float, Int


@partial(jax.jit, static_argnames="n_scans")
def whiten_scans(
    residual: Float[ArrayLike, " points"],
    common: Float[ArrayLike, " points"],
    scan: Int[ArrayLike, " points"],
    n_scans: int,
) -> Float[Array, " points"]:
    """Whiten residuals whose covariance is 1 + q q^T within each scan.

    Parameters
    ----------
    residual
        Residuals in units of the independent sigma.
    common
        q: what the scan's common factor does to each point, in the same units.
    scan
        Number of the scan of each point.
    n_scans
        How many there are.

    Returns
    -------
    Float[Array, " points"]
        (1 + q q^T)^(-1/2) r, scan by scan; its sum of squares is r^T (1 + q q^T)^-1 r.

    References
    ----------
    Woodbury identity; its symmetric root for a rank-one term is
    1 - (1 - 1/sqrt(1 + q^T q)) q q^T / q^T q.
    """
    square = jnp.zeros(n_scans).at[scan].add(common**2)
    along = jnp.zeros(n_scans).at[scan].add(common * residual)
    root = jnp.sqrt(1 + square)
    # (1 - 1/root) / square without the division by zero where there is no common factor.
    factor = 1 / (root * (1 + root))
    return residual - common * (factor * along)[scan]
