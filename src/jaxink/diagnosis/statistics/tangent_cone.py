"""Small changes of the prediction that the parameters of a fit can make.

Near a minimum the parameters span a linear space; a parameter at a bound of its range can only move inwards,
which makes the space a cone. All quantities are whitened: noise has unit covariance.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError

# All subsets of the parameters at a bound are tried: 4096 of 12.
_MOST_EDGES = 12
# A smaller pull on a parameter at its bound, in rms of the residual, is incomplete convergence.
_PULL = 1e-2


def cone_coefficients(
    scores: Float[np.ndarray, "vectors columns"], gram: Float[np.ndarray, "columns columns"]
) -> Float[np.ndarray, "vectors columns"]:
    """Least squares with coefficients a >= 0, for many vectors at once.

    The solution is the best unconstrained solution among all subsets of columns with positive coefficients.
    There are few columns, and each subset takes one small product for all vectors together.

    Parameters
    ----------
    scores
        W^T v of each vector v.
    gram
        W^T W; columns of norm 1.

    Raises
    ------
    InputRefusedError
        More than 12 columns.

    References
    ----------
    Lawson, Hanson 1974 Solving Least Squares Problems, chapter 23.
    """
    vectors, columns = scores.shape
    if columns > _MOST_EDGES:
        raise InputRefusedError(
            f"{columns} parameters are at a bound; at most {_MOST_EDGES} are supported: fix some of them."
        )
    best = np.zeros(vectors)
    coefficients = np.zeros((vectors, columns))
    for size in range(1, columns + 1):
        for chosen in map(list, combinations(range(columns), size)):
            block = gram[np.ix_(chosen, chosen)]
            # The optimum is also reached on an independent subset (Caratheodory).
            if np.linalg.eigvalsh(block)[0] < 1e-10:
                continue
            solved = np.linalg.solve(block, scores[:, chosen].T).T
            drop = np.sum(solved * scores[:, chosen], axis=1)
            better = np.all(solved >= 0, axis=1) & (drop > best)
            best[better] = drop[better]
            coefficients[better] = 0.0
            coefficients[np.ix_(better, chosen)] = solved[better]
    return coefficients


class Group(NamedTuple):
    """Vectors with the same active edges: these edges, and the indices of the vectors."""

    active: Bool[np.ndarray, " edges"]
    members: Int[np.ndarray, " vectors"] | slice


@dataclass(frozen=True)
class TangentCone:
    """Small changes of the prediction that the parameters can make.

    Parameters
    ----------
    basis
        Orthonormal basis of the parameters that can move both ways.
    edges
        Direction of each parameter at a bound, orthogonal to the basis, norm 1, pointing into its range.

    References
    ----------
    Chernoff 1954 Ann. Math. Stat. 25, 573; Self, Liang 1987 JASA 82, 605.
    """

    __repr__ = brief_repr

    basis: Float[np.ndarray, "rows rank"]
    edges: Float[np.ndarray, "rows edges"]

    @classmethod
    def of(
        cls,
        jacobian: Float[np.ndarray, "rows parameters"],
        at_bound: Int[np.ndarray, " parameters"] | None = None,
    ) -> "TangentCone":
        """Tangent cone of a fit.

        Parameters
        ----------
        jacobian
            Derivatives of the whitened prediction with respect to the parameters.
        at_bound
            -1 for a parameter at its lower bound or indistinguishable from it (within about one standard
            error), +1 at its upper bound, 0 inside; None if no parameter is at a bound.

        Raises
        ------
        InputRefusedError
            The Jacobian is not finite.
        """
        finite = np.isfinite(jacobian).all(axis=0)
        if not finite.all():
            raise InputRefusedError(
                f"column {int(np.argmin(finite))} of the Jacobian is not finite; every derivative must be."
            )
        bound = np.zeros(jacobian.shape[1], int) if at_bound is None else at_bound
        basis = orthonormal_range(jacobian[:, bound == 0])
        on_bound = np.flatnonzero(bound)
        edges = Projection(basis).unit(-bound[on_bound] * jacobian[:, on_bound])
        return cls(basis, edges.unit[:, edges.norm > 0])

    @property
    def n_edges(self) -> int:
        """Number of parameters at a bound that matter."""
        return self.edges.shape[1]

    def projection(self, active: Bool[np.ndarray, " edges"]) -> Projection:
        """Projection off the basis and the edges that are active, that is, free."""
        if not active.any():
            return Projection(self.basis)
        return Projection(np.hstack([self.basis, orthonormal_range(self.edges[:, active])]))

    def active(self, vectors: Float[np.ndarray, "vectors rows"]) -> Bool[np.ndarray, "vectors edges"]:
        """Edges that a whitened residual, fitted or not, does not push against.

        False if the misfit pulls a parameter out of its range, so that its column is not free. True also if
        it pulls neither way, as inside the range.
        """
        pull = np.abs(vectors @ self.edges)
        size = np.sqrt(np.mean(vectors**2, axis=1, keepdims=True))
        # The edges are orthogonal to the basis.
        coefficients = cone_coefficients(vectors @ self.edges, self.edges.T @ self.edges)
        return (coefficients > 0) | (pull <= _PULL * size)

    def groups(self, vectors: Float[np.ndarray, "vectors rows"]) -> Iterator[Group]:
        """Vectors grouped by their active edges."""
        if self.n_edges == 0:
            yield Group(np.zeros(0, bool), slice(None))
            return
        patterns, group = np.unique(self.active(vectors), axis=0, return_inverse=True)
        group = group.reshape(-1)
        for number, active in enumerate(patterns):
            yield Group(active, np.flatnonzero(group == number))

    def residuals(self, vectors: Float[np.ndarray, "vectors rows"]) -> Float[np.ndarray, "vectors rows"]:
        """Residuals of a fit of the parameters to each vector."""
        left = np.empty_like(vectors)
        for active, members in self.groups(vectors):
            left[members] = self.projection(active).remove(vectors[members].T).T
        return left
