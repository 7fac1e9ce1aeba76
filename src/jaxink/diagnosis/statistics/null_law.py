"""Null law of the best score of a candidate over its inner values.

The bootstrap is used as far as it resolves. Beyond, where the threshold for fifty candidates lies and few
draws remain, the tail of the maximum over an inner grid is continued by the bound of Hunter and Worsley,
which is sharp there for smooth grids.
"""

from dataclasses import dataclass
from typing import NamedTuple, overload

import numpy as np
from jaxtyping import Float
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.special import ndtr, ndtri, owens_t

# Below this p the bound takes over: 100 of 2000 draws are beyond it, which gives p to 10 %.
_JUNCTION = 0.05


def maximum_tail(
    critical: Float[np.ndarray, "*shape"] | float, links: Float[np.ndarray, " links"], sign: int
) -> Float[np.ndarray, "*shape"] | float:
    """Upper bound on the probability that the largest of correlated normal deviates exceeds c.

    It is P(Z_1 > c) + sum over the links of P(Z_j > c, Z_i <= c), by Owen's function T; at most 1.

    Parameters
    ----------
    critical
        The value c, positive.
    links
        Correlations along a tree that connects all deviates; empty for a single one, for which it is exact.
    sign
        0 for the largest absolute value, otherwise the largest value.

    References
    ----------
    Hunter 1976 J. Appl. Prob. 13, 597; Worsley 1982 Biometrika 69, 297; Owen 1956 Ann. Math. Stat. 27, 1075.
    """
    c = np.asarray(critical, float)[..., None]
    slope = np.sqrt(np.maximum(1 - links, 0.0) / np.maximum(1 + links, 1e-300))
    alone = ndtr(-c[..., 0])
    if sign != 0:
        total = alone + np.sum(2 * owens_t(c, slope), axis=-1)
    else:
        inverse = 1 / np.maximum(slope, 1e-150)
        new = 4 * (owens_t(c, slope) + owens_t(c, inverse)) - 2 * ndtr(-c)
        total = 2 * alone + np.sum(np.maximum(new, 0.0), axis=-1)
    return np.minimum(total, 1.0)


def tree_links(correlation: Float[np.ndarray, "inner inner"], sign: int) -> Float[np.ndarray, " links"]:
    """Correlations along the tree that minimises `maximum_tail`, from those of one candidate's deviates."""
    strength = np.clip(correlation if sign != 0 else np.abs(correlation), -1.0, 1.0)
    # scipy takes a distance of exactly 0 as no link.
    tree = minimum_spanning_tree(1 - strength + 1e-9)
    return 1 - (tree.data - 1e-9)


class _Junction(NamedTuple):
    """The statistic above which the bound is used, and the factor that makes it continuous there."""

    statistic: float
    factor: float


@dataclass(frozen=True)
class NullLaw:
    """Law of T, the largest squared admissible score over the inner values, if the effect is absent.

    Parameters
    ----------
    sign
        +1 or -1 if the strength has one sign, 0 otherwise.
    links
        See `tree_links`.
    draws
        T of the bootstrap, ascending; empty if the law is exact (one inner value, no parameter at a bound):
        the mixture 0.5 chi2_0 + 0.5 chi2_1 for one sign, chi2_1 for both.

    References
    ----------
    Chernoff 1954 Ann. Math. Stat. 25, 573; Davies 1987 Biometrika 74, 33.
    """

    sign: int
    links: Float[np.ndarray, " links"]
    draws: Float[np.ndarray, " draws"]

    @property
    def _junction(self) -> _Junction:
        """Where the bound takes over from the draws."""
        count = int(np.ceil(_JUNCTION * (self.draws.size + 1)))
        at = self.draws[-count] if 0 < count <= self.draws.size else 0.0
        if at <= 0:
            return _Junction(0.0, 1.0)
        share = (1 + count) / (self.draws.size + 1)
        return _Junction(float(at), share / float(maximum_tail(np.sqrt(at), self.links, self.sign)))

    def p_value(self, statistic: Float[np.ndarray, "*shape"] | float) -> Float[np.ndarray, "*shape"] | float:
        """Probability of a statistic T at least this large; 1 at T = 0."""
        statistic = np.asarray(statistic, float)
        junction, factor = self._junction
        p = np.ones(statistic.shape)
        beyond = statistic > junction
        p[beyond] = factor * maximum_tail(np.sqrt(statistic[beyond]), self.links, self.sign)
        if junction > 0:
            inside = (statistic > 0) & ~beyond
            as_large = self.draws.size - np.searchsorted(self.draws, statistic[inside], side="left")
            p[inside] = (1 + as_large) / (self.draws.size + 1)
        return np.minimum(p, 1.0)

    def critical(self, p: float) -> float:
        """The score |z| with probability p, between 0 and 0.5."""
        if self.links.size == 0 and self.draws.size == 0:
            return float(-ndtri(p if self.sign != 0 else p / 2))
        junction, factor = self._junction
        at_junction = factor * maximum_tail(np.sqrt(junction), self.links, self.sign)
        if junction > 0 and p >= at_junction:
            count = min(max(int(p * (self.draws.size + 1)), 1), self.draws.size)
            return float(np.sqrt(self.draws[-count]))
        if p >= at_junction:
            return 0.0
        # Not before: a fit imports this module, but finds no root.
        from scipy.optimize import brentq

        low = np.sqrt(junction)
        return float(
            brentq(lambda c: factor * maximum_tail(c, self.links, self.sign) - p, low, low + 40, xtol=1e-10)
        )


@overload
def admissible(scores: Float[np.ndarray, "*shape"], sign: int) -> Float[np.ndarray, "*shape"]: ...
@overload
def admissible(scores: float, sign: int) -> float: ...
def admissible(scores: Float[np.ndarray, "*shape"] | float, sign: int) -> Float[np.ndarray, "*shape"] | float:
    """Scores z, positive in the direction that the strength may take; absolute values if it may take both."""
    return np.abs(scores) if sign == 0 else sign * scores
