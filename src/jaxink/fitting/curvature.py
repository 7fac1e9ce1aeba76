"""Second derivatives of a residual, learnt from the Jacobians along a search.

Gauss-Newton steps neglect the curvature of the residual. Where a misfit remains, it is not negligible: the
steps are then too long or too short by a constant factor, and a search converges slowly, or oscillates about
the minimum. Each step reveals the curvature along it by the Jacobians at both ends, at no cost.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

# Smallest curvature of a model that is used, relative to the largest, in units of the squared column norms.
_LEAST_CURVATURE = 1e-8
# A Gauss-Newton model that promises the decrease within a quarter needs no correction.
_TRUSTED = 0.25


class Factors(NamedTuple):
    """A quadratic model |R d + p|^2 of the loss, but for a constant.

    Parameters
    ----------
    root
        R.
    projected
        p.
    """

    root: Float[np.ndarray, "parameters parameters"]
    projected: Float[np.ndarray, " parameters"]

    def decrease(self, step: Float[np.ndarray, " parameters"]) -> float:
        """Decrease in the loss along a step."""
        after = self.projected + self.root @ step
        return float(self.projected @ self.projected - after @ after)


@dataclasses.dataclass(frozen=True)
class Curvature:
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

    matrix: Float[np.ndarray, "parameters parameters"]
    is_better: bool = False

    def added_to(self, plain: Factors) -> Factors | None:
        """The model with this curvature; None if it has no minimum."""
        norms = np.linalg.norm(plain.root, axis=0)
        # Variables without effect have no curvature.
        kept = np.flatnonzero(norms > 0)
        norms, n = norms[kept], len(norms)
        gradient = (plain.root.T @ plain.projected)[kept] / norms
        whole = (plain.root.T @ plain.root + self.matrix)[np.ix_(kept, kept)]
        values, vectors = np.linalg.eigh(whole / np.outer(norms, norms))
        if not len(kept) or values[0] <= _LEAST_CURVATURE * values[-1]:
            return None
        roots = np.sqrt(values)
        root, projected = np.zeros((n, n)), np.zeros(n)
        root[np.ix_(kept, kept)] = (vectors * roots).T * norms
        projected[kept] = (vectors / roots).T @ gradient
        return Factors(root, projected)

    def after(
        self,
        step: Float[np.ndarray, " parameters"],
        change: Float[np.ndarray, " parameters"],
        of_gradient: Float[np.ndarray, " parameters"],
        foreseen: tuple[float, float],
        decrease: float,
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
            Decrease in the loss by Gauss-Newton's model, and by the model with this curvature.
        decrease
            That which came.
        """
        plain, corrected = foreseen
        along = float(step @ of_gradient)
        if not along > 0:
            return dataclasses.replace(self, is_better=False)
        used = float(step @ self.matrix @ step)
        # The curvature shrinks with the residual; without this, it would lag behind.
        size = min(abs(float(step @ change)) / abs(used), 1.0) if used != 0 else 1.0
        matrix = size * self.matrix
        missing = change - matrix @ step
        outer = np.outer(missing, of_gradient) / along
        matrix = (
            matrix + outer + outer.T - float(step @ missing) * np.outer(of_gradient, of_gradient) / along**2
        )
        is_off = abs(plain - decrease) > _TRUSTED * abs(plain)
        return Curvature(matrix, is_off and abs(corrected - decrease) <= abs(plain - decrease))
