"""What the free parameters of a fit can imitate, and what is left of a direction without it.

Around a minimum the parameters span a linear space; one that sits on a bound of its range can move only
inwards, which makes the space a cone. Everything here is in whitened units: noise has unit covariance.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.errors import InputRefusedError

# Directions of the scaled Jacobian weaker than this against the strongest are rounding, not parameters.
_RANK = 1e-9
# A direction of which less than this is left after the projection is imitated to rounding.
ABSORBED = 1e-6
# All subsets of the parameters on a bound are tried: 4096 of 12.
_MOST_EDGES = 12
# A pull on a parameter on its bound below this many root mean squares of the residual is convergence.
_PULL = 1e-2


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

    def unit(
        self, columns: Float[np.ndarray, "rows columns"]
    ) -> tuple[Float[np.ndarray, "rows columns"], Float[np.ndarray, " columns"]]:
        """What is left of each column, scaled to norm 1, and the norm it had.

        Parameters
        ----------
        columns
            Directions.

        Returns
        -------
        unit, norm
            Both 0 where all but rounding is imitated.
        """
        rest = self.remove(columns)
        # A second pass removes what rounding left of a long column that is nearly all in the space.
        rest = self.remove(rest)
        norm = np.linalg.norm(rest, axis=0)
        norm = np.where(norm > ABSORBED * np.linalg.norm(columns, axis=0), norm, 0.0)
        return np.where(norm > 0, rest / np.where(norm > 0, norm, 1.0), 0.0), norm


@dataclass(frozen=True)
class ConeFit:
    """Fits of several vectors by columns with coefficients that are not negative.

    Parameters
    ----------
    coefficients
        One row for each vector.
    drop
        By how much each squared norm falls.
    """

    coefficients: Float[np.ndarray, "vectors columns"]
    drop: Float[np.ndarray, " vectors"]

    @property
    def active(self) -> Bool[np.ndarray, "vectors columns"]:
        """Where a coefficient is positive."""
        return self.coefficients > 0


def cone_fit(scores: Float[np.ndarray, "vectors columns"], gram: Float[np.ndarray, "columns columns"]):
    """Least squares with coefficients a >= 0, for many vectors at once.

    The solution is the best of the plain least squares of all subsets of columns whose coefficients are
    positive. There are few columns, and each subset is one small product for all vectors together.

    Parameters
    ----------
    scores
        W^T v of each vector v.
    gram
        W^T W; columns of norm 1.

    Returns
    -------
    ConeFit

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
    return ConeFit(coefficients, best)


@dataclass(frozen=True)
class TangentCone:
    """Small changes of the prediction that the parameters can make.

    Parameters
    ----------
    basis
        Orthonormal basis of the parameters that are free to move both ways.
    edges
        What is left, without the basis, of each parameter on a bound: norm 1, pointing into its range.
    parameter
        Which parameter each edge belongs to.
    bounded
        True for every parameter on a bound, also where the others imitate it and it has no edge.

    References
    ----------
    Chernoff 1954 Ann. Math. Stat. 25, 573; Self, Liang 1987 JASA 82, 605.
    """

    basis: Float[np.ndarray, "rows rank"]
    edges: Float[np.ndarray, "rows edges"]
    parameter: Int[np.ndarray, " edges"]
    bounded: Bool[np.ndarray, " parameters"]

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
        parameter = np.flatnonzero(bound)
        edges, norm = Projection(basis).unit(-bound[parameter] * jacobian[:, parameter])
        return cls(basis, edges[:, norm > 0], parameter[norm > 0], bound != 0)

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

    def fit(self, vectors: Float[np.ndarray, "vectors rows"]) -> ConeFit:
        """Least squares of each vector by the edges, the basis having taken its part.

        Parameters
        ----------
        vectors
            Residuals.
        """
        return cone_fit(vectors @ self.edges, self.edges.T @ self.edges)

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
        return self.fit(vectors).active | (pull <= _PULL * size)

    def groups(
        self, vectors: Float[np.ndarray, "vectors rows"]
    ) -> Iterator[tuple[np.ndarray, np.ndarray | slice]]:
        """Vectors of the same active edges.

        Parameters
        ----------
        vectors
            Noise.

        Yields
        ------
        active, members
            Which edges, as `projection` takes them, and the index of the vectors.
        """
        if self.n_edges == 0:
            yield np.zeros(0, bool), slice(None)
            return
        patterns, group = np.unique(self.active(vectors), axis=0, return_inverse=True)
        group = group.reshape(-1)
        for number, active in enumerate(patterns):
            yield active, np.flatnonzero(group == number)

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
