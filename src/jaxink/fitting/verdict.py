"""The verdict on a fit: whether its residual is what the stated or estimated noise would leave."""

import dataclasses
from collections import Counter

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.display.codes import CodeWithMeaning
from jaxink.fitting.outcome import Outcome
from jaxink.measurement import LEAST_PROBABILITY, SIGMA_TOLERANCE, NoiseLevel
from jaxink.numerics.chi_square import residual_above, residual_below

# Stated standard deviations may include systematic errors; beyond this factor they hide a misfit.
OVERSTATED_FACTOR = 2.0
# A sentence names so many parameters one by one.
_MOST_NAMES = 3


class FitVerdictCode(CodeWithMeaning):
    """Possible verdicts on a fit; the value appears in ``result.json``."""

    CONSISTENT = "consistent", "the residual is consistent with the stated or estimated noise"
    MISFIT = "misfit", "the residual exceeds the noise, and standard errors are meaningless"
    OVERSTATED_NOISE = "overstated_noise", "the residual is far smaller than the noise"
    NOT_CONVERGED = "not_converged", "the search did not end in a minimum"
    NOT_JUDGED = (
        "not_judged",
        "the noise is unknown, the objective is not chi-square, there are not more points than parameters, "
        "or the fit stopped at its goal",
    )

    @property
    def needs_warning(self) -> bool:
        """Whether users must be warned of the result; not if nothing contradicts it."""
        return self not in (FitVerdictCode.CONSISTENT, FitVerdictCode.NOT_JUDGED)


@dataclasses.dataclass(frozen=True)
class FitVerdict:
    """The verdict on a fit.

    Parameters
    ----------
    code, sentence
        The verdict and its description.
    reduced_chi_square
        The number that it is based on, of the points of non-zero weight; None if there is none.
    standard_errors_hold
        Whether standard errors mean what they say; they do not if the model does not fit.
    """

    __repr__ = brief_repr

    code: FitVerdictCode
    sentence: str
    reduced_chi_square: float | None
    standard_errors_hold: bool

    @property
    def is_misfit(self) -> bool:
        """Whether the model does not fit the data."""
        return self.code is FitVerdictCode.MISFIT


def exceeds_noise(chi_square: float, degrees_of_freedom: int, noise_freedom: float = np.inf) -> bool:
    """Whether a chi-square is too large for noise whose standard deviation is known to `SIGMA_TOLERANCE`.

    The variance of an estimated noise is uncertain, in addition, by its degrees of freedom.
    """
    improbable = residual_above(chi_square, degrees_of_freedom, noise_freedom) < LEAST_PROBABILITY
    return bool(improbable and chi_square > SIGMA_TOLERANCE**2 * degrees_of_freedom)


def falls_short_of_noise(
    chi_square: float,
    degrees_of_freedom: int,
    factor: float = OVERSTATED_FACTOR,
    noise_freedom: float = np.inf,
) -> bool:
    """Whether a chi-square is so small that standard deviations are overstated by more than a factor."""
    probability = residual_below(chi_square, degrees_of_freedom, noise_freedom)
    return bool(probability < LEAST_PROBABILITY and chi_square * factor**2 < degrees_of_freedom)


def judge_fit(
    outcome: Outcome,
    objective: str,
    whitened: np.ndarray | None,
    n_parameters: int,
    at_bound: tuple[str, ...] = (),
    level: NoiseLevel | None = None,
) -> FitVerdict:
    """Verdict on a fit.

    Parameters
    ----------
    outcome, objective
        How the search ended, and what it minimised.
    whitened
        Residuals, whitened by the noise, of the points that have a weight; None if the noise is unknown.
    n_parameters
        Number of fitted parameters.
    at_bound
        Parameters that ended at a bound of their range.
    level
        Of an estimated noise; None if it is stated.
    """
    reduced, code, doubt = None, FitVerdictCode.NOT_JUDGED, ""
    if whitened is not None and whitened.size > n_parameters:
        # A saved file may hold residuals whose squares are infinite.
        with np.errstate(over="ignore"):
            chi_square, freedom = float(np.sum(whitened**2)), whitened.size - n_parameters
        reduced = chi_square / freedom
        if objective == "chi_square":
            code = _judged(chi_square, freedom, level)
            doubt = level_in_doubt(chi_square, freedom, level)
    if outcome is Outcome.GOAL:
        code = FitVerdictCode.NOT_JUDGED
    elif not outcome.converged:
        code = FitVerdictCode.NOT_CONVERGED
    holds = outcome is not Outcome.GOAL and code not in (FitVerdictCode.MISFIT, FitVerdictCode.NOT_CONVERGED)
    if outcome is Outcome.GOAL:
        known = "" if reduced is None else f" (reduced chi-square there: {reduced:.4g})"
        sentence = f"The misfit is not judged: the fit {outcome.value}{known}."
    elif code is FitVerdictCode.NOT_JUDGED:
        sentence = _why_not_judged(objective, whitened, reduced)
    else:
        sentence = _sentence(code, outcome, reduced, at_bound, level, doubt)
    return FitVerdict(code, sentence, reduced, holds)


