"""A candidate fitted with all other parameters, and standard errors of a fit."""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.search.workbench import Solution, Workbench
from jaxink.effects import Effect
from jaxink.fitting.uncertainty import covariance


class Estimate(NamedTuple):
    """Value of a parameter and its standard error; None where the data say nothing or a bound holds it."""

    value: float
    standard_error: float | None


@dataclasses.dataclass(frozen=True)
class Refit:
    """A candidate fitted with all other parameters.

    Parameters
    ----------
    effect
        The form that fits best.
    solution
        Where it ended.
    bench
        The workbench that it was fitted on.
    drop
        Fall of chi-square.
    """

    effect: Effect
    solution: Solution
    bench: Workbench
    drop: float

    @property
    def strength(self) -> float:
        """Strength: distance of the first term from the declared model."""
        return self.solution.values[self.effect.strength.name] - self.effect.neutral

    def penalised(self, n_points: int) -> float:
        """Fall of chi-square less what its number of terms costs (Schwarz 1978)."""
        return self.drop - len(self.effect.terms) * np.log(n_points)

    def is_like(self, other: "Refit", n_points: int, told_apart: float) -> bool:
        """Whether the data do not tell two candidates apart, their terms being paid for or not.

        One of more terms that fits as well is not preferred, but neither is it refuted.
        """
        paid = self.penalised(n_points) - other.penalised(n_points)
        return bool(min(abs(paid), abs(self.drop - other.drop)) < told_apart)

    def estimates(self) -> dict[str, Estimate]:
        """Of its free parameters."""
        return estimates(self.bench, self.solution)


def estimates(bench: Workbench, solution: Solution) -> dict[str, Estimate]:
    """Each free parameter of a solution with its standard error."""
    n = len(solution.free)
    search = solution.search
    spread = covariance(search.triangle[:, :n], search.unit[:n], search.gradient[:n])
    slope = bench.scale_of(solution.free).slope(search.unit[:n])
    sigma = np.where(spread.held, np.nan, spread.deviation * np.abs(slope)).tolist()
    return {
        name: Estimate(solution.values[name], finite(error))
        for name, error in zip(solution.free, sigma, strict=True)
    }


def finite(error: float) -> float | None:
    """A standard error as reports have it: None where the data say nothing or a bound holds the value."""
    return error if np.isfinite(error) else None
