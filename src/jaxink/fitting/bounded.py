"""Steps of damped least squares within a box.

A variable at its bound with the gradient pointing outward is excluded from the step, and the step of the
others is clipped at their bounds. The damping is judged by the clipped step, so a bound does not affect it.

A point enters by the triangle R of the QR factorisation of its Jacobian and by Q^T r, so that nothing here
depends on the number of residuals, and nothing is squared: steps are made by singular values of R. Normal
equations would halve the digits, and directions of which the data know a millionth would be lost.

Second derivatives of a residual, learnt from the Jacobians along a search.

Gauss-Newton steps neglect the curvature of the residual. Where a misfit remains, it is not negligible: the
steps are then too long or too short by a constant factor, and a search converges slowly, or oscillates about
the minimum. Each step reveals the curvature along it by the Jacobians at both ends, at no cost.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Bool, Float

# Smallest curvature of a model that is used, relative to the largest, in units of the squared column norms.
_LEAST_CURVATURE = 1e-8
# A Gauss-Newton model that promises the decrease within a quarter needs no correction.
_TRUSTED = 0.25
# Decrement at which a search ends, relative to the sum of squares per degree of freedom. The distance to the
# minimum is then the root of it, 0.001 standard errors, in any units.
DECREMENT = 1e-6
# So many times that serve for a search that gets no further: where the model is smooth only to its accuracy,
# as the sum over the facets of a rough face is, 0.01 standard errors are as close as derivatives lead.
NEARLY = 100.0
# Singular values below this share of the largest are rounding: no step is made along their directions.
_RANK_TOLERANCE = 1e-11
_Either = Array | np.ndarray


class Factors(eqx.Module):
    """A quadratic model |R d + p|^2 of the loss, but for a constant.

    Parameters
    ----------
    root
        R.
    projected
        p.
    """

    root: Float[Array | np.ndarray, "parameters parameters"]
    projected: Float[Array | np.ndarray, " parameters"]

    def decrease(self, step: Float[Array | np.ndarray, " parameters"]) -> Float[Array | np.ndarray, ""]:
        """Decrease in the loss along a step."""
        after = self.projected + self.root @ step
        return self.projected @ self.projected - after @ after


class Curvature(eqx.Module):
    """Sum over the residuals of residual times second derivatives, as far as known, and whether to use it.

    Parameters
    ----------
    matrix
        Second derivatives of half the sum of squares, less the product of the Jacobians.
    is_better
        Whether it foretold the last step better than Gauss-Newton's model did.

    References
    ----------
    Dennis, Gay, Welsch 1981 ACM Trans. Math. Softw. 7, 348 (NL2SOL).
    """

    matrix: Float[Array | np.ndarray, "parameters parameters"]
    is_better: Bool[Array | np.ndarray, ""]

    def added_to(self, plain: Factors) -> tuple[Factors, Bool[Array, ""]]:
        """The model with this curvature, and whether that has a minimum; if not, the plain one."""
        norms = jnp.linalg.norm(plain.root, axis=0)
        # Variables without effect have no curvature.
        kept = norms > 0
        lengths = jnp.where(kept, norms, 1.0)
        gradient = plain.root.T @ plain.projected / lengths
        whole = (plain.root.T @ plain.root + self.matrix) / jnp.outer(lengths, lengths)
        whole = jnp.where(jnp.outer(kept, kept), whole, 0.0)
        # Theirs is the mean of the others' eigenvalues here, which is neither the least nor the largest.
        mean = jnp.trace(whole) / jnp.maximum(jnp.sum(kept), 1)
        whole = whole + jnp.diag(jnp.where(kept, 0.0, mean))
        is_finite = jnp.all(jnp.isfinite(whole))
        values, vectors = jnp.linalg.eigh(jnp.where(is_finite, whole, jnp.eye(len(norms))))
        has_minimum = is_finite & jnp.any(kept) & (values[0] > _LEAST_CURVATURE * values[-1])
        roots = jnp.sqrt(jnp.where(has_minimum, values, 1.0))
        root = (vectors * roots).T * jnp.where(kept, norms, 0.0)
        projected = (vectors / roots).T @ gradient
        model = Factors(
            jnp.where(has_minimum, root, plain.root), jnp.where(has_minimum, projected, plain.projected)
        )
        return model, has_minimum

    def after(
        self,
        step: Float[Array | np.ndarray, " parameters"],
        change: Float[Array | np.ndarray, " parameters"],
        of_gradient: Float[Array | np.ndarray, " parameters"],
        foreseen: Float[Array | np.ndarray, ""],
        decrease: Float[Array | np.ndarray, ""],
    ) -> "Curvature":
        """What is known after a step.

        Parameters
        ----------
        step
            From the last point to the new one.
        change
            Change of the Jacobian's transpose times the new residual.
        of_gradient
            Change of half the gradient of the loss.
        foreseen
            Decrease in the loss by Gauss-Newton's model.
        decrease
            That which came.
        """
        of_gradient = jnp.asarray(of_gradient)
        along = step @ of_gradient
        used = step @ self.matrix @ step
        # The curvature shrinks with the residual; without this, it would lag behind.
        size = jnp.minimum(jnp.abs(step @ change) / jnp.where(used != 0, jnp.abs(used), 1.0), 1.0)
        matrix = jnp.where(used != 0, size, 1.0) * self.matrix
        missing = change - matrix @ step
        length = jnp.where(along > 0, along, 1.0)
        outer = jnp.outer(missing, of_gradient) / length
        beyond = (step @ missing) * jnp.outer(of_gradient, of_gradient) / length**2
        matrix = matrix + outer + outer.T - beyond
        misses = jnp.abs(foreseen - decrease)
        is_better = (misses > _TRUSTED * jnp.abs(foreseen)) & (jnp.abs(foreseen - used - decrease) <= misses)
        # A step along which the gradient falls tells nothing of a minimum.
        return Curvature(jnp.where(along > 0, matrix, self.matrix), (along > 0) & is_better)


class Box(eqx.Module):
    """Where a search may go.

    Parameters
    ----------
    lower, upper
        Bounds; equal ones hold a variable fixed, infinite ones are none.
    """

    lower: Float[_Either, " parameters"]
    upper: Float[_Either, " parameters"]

    def holds(
        self, y: Float[_Either, " parameters"], gradient: Float[_Either, " parameters"]
    ) -> Bool[_Either, " parameters"]:
        """Variables at a bound with the gradient pointing outward, or without any range."""
        outward = ((y <= self.lower) & (gradient > 0)) | ((y >= self.upper) & (gradient < 0))
        return outward | (self.lower >= self.upper)


class Reduced(eqx.Module):
    """A residual r with its Jacobian J = Q R at a point, reduced to what a search needs.

    Parameters
    ----------
    y
        The point.
    loss
        r^T r; infinite where the residual is not finite.
    triangle
        R.
    projected
        Q^T r.
    crossed
        Q^T r with the Q of another point: the one that the search has come from.
    """

    y: Float[_Either, " parameters"]
    loss: Float[_Either, ""]
    triangle: Float[_Either, "parameters parameters"]
    projected: Float[_Either, " parameters"]
    crossed: Float[_Either, " parameters"]

    @property
    def gradient(self) -> Float[_Either, " parameters"]:
        """J^T r."""
        return self.triangle.T @ self.projected

    @property
    def plain(self) -> Factors:
        """Gauss-Newton's model."""
        return Factors(self.triangle, self.projected)

    def decrement(self, box: Box) -> Float[_Either, ""]:
        """Part of |Q^T r|^2 in the range of the columns that are not held: 0 at a constrained minimum."""
        xp = self.triangle.__array_namespace__()
        is_finite = xp.all(xp.isfinite(self.triangle))
        free = xp.where(is_finite, self.triangle, 0.0) * ~box.holds(self.y, self.gradient)
        left, singular, _ = xp.linalg.svd(free / column_norms(free))
        kept = singular > rank_tolerance(free) * xp.max(singular)
        total = xp.sum(xp.where(kept, left.T @ self.projected, 0.0) ** 2)
        return xp.where(is_finite, total, xp.inf)

    def slope(self, box: Box) -> Float[Array, ""]:
        """Largest cosine between the residual and a column of the Jacobian that is not held."""
        cosines = jnp.abs(self.gradient) / (column_norms(self.triangle) * jnp.sqrt(self.loss))
        return jnp.max(jnp.where(box.holds(self.y, self.gradient) | (self.gradient == 0), 0.0, cosines))


