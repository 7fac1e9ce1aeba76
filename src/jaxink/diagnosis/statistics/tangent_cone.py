"""Small changes of the prediction that the parameters of a fit can make.

Around a minimum the parameters span a linear space; one that sits on a bound of its range can move only
inwards, which makes the space a cone. Everything here is in whitened units: noise has unit covariance.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.errors import InputRefusedError

# All subsets of the parameters on a bound are tried: 4096 of 12.
_MOST_EDGES = 12
# A pull on a parameter on its bound below this many root mean squares of the residual is convergence.
_PULL = 1e-2


def cone_coefficients(
    scores: Float[np.ndarray, "vectors columns"], gram: Float[np.ndarray, "columns columns"]
) -> Float[np.ndarray, "vectors columns"]:
    """Least squares with coefficients a >= 0, for many vectors at once.

    The solution is the best of the plain least squares of all subsets of columns whose coefficients are
    positive. There are few columns, and each subset is one small product for all vectors together.

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
            f"{columns} parameters sit on a bound; at most {_MOST_EDGES} can be treated: hold some fixed."
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
    """Vectors that the same edges are active for: which edges, and the index of the vectors."""

    active: Bool[np.ndarray, " edges"]
    members: Int[np.ndarray, " vectors"] | slice


@dataclass(frozen=True)
class TangentCone:
    """Small changes of the prediction that the parameters can make.

    Parameters
    ----------
    basis
        Orthonormal basis of the parameters that are free to move both ways.
    edges
        What is left, without the basis, of each parameter on a bound: norm 1, pointing into its range.

    References
    ----------
    Chernoff 1954 Ann. Math. Stat. 25, 573; Self, Liang 1987 JASA 82, 605.
    """

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
            Derivatives of the whitened prediction by the parameters.
        at_bound
            -1 where a parameter sits on its lower bound or cannot be told from it (within about one
            standard error), +1 on its upper, 0 inside; None for none on a bound.

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
        """How many parameters on a bound matter."""
        return self.edges.shape[1]

    def projection(self, active: Bool[np.ndarray, " edges"]) -> Projection:
        """Projection off the basis and some of the edges.

        Parameters
        ----------
        active
            The edges that count as free.
        """
        if not active.any():
            return Projection(self.basis)
        return Projection(np.hstack([self.basis, orthonormal_range(self.edges[:, active])]))

    def active(self, vectors: Float[np.ndarray, "vectors rows"]) -> Bool[np.ndarray, "vectors edges"]:
        """Edges that a residual does not push against.

        Parameters
        ----------
        vectors
            Whitened residuals, fitted or not.

        Returns
        -------
        Bool[np.ndarray, "vectors edges"]
            False where the misfit pulls a parameter out of its range: its column is not free. True also
            where it pulls neither way, as it does inside the range.
        """
        pull = np.abs(vectors @ self.edges)
        size = np.sqrt(np.mean(vectors**2, axis=1, keepdims=True))
        # The basis has taken its part.
        coefficients = cone_coefficients(vectors @ self.edges, self.edges.T @ self.edges)
        return (coefficients > 0) | (pull <= _PULL * size)

    def groups(self, vectors: Float[np.ndarray, "vectors rows"]) -> Iterator[Group]:
        """Vectors of the same active edges.

        Parameters
        ----------
        vectors
            Noise.
        """
        if self.n_edges == 0:
            yield Group(np.zeros(0, bool), slice(None))
            return
        patterns, group = np.unique(self.active(vectors), axis=0, return_inverse=True)
        group = group.reshape(-1)
        for number, active in enumerate(patterns):
            yield Group(active, np.flatnonzero(group == number))

    def residuals(self, vectors: Float[np.ndarray, "vectors rows"]) -> Float[np.ndarray, "vectors rows"]:
        """What a fit of the parameters leaves of each vector.

        Parameters
        ----------
        vectors
            Noise.
        """
        left = np.empty_like(vectors)
        for active, members in self.groups(vectors):
            left[members] = self.projection(active).remove(vectors[members].T).T
        return left