def _judged(chi_square: float, freedom: int, level: NoiseLevel | None) -> FitVerdictCode:
    known = np.inf if level is None else level.degrees_of_freedom
    if not np.isfinite(chi_square) or exceeds_noise(chi_square, freedom, known):
        return FitVerdictCode.MISFIT
    if falls_short_of_noise(chi_square, freedom, noise_freedom=known):
        return FitVerdictCode.OVERSTATED_NOISE
    return FitVerdictCode.CONSISTENT


def level_in_doubt(chi_square: float, degrees_of_freedom: int, level: NoiseLevel | None) -> str:
    """That a fit passes only because its noise is not known well; empty if not."""
    if level is None or not exceeds_noise(chi_square, degrees_of_freedom):
        return ""
    p = residual_above(chi_square, degrees_of_freedom, level.degrees_of_freedom)
    return (
        f"Only the noise is in doubt (p = {p:.2g}): if its level were known exactly, and no factor of a scan "
        "were missing, this would be a misfit. State it in column sigma_per_sr or in [noise]."
    )


def _counted(names: tuple[str, ...]) -> str:
    """Parameters by name; of many, their number and at how many wavelengths each has ended so."""
    if len(names) <= _MOST_NAMES:
        return " and ".join(names)
    counts = Counter(name.partition("@")[0] for name in names)
    parts = (f"{stem} at {n} wavelengths" if n > 1 else stem for stem, n in counts.items())
    return f"{len(names)} parameters ({', '.join(parts)})"


def _sentence(
    code: FitVerdictCode,
    outcome: Outcome,
    reduced: float | None,
    at_bound: tuple[str, ...],
    level: NoiseLevel | None,
    doubt: str,
) -> str:
    noise = "stated noise" if level is None else f"estimated noise, {level.text},"
    if code is FitVerdictCode.NOT_CONVERGED:
        return f"The fit {outcome.value}. Its values and standard errors are not a result."
    if code is FitVerdictCode.MISFIT:
        where = f" {_counted(at_bound)} ended at a bound." if at_bound else ""
        return (
            f"The model does not fit: reduced chi-square {reduced:.4g}, where the {noise} gives about 1."
            f"{where} Standard errors are meaningless, and the fitted values may be far off."
        )
    if code is FitVerdictCode.OVERSTATED_NOISE:
        factor = np.inf if not reduced else reduced**-0.5
        remedy = (
            "check the unit of sigma (sigma_per_sr is absolute, in 1/sr)"
            if level is None
            else "readings that must agree differ by more than the points scatter, so check these"
        )
        return (
            f"The {noise} is too large, about {factor:.2g} times: reduced chi-square {reduced:.2g} "
            f"instead of about 1. Standard errors are too large by as much, and a misfit could not be seen; "
            f"{remedy}."
        )
    found = f"The model fits within the {noise.rstrip(',')}: reduced chi-square {reduced:.4g}."
    return f"{found} {doubt}".rstrip()


def _why_not_judged(objective: str, whitened: np.ndarray | None, reduced: float | None) -> str:
    if objective != "chi_square":
        known = "" if reduced is None else f" (reduced chi-square of this solution: {reduced:.4g})"
        return f"The misfit is not judged: the objective '{objective}' is not chi-square{known}."
    if whitened is None:
        return "The misfit is not judged: the noise is unknown."
    return "The misfit is not judged: there are not more points than free parameters."