def reduced(
    y: Float[_Either, " parameters"],
    residual: Float[_Either, " rows"],
    jacobian: Float[_Either, "rows parameters"],
    basis: Float[_Either, "rows parameters"] | None = None,
) -> tuple[Reduced, Float[_Either, "rows parameters"]]:
    """Reduce the residual and the Jacobian at a point, of numpy or of JAX; return Q as well.

    Parameters
    ----------
    y
        The point.
    residual, jacobian
        There.
    basis
        Q of the point that the search has come from; None for the first point.
    """
    xp = jacobian.__array_namespace__()
    rows, n = jacobian.shape
    padded = xp.concatenate([jacobian, xp.zeros((max(n - rows, 0), n), jacobian.dtype)])
    # What overflows is infinite, and found to be so.
    with np.errstate(over="ignore", invalid="ignore"):
        q, triangle = xp.linalg.qr(padded)
        q = q[:rows]
        loss = residual @ residual
        projected = q.T @ residual
        crossed = xp.zeros_like(projected) if basis is None else basis.T @ residual
    loss = xp.where(xp.isfinite(loss), loss, xp.inf)
    return Reduced(y, loss, triangle, projected, crossed), q


@jax.jit
def bounded_step(
    model: Factors, y: Float[Array, " parameters"], box: Box, damping: Float[ArrayLike, ""]
) -> Float[Array, " parameters"]:
    """Step d that minimises |R d + p|^2 + damping |D d|^2 within the box, D^2 = diag(R^T R).

    Parameters
    ----------
    model
        R and p, the latter Q^T r.
    y
        Present point, inside the box.
    box
        The bounds.
    damping
        0 or more, relative to the squared column norms.

    References
    ----------
    Marquardt 1963 J. SIAM 11, 431; Nocedal, Wright 2006 Numerical Optimization, section 16.7.
    """
    n = len(y)
    # The factorisation of a matrix that is not finite may never end.
    root = jnp.where(jnp.all(jnp.isfinite(model.root)), model.root, 0.0)
    norms = column_norms(root)

    def clipped(at):
        held, step, _, passes = at
        fixed = jnp.where(held, step, 0.0)
        left, singular, right = jnp.linalg.svd(root / norms * ~held)
        # Singular values of the matrix with the root of the damping below it.
        damped = jnp.sqrt(singular**2 + damping)
        kept = damped > rank_tolerance(root) * jnp.max(damped)
        inverse = jnp.where(kept, singular / jnp.where(kept, damped, 1.0) ** 2, 0.0)
        solution = -right.T @ (inverse * (left.T @ (model.projected + root @ fixed)))
        free = jnp.where(held, fixed, solution / norms)
        step = jnp.clip(free, box.lower - y, box.upper - y)
        tightened = held | (step != free)
        return tightened, step, jnp.any(tightened != held), passes + 1

    # Each pass fixes at least one more variable, or ends.
    start = box.holds(y, root.T @ model.projected), jnp.zeros_like(y), jnp.array(True), jnp.array(0)
    return jax.lax.while_loop(lambda at: at[2] & (at[3] <= n), clipped, start)[1]


def column_norms(matrix: Float[_Either, "rows columns"]) -> Float[_Either, " columns"]:
    """Lengths of columns; 1 for those of zeros."""
    xp = matrix.__array_namespace__()
    norms = xp.linalg.norm(matrix, axis=0)
    return xp.where(norms > 0, norms, 1.0)


def rank_tolerance(matrix: Float[_Either, "rows columns"]) -> float:
    """Share of the largest singular value that is rounding."""
    return max(_RANK_TOLERANCE, 10 * float(np.finfo(matrix.dtype).eps))
