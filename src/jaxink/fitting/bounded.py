"""Levenberg-Marquardt within a box, for optimistix, by an active set and clipped steps.

optimistix 0.1.0 has no bounds. Here a variable at its bound with the gradient pointing outward is excluded
from the step, and the step of the others is clipped at their bounds. The trust region judges the clipped
step, so a bound does not affect the damping.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float, PyTree

# Singular values below this share of the largest are rounding: no step is made along their directions.
_RANK_TOLERANCE = 1e-11


def bounded_step(
    triangle: Float[Array, "parameters parameters"],
    projected: Float[Array, " parameters"],
    y: Float[Array, " parameters"],
    lower: Float[Array, " parameters"],
    upper: Float[Array, " parameters"],
    damping: Float[Array, ""],
) -> Float[Array, " parameters"]:
    """Step d that minimises |R d + Q^T r|^2 + damping |D d|^2 within the box, D^2 = diag(R^T R).

    Parameters
    ----------
    triangle, projected
        R and Q^T r of the thin QR factorisation of the Jacobian.
    y
        Present point, inside the box.
    lower, upper
        The box; equal entries hold a variable fixed.
    damping
        0 or more, relative to the squared column norms.

    References
    ----------
    Marquardt 1963 J. SIAM 11, 431; Nocedal, Wright 2006 Numerical Optimization, section 16.7.
    """
    n = y.shape[0]
    norms = jnp.sqrt(jnp.sum(triangle**2, axis=0))
    norms = jnp.where(norms > 0, norms, 1.0)
    scaled = triangle / norms
    held = _held(y, scaled.T @ projected, lower, upper)
    ridge = jnp.sqrt(damping) * jnp.eye(n)

    def tighten(_, carry):
        held, step = carry
        fixed = jnp.where(held, step, 0.0)
        free = jnp.where(held, 0.0, 1.0)
        target = jnp.concatenate([-(projected + triangle @ fixed), jnp.zeros(n)])
        solution, *_ = jnp.linalg.lstsq(
            jnp.concatenate([scaled, ridge]) * free, target, rcond=_RANK_TOLERANCE
        )
        step = jnp.where(held, fixed, solution / norms)
        clipped = jnp.clip(step, lower - y, upper - y)
        return held | (clipped != step), clipped

    # Each pass fixes at least one more variable, or changes nothing.
    _, step = jax.lax.fori_loop(0, n + 1, tighten, (held, jnp.zeros(n)))
    return jnp.clip(step, lower - y, upper - y)


def _held(y, gradient, lower, upper):
    """Variables at a bound with the gradient pointing outward, or without any range."""
    outward = ((y <= lower) & (gradient > 0)) | ((y >= upper) & (gradient < 0))
    return outward | (lower >= upper)


def _explained(triangle, projected):
    """Part of |Q^T r|^2 in the range of the columns: 0 exactly at a constrained minimum."""
    norms = jnp.sqrt(jnp.sum(triangle**2, axis=0))
    left, singular, _ = jnp.linalg.svd(triangle / jnp.where(norms > 0, norms, 1.0))
    kept = singular > _RANK_TOLERANCE * jnp.max(singular)
    return jnp.sum(jnp.where(kept, left.T @ projected, 0.0) ** 2)


class _DescentState(eqx.Module):
    y: Float[Array, " parameters"]
    jacobian: Float[Array, "rows parameters"]
    triangle: Float[Array, "parameters parameters"]
    projected: Float[Array, " parameters"]
    decrement: Float[Array, ""]
    scale: Float[Array, ""]


class BoundedDampedDescent(optx.AbstractDescent):
    """Damped Gauss-Newton step inside a box.

    Parameters
    ----------
    lower, upper
        The box, shape ``(parameters,)``.
    first_damping
        Damping relative to diag(J^T J) while the trust region has size 1.
    """

    lower: Float[Array, " parameters"]
    upper: Float[Array, " parameters"]
    first_damping: float = 1e-3

    def init(self, y, f_info_struct) -> _DescentState:
        """Initial state with the right shapes; see `optimistix.AbstractDescent`."""
        n, rows = y.shape[0], f_info_struct.residual.shape[0]
        empty = jnp.zeros((rows, n)), jnp.zeros((n, n)), jnp.zeros(n)
        return _DescentState(y, *empty, jnp.asarray(jnp.inf), jnp.asarray(1.0))

    def query(self, y, f_info, state) -> _DescentState:
        """Factorise the Jacobian of an accepted point."""
        del state
        jacobian = f_info.jac.as_matrix()
        n_data, n = jacobian.shape
        # Keeps the triangle square if there are fewer data than parameters.
        padded = jnp.concatenate([jacobian, jnp.zeros((max(n - n_data, 0), n))])
        residual = jnp.concatenate([f_info.residual, jnp.zeros(max(n - n_data, 0))])
        q, triangle = jnp.linalg.qr(padded)
        projected = q.T @ residual
        gradient = triangle.T @ projected
        decrement = _explained(triangle * ~_held(y, gradient, self.lower, self.upper), projected)
        scale = jnp.sum(residual**2) / max(n_data - n, 1)
        return _DescentState(y, jacobian, triangle, projected, decrement, scale)

    def step(self, step_size, state):
        """Step for the present damping."""
        damping = self.first_damping / step_size
        step = bounded_step(state.triangle, state.projected, state.y, self.lower, self.upper, damping)
        return step, optx.RESULTS.successful


class BoundedLevenbergMarquardt(optx.AbstractGaussNewton):
    """Levenberg-Marquardt inside a box.

    Stops when the undamped step inside the box would lower the sum of squares by less than ``decrement``
    times the sum of squares per degree of freedom. The distance to the minimum is then sqrt(decrement)
    standard errors, in any units.

    Parameters
    ----------
    lower, upper
        The box, shape ``(parameters,)``.
    decrement
        See above.
    rtol, atol
        optimistix's own test on the change of variables and residuals, which also stops the search.
    verbose
        Called with the progress of each step, as in optimistix.
    """

    rtol: float
    atol: float
    norm: Callable[[PyTree], Array]
    descent: BoundedDampedDescent
    search: optx.ClassicalTrustRegion
    verbose: Callable[..., None]
    decrement: float

    def __init__(
        self,
        lower,
        upper,
        decrement: float = 1e-6,
        rtol: float = 1e-9,
        atol: float = 1e-9,
        verbose: Callable[..., None] | None = None,
    ):
        self.rtol, self.atol, self.norm = rtol, atol, optx.max_norm
        self.descent = BoundedDampedDescent(jnp.asarray(lower, float), jnp.asarray(upper, float))
        self.search = optx.ClassicalTrustRegion(
            high_cutoff=0.75, low_cutoff=0.01, high_constant=10.0, low_constant=0.1
        )
        self.verbose = _silent if verbose is None else verbose
        self.decrement = decrement

    def terminate(self, fn, y, args, options, state, tags: frozenset) -> tuple[Bool[Array, ""], Any]:
        """Whether the first-order conditions hold at the last accepted point."""
        del fn, y, args, options, tags
        descent = state.descent_state
        small = descent.decrement <= self.decrement * descent.scale
        return state.terminate | (small & ~state.first_step), state.result


def _silent(**kwargs) -> None:
    del kwargs
