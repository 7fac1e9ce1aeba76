"""Second derivatives of a residual, learnt from the Jacobians along a search.

Gauss-Newton steps neglect the curvature of the residual. Where a misfit remains, it is not negligible: the
steps are then too long or too short by a constant factor, and a search converges slowly, or oscillates about
the minimum. Each step reveals the curvature along it by the Jacobians at both ends, at no cost.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

# Smallest curvature of a model that is used, relative to the largest, in units of the squared column norms.
_LEAST_CURVATURE = 1e-8
# A Gauss-Newton model that promises the decrease within a quarter needs no correction.
_TRUSTED = 0.25


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
