"""Candidates fitted with all other parameters, the store of these fits, and standard errors of a fit."""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.display.brief import brief_repr
from jaxink.effects import Effect
from jaxink.fitting import covariance


class Estimate(NamedTuple):
    """Value of a parameter and its standard error; None if unconstrained by the data or at a bound."""

    value: float
    standard_error: float | None


def penalty(effect: Effect, n_points: int) -> float:
    """By how much an effect must lower chi-square: for its terms (Schwarz 1978), and its handicap."""
    return len(effect.terms) * float(np.log(n_points)) + effect.handicap


@dataclasses.dataclass(frozen=True)
class Refit:
    """A candidate fitted with all other parameters.

    Parameters
    ----------
    effect
        The form that fits best.
    solution
        Its fit.
    objective
        The objective of the fit.
    delta_chi_square
        Decrease in chi-square.
    is_polished
        Whether its search has been continued, so that it is as close to a minimum as it needs to be.
    """

    __repr__ = brief_repr

    effect: Effect
    solution: Solution
    objective: CandidateObjective
    delta_chi_square: float
    is_polished: bool = False

    @property
    def strength(self) -> float:
        """Distance of the first term from the declared model."""
        return self.solution.values[self.effect.strength.name] - self.effect.neutral

    def penalised(self, n_points: int) -> float:
        """Decrease in chi-square minus what it must lower it by."""
        return self.delta_chi_square - self.penalty(n_points)

    def penalty(self, n_points: int) -> float:
        """By how much its effect must lower chi-square; see the function `penalty`."""
        return penalty(self.effect, n_points)

    def is_like(self, other: "Refit", n_points: int, class_delta_chi_square: float) -> bool:
        """Whether the data cannot distinguish two candidates, with or without the penalty for terms.

        A candidate with more terms that fits equally well is not preferred, but not refuted either.
        """
        paid = self.penalised(n_points) - other.penalised(n_points)
        return bool(
            min(abs(paid), abs(self.delta_chi_square - other.delta_chi_square)) < class_delta_chi_square
        )

    def estimates(self) -> dict[str, Estimate]:
        """Estimates of its free parameters."""
        return estimates(self.objective, self.solution)


class Refits:
    """The refits of a screen: of each form that has been fitted, the one to be compared with others.

    Parameters
    ----------
    n_rows
        Number of rows of the residual, by which a form pays for its terms.
    """

    def __init__(self, n_rows: int):
        self._n_rows = n_rows
        self._by_form: dict[Effect, Refit] = {}

    def keep(self, refit: Refit) -> None:
        """Store a refit, in place of an earlier one of the same form."""
        self._by_form[refit.effect] = refit

    def of(self, form: Effect) -> Refit | None:
        """Refit of a form; None if it has not been fitted."""
        return self._by_form.get(form)

    @property
    def best(self) -> dict[str, Refit]:
        """Of each effect that has been fitted, the form that fits best after the penalty for its terms."""
        found: dict[str, Refit] = {}
        # A copy: threads may be adding others.
        for refit in list(self._by_form.values()):
            other = found.get(refit.effect.name)
            if other is None or refit.penalised(self._n_rows) > other.penalised(self._n_rows):
                found[refit.effect.name] = refit
        return found


def estimates(objective: CandidateObjective, solution: Solution) -> dict[str, Estimate]:
    """Each free parameter of a solution with its standard error."""
    n = len(solution.free)
    search, end = solution.search, solution.search.derivatives
    spread = covariance(end.triangle[:, :n], search.unit[:n], end.gradient[:n])
    spread = spread.for_noise_of(objective.noise_freedom)
    slope = objective.scale_of(solution.free).slope(search.unit[:n])
    sigma = np.where(spread.held, np.nan, spread.deviation * np.abs(slope)).tolist()
    return {
        name: Estimate(solution.values[name], finite(error))
        for name, error in zip(solution.free, sigma, strict=True)
    }


def finite(error: float) -> float | None:
    """A standard error as in reports: None if it is not finite."""
    return error if np.isfinite(error) else None
