"""Bounded Levenberg-Marquardt as a solver of optimistix."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, Bool, Float, PyTree, Scalar

from jaxink.fitting.bounded import DECREMENT, NEARLY, Box, reduced
from jaxink.fitting.search_state import FIRST_DAMPING, SearchState, Status, Taken, advanced, begun


class _State(eqx.Module):
    """A search with the bases of its Jacobians, and what the function returned besides."""

    search: SearchState
    here: Float[Array | np.ndarray, "rows parameters"]
    last: Float[Array | np.ndarray, "rows parameters"]
    aux_here: PyTree
    aux_last: PyTree


# mypy takes an abstract attribute of a base for a field without a default.
class BoundedLevenbergMarquardt(optx.AbstractLeastSquaresSolver):  # type: ignore[misc]
    """Levenberg-Marquardt within a box, by an active set, corrected steps and curvature learnt on the way.

    `jaxink.fit` searches by it; it minimises the sum of squares of any function::

        solver = jaxink.fitting.BoundedLevenbergMarquardt()
        options = {"lower": 0.0, "upper": jnp.array([1.0, 5.0])}
        found = optimistix.least_squares(residual, solver, y0, args, options)

    The bounds are trees like the variables, or numbers for all of them; each of the two may be left out.
    Equal ones hold a variable fixed. Variables with finite bounds move by at most 0.3 of their range in each
    of the first three steps.

    Each step of the solver is one evaluation: the residual and its Jacobian, by forward differentiation in
    one traced function, at one proposed point, so that a compiled search holds one such program. A point that
    is refused, or that is followed by a corrected one, takes a step as well: limit `max_steps` accordingly.

    Only the QR factorisation of the Jacobian sees its rows. All else works on matrices of the size of the
    parameters, by singular values of its triangle: as accurate as solving for each step with all rows,
    whereas normal equations would square the condition number. The active set consists of masks, so that
    many searches run under `jax.vmap`, each as if it ran alone. Use 64-bit floats for more than three digits.

    A search ends successfully where the decrement, the part of the sum of squares that an undamped step
    within the box promises to remove, is small, or where no step lowers the sum and the residual is
    orthogonal to the columns of the Jacobian that are not held. It ends with ``RESULTS.nonfinite`` where the
    function is not finite, and with ``RESULTS.nonlinear_divergence`` where no step lowers the sum otherwise.
    ``stats`` of the solution holds the decrement. Implicit derivatives of the solution are right where no
    bound is active.

    Parameters
    ----------
    rtol
        Largest decrement, relative to the sum of squares per degree of freedom. Its root is the distance to
        the minimum in standard errors.
    atol
        Largest decrement besides, in units of the sum of squares; it ends searches whose residuals vanish.
    damping
        Of the first step, relative to the squares of the columns of the Jacobian.

    References
    ----------
    Moré 1978 Lect. Notes Math. 630, 105 (scaling); Dennis, Gay, Welsch 1981 ACM Trans. Math. Softw. 7, 348
    (curvature); Transtrum, Sethna 2012 arXiv:1201.5885 (correction).
    """

    rtol: float = DECREMENT
    atol: float = 1e-24
    damping: float = FIRST_DAMPING

    @property  # type: ignore[misc]
    def norm(self) -> Callable[[PyTree], Scalar]:  # type: ignore[override]
        """The norm of the residual, whose square is minimised."""
        return optx.two_norm

    def init(self, fn, y, args, options, f_struct, aux_struct, tags) -> _State:
        """The state before the first evaluation."""
        del fn, args, tags
        start, _ = ravel_pytree(y)
        rows = sum(leaf.size for leaf in jax.tree.leaves(f_struct))
        freedom = max(rows - start.size, 1)
        box = Box(_bound(options, "lower", y, -jnp.inf), _bound(options, "upper", y, jnp.inf))
        # A smaller decrement is rounding of the sum of squares.
        relative = max(self.rtol / freedom, 16 * float(jnp.finfo(start.dtype).eps))
        search = begun(start, box, relative, self.atol, self.damping)
        basis = jnp.zeros((rows, start.size), start.dtype)
        aux = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), aux_struct)
        return _State(search, basis, basis, aux, aux)

    def step(self, fn, y, args, options, state, tags) -> tuple[PyTree, _State, PyTree]:
        """Evaluate at the proposed point, and propose the next one."""
        del options, tags
        _, unravel = ravel_pytree(y)
        residual, jacobian, aux = _linearised(lambda at: fn(unravel(at), args), state.search.proposal)
        found, basis = reduced(state.search.proposal, residual, jacobian, state.here)
        search = advanced(state.search, found)

        def taken(here, last, new):
            def chosen(x, y, z):
                return jnp.where(search.taken == Taken.LAST, z, jnp.where(search.taken == Taken.NONE, x, y))

            return jax.tree.map(chosen, here, last, new)

        state = _State(
            search,
            here=taken(state.here, state.last, basis),
            last=basis,
            aux_here=taken(state.aux_here, state.aux_last, aux),
            aux_last=aux,
        )
        return unravel(jnp.asarray(search.here.y)), state, state.aux_here

    def terminate(self, fn, y, args, options, state, tags) -> tuple[Bool[Array, ""], optx.RESULTS]:
        """Whether the search has ended, and how."""
        del fn, y, args, options, tags
        search, results = state.search, optx.RESULTS
        status = search.status
        is_finite = (status != Status.NOT_FINITE) & (status != Status.NO_SLOPE)
        result = results.where(is_finite, results.successful, results.nonfinite)
        # Where the Jacobian loses a rank at the minimum, no decrement tells that it has been reached.
        is_minimum = search.here.slope(search.box) <= float(jnp.finfo(search.proposal.dtype).eps) ** 0.4
        is_near = search.decrement <= NEARLY * search.tolerance(search.here.loss)
        is_stalled = (status == Status.STALLED) & ~is_minimum & ~is_near
        result = results.where(is_stalled, results.nonlinear_divergence, result)
        return status != Status.RUNNING, result

    def postprocess(
        self, fn, y, aux, args, options, state, tags, result
    ) -> tuple[PyTree, PyTree, dict[str, Any]]:
        """The solution as it is, with the decrement."""
        del fn, args, options, tags, result
        return y, aux, {"decrement": state.search.decrement}


def _bound(options: dict[str, Any], name: str, y: PyTree, default: float) -> Float[Array, " parameters"]:
    """A bound of each variable."""
    bound = options.get(name, default)
    tree: Any = jax.tree.structure(y)
    if tree != jax.tree.structure(bound):
        bound = jax.tree.map(lambda _: bound, y)
    filled = jax.tree.map(lambda leaf, b: jnp.broadcast_to(jnp.asarray(b, leaf.dtype), leaf.shape), y, bound)
    return ravel_pytree(filled)[0]


def _linearised(function, at: Float[Array, " parameters"]):
    """The residual in a row with its Jacobian, and what the function returns besides."""

    def along(seed):
        def rows(y):
            residual, aux = function(y)
            return ravel_pytree(residual)[0], aux

        return jax.jvp(rows, (at,), (seed,), has_aux=True)

    seeds = jnp.eye(at.size, dtype=at.dtype)
    residual, jacobian, aux = jax.vmap(along, out_axes=(None, 1, None))(seeds)
    return residual, jacobian, aux
