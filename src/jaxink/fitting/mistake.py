"""Mistakes in the input of a fit: a hypothesis, its refit, and how its residual is judged."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from jaxink.fitting.hypotheses import Hypothesis
from jaxink.fitting.objective import Objective
from jaxink.fitting.verdict import exceeds_noise, falls_short_of_noise
from jaxink.measurement import SIGMA_TOLERANCE, GonioData

# Statements say what the input reads like; of a rejected one, only what was supposed may be said.
_SUPPOSED = {
    " reads as if it were ": " is ",
    " read as if they were ": " are ",
    " reads as if it had been ": " has been ",
    " reads like ": " is ",
    " read like ": " are ",
}
# Neighbouring residuals that are correlated by this many standard errors are a misfit, not noise.
_ORDERED = 4.0


@dataclasses.dataclass(frozen=True)
class Mistake:
    """A mistake in the input, as a hypothesis that was tested by one refit of the corrected input.

    Parameters
    ----------
    name
        Key of the hypothesis.
    statement, remedy
        What the input reads like, and what would be right.
    reduced_chi_square, delta_chi_square
        After the refit, and the decrease in chi-square; None if no refit is needed to tell.
    is_named
        Whether the data say that the mistake was made.
    """

    name: str
    statement: str
    remedy: str
    reduced_chi_square: float | None
    delta_chi_square: float | None
    is_named: bool

    @property
    def needs_no_refit(self) -> bool:
        """Whether the data alone tell."""
        return self.reduced_chi_square is None

    @property
    def supposition(self) -> str:
        """What was supposed, without the claim of the statement that the input reads like it."""
        words = self.statement
        for claimed, supposed in _SUPPOSED.items():
            words = words.replace(claimed, supposed)
        return words

    def sentence(self, before: float | None) -> str:
        """Description, given the reduced chi-square of the input as it is."""
        change = ""
        if self.reduced_chi_square is not None and before is not None:
            change = f": reduced chi-square {before:.4g} -> {self.reduced_chi_square:.3g} after one refit"
        return f"{self.statement}{change}. If so, {self.remedy}."


def rejected(mistakes: Sequence[Mistake]) -> list[Mistake]:
    """The mistakes that were tried by a refit and that the data do not name."""
    return [mistake for mistake in mistakes if not mistake.is_named and not mistake.needs_no_refit]


def rejection(mistakes: Sequence[Mistake], before: float | None, *, is_misfit: bool) -> str:
    """What became of the mistakes that are rejected, given the reduced chi-square of the input as it is."""
    words = "Each was tested by one refit of the input corrected for it, and rejected."
    if not is_misfit or any(mistake.is_named for mistake in mistakes):
        return words
    as_is = "" if before is None else f", whose reduced chi-square is {before:.4g}"
    return f"{words} None of them explains the misfit of the input as it is{as_is}."


def mistakes_sentence(mistakes: tuple[Mistake, ...], before: float | None) -> str:
    """What the named mistakes read like; empty if there are none."""
    named = [mistake for mistake in mistakes if mistake.is_named]
    if not named:
        return ""
    refitted = [mistake for mistake in named if not mistake.needs_no_refit]
    # A mistake that a refit confirms also says what to do about what the data alone tell.
    said = [f"{mistake.statement}." for mistake in named if mistake.needs_no_refit]
    said.append(" Or: ".join(mistake.sentence(before) for mistake in refitted or named))
    if len(refitted) > 1:
        said.append("These data cannot tell these mistakes apart.")
    return " ".join(
        [*(said if refitted else said[-1:]), "Nothing was changed: correct the input and fit again."]
    )


@dataclasses.dataclass(frozen=True)
class RefittedHypothesis:
    """A hypothesis after its refit.

    Parameters
    ----------
    hypothesis
        The hypothesis.
    chi_square, freedom
        Chi-square and degrees of freedom of the corrected input.
    left
        What is left of the excess of reduced chi-square over 1, as a share.
    is_possible
        Whether the data speak for it at all, however good the refit is.
    is_ordered
        Whether neighbouring residuals are correlated.
    log_determinant
        Of the noise covariance, in units of the independent variances.
    noise_freedom
        Degrees of freedom of an estimated noise.
    """

    hypothesis: Hypothesis
    chi_square: float
    freedom: int
    left: float
    is_possible: bool
    is_ordered: bool
    log_determinant: float
    noise_freedom: float = np.inf

    @property
    def reduced(self) -> float:
        """Reduced chi-square."""
        return self.chi_square / self.freedom

    @property
    def is_noise(self) -> bool:
        """Whether the rest is what the noise leaves, neither more nor less."""
        known = self.noise_freedom
        below = falls_short_of_noise(self.chi_square, self.freedom, SIGMA_TOLERANCE, known)
        return not (below or exceeds_noise(self.chi_square, self.freedom, known))


def log_determinant(objective: Objective, predicted: np.ndarray) -> float:
    """Logarithm of the determinant of the noise covariance in units of the independent variances."""
    common = objective.scan_relative * predicted / objective.sigma
    return float(np.sum(np.log1p(np.bincount(objective.scan, weights=common**2))))


def is_ordered(data: GonioData, whitened: np.ndarray, weighted: np.ndarray) -> bool:
    """Whether weighted residuals of neighbouring angles of view in a scan are correlated."""
    used = np.flatnonzero(data.used)[weighted]
    towards_peak = np.where(np.abs(data.phi_deg[used]) > 90, 1.0, -1.0)
    order = np.lexsort((towards_peak * data.theta_o_deg[used], data.scan_index[used]))
    residual, scan = whitened[weighted][order], data.scan_index[used][order]
    same = scan[1:] == scan[:-1]
    power = float(np.sum(residual**2))
    if not same.any() or not power > 0:
        return False
    correlation = float(np.sum((residual[1:] * residual[:-1])[same])) / power
    return bool(correlation * np.sqrt(np.sum(same)) > _ORDERED)
