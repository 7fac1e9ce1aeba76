"""What is left of a direction without what the free parameters of a fit can imitate.

Everything here is in whitened units: noise has unit covariance.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

# Directions of the scaled Jacobian weaker than this against the strongest are rounding, not parameters.
_RANK = 1e-9
# A direction of which less than this is left after the projection is imitated to rounding.
_ABSORBED = 1e-6


def orthonormal_range(columns: Float[np.ndarray, "rows columns"]) -> Float[np.ndarray, "rows rank"]:
    """Orthonormal basis of the space that columns span, whatever their units and dependences.

    Parameters
    ----------
    columns
        Each is scaled to norm 1 first; those of norm 0 are passed over.

    Returns
    -------
    Float[np.ndarray, "rows rank"]
        Left singular vectors whose singular value is above 1e-9 of the largest.
    """
    norm = np.linalg.norm(columns, axis=0)
    scaled = columns[:, norm > 0] / norm[norm > 0]
    if scaled.shape[1] == 0:
        return np.zeros((len(columns), 0))
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    return left[:, singular > _RANK * singular[0]]


@dataclass(frozen=True)
class UnitColumns:
    """What a projection leaves of columns.

    Parameters
    ----------
    unit
        Scaled to norm 1.
    norm
        The norm before; both 0 where all but rounding is imitated.
    """

    unit: Float[np.ndarray, "rows columns"]
    norm: Float[np.ndarray, " columns"]


@dataclass(frozen=True)
class Projection:
    """Orthogonal projection off a space: P = 1 - Q Q^T.

    Parameters
    ----------
    basis
        Q, orthonormal columns.
    """

    basis: Float[np.ndarray, "rows rank"]

    def remove(self, columns: Float[np.ndarray, "rows *columns"]) -> Float[np.ndarray, "rows *columns"]:
        """P times columns, or P times one vector.

        Parameters
        ----------
        columns
            Shape ``(rows,)`` or ``(rows, columns)``.
        """
        return columns - self.basis @ (self.basis.T @ columns)

    def unit(self, columns: Float[np.ndarray, "rows columns"]) -> UnitColumns:
        """What is left of each column, scaled to norm 1.

        Parameters
        ----------
        columns
            Directions.
        """
        rest = self.remove(columns)
        # A second pass removes what rounding left of a long column that is nearly all in the space.
        rest = self.remove(rest)
        norm = np.linalg.norm(rest, axis=0)
        norm = np.where(norm > _ABSORBED * np.linalg.norm(columns, axis=0), norm, 0.0)
        return UnitColumns(np.where(norm > 0, rest / np.where(norm > 0, norm, 1.0), 0.0), norm)
