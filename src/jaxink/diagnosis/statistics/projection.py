"""Projection off the directions that the free parameters of a fit span.

All quantities are whitened: noise has unit covariance.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr

# Singular values of the scaled Jacobian below this share of the largest are rounding.
_RANK = 1e-9
# A direction of which less than this remains after the projection is degenerate to rounding.
_DEGENERATE = 1e-6


def orthonormal_range(columns: Float[np.ndarray, "rows columns"]) -> Float[np.ndarray, "rows rank"]:
    """Orthonormal basis of the span of columns, independent of their units and linear dependences.

    Columns are scaled to norm 1 first, zero columns ignored, and singular values above 1e-9 of the largest
    kept.
    """
    norm = np.linalg.norm(columns, axis=0)
    scaled = columns[:, norm > 0] / norm[norm > 0]
    if scaled.shape[1] == 0:
        return np.zeros((len(columns), 0))
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    return left[:, singular > _RANK * singular[0]]


@dataclass(frozen=True)
class UnitColumns:
    """Columns after a projection, at norm 1, and their norm before (both 0 if only rounding remains)."""

    unit: Float[np.ndarray, "rows columns"]
    norm: Float[np.ndarray, " columns"]


@dataclass(frozen=True)
class Projection:
    """Orthogonal projection P = 1 - Q Q^T off the space of an orthonormal basis Q."""

    __repr__ = brief_repr

    basis: Float[np.ndarray, "rows rank"]

    def remove(self, columns: Float[np.ndarray, "rows *columns"]) -> Float[np.ndarray, "rows *columns"]:
        """P times columns, or P times one vector."""
        return columns - self.basis @ (self.basis.T @ columns)

    def unit(self, columns: Float[np.ndarray, "rows columns"]) -> UnitColumns:
        """P times each column, scaled to norm 1."""
        rest = self.remove(columns)
        # The second pass removes the rounding error of a long column that is nearly in the space.
        rest = self.remove(rest)
        norm = np.linalg.norm(rest, axis=0)
        norm = np.where(norm > _DEGENERATE * np.linalg.norm(columns, axis=0), norm, 0.0)
        return UnitColumns(np.where(norm > 0, rest / np.where(norm > 0, norm, 1.0), 0.0), norm)
