"""Significance of each candidate of a screen, and of the best one.

Candidates with different null laws are compared by their own p; one bootstrap for all gives the probability
that the best of them passes a threshold (Westfall-Young).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr, ndtri, stdtr, stdtrit

from jaxink.diagnosis.statistics.candidate import Candidate
from jaxink.diagnosis.statistics.null_law import NullLaw, admissible, tree_links


@dataclass(frozen=True)
class Significance:
    """Null laws and thresholds of all candidates.

    Parameters
    ----------
    laws
        Of the testable candidates, by position.
    critical_z
        |z| at which each is detected; nan if not testable.
    smallest_p
        Smallest p of all candidates in each null data set, ascending.
    noise_freedom
        Degrees of freedom of an estimated noise: scores then follow Student's t, and are replaced by the
        normal deviates of equal probability.
    """

    laws: dict[int, NullLaw]
    critical_z: tuple[float, ...]
    smallest_p: Float[np.ndarray, " draws"]
    noise_freedom: float = np.inf

    @classmethod
    def of(
        cls,
        scores: Float[np.ndarray, "draws columns"],
        slices: Sequence[slice],
        candidates: Sequence[Candidate],
        correlation: Float[np.ndarray, "columns columns"],
        level: float,
        is_exact: bool,
        noise_freedom: float = np.inf,
    ) -> "Significance":
        """Laws from the scores of null data sets along the columns of all candidates.

        The correlation of the columns has 0 on the diagonal for untestable ones; `is_exact` means that no
        parameter is at a bound, so that a single column needs no draws.
        """
        laws: dict[int, NullLaw] = {}
        smallest = np.ones(len(scores))
        for position, (candidate, part) in enumerate(zip(candidates, slices, strict=True)):
            kept = np.flatnonzero(np.diag(correlation)[part] > 0) + part.start
            if kept.size == 0:
                continue
            statistic = best_admissible(scores[:, kept], candidate.sign)
            links = tree_links(correlation[np.ix_(kept, kept)], candidate.sign)
            draws = np.zeros(0) if is_exact and kept.size == 1 else np.sort(statistic)
            laws[position] = NullLaw(candidate.sign, links, draws)
            smallest = np.minimum(smallest, laws[position].p_value(statistic))
        smallest = np.sort(smallest)
        count = int(np.floor(level * (smallest.size + 1)))
        threshold = float(smallest[count - 1])
        critical = tuple(
            _student(laws[k].critical(threshold), noise_freedom) if k in laws else np.nan
            for k in range(len(candidates))
        )
        return cls(laws, critical, smallest, noise_freedom)

    def adjusted(self, p: Float[np.ndarray, "*shape"] | float) -> Float[np.ndarray, "*shape"] | float:
        """Family-wise adjusted p: probability that any candidate has a p this small if none is present."""
        as_small = np.searchsorted(self.smallest_p, p, side="right")
        return (1 + as_small) / (self.smallest_p.size + 1)

    def p_raw(self, position: int, z: float) -> float:
        """Probability that noise alone gives the candidate at a position a score this large."""
        law = self.laws[position]
        oriented = max(float(admissible(z, law.sign)), 0.0)
        return float(self.p_values(law, np.array(oriented**2)))

    def p_values(
        self, law: NullLaw, statistic: Float[np.ndarray, "*shape"]
    ) -> Float[np.ndarray, "*shape"] | float:
        """Probabilities of best admissible scores, squared, of one candidate."""
        if np.isfinite(self.noise_freedom):
            statistic = ndtri(stdtr(self.noise_freedom, -np.sqrt(statistic))) ** 2
        return law.p_value(statistic)


def _student(z: float, freedom: float) -> float:
    """The deviate of Student's t whose probability is that of a normal one."""
    return float(-stdtrit(freedom, ndtr(-z))) if np.isfinite(freedom) else z


def best_admissible(scores: Float[np.ndarray, "sets columns"], sign: int) -> Float[np.ndarray, " sets"]:
    """T of each row: the best admissible score, squared."""
    return np.maximum(admissible(scores, sign).max(axis=1), 0.0) ** 2
