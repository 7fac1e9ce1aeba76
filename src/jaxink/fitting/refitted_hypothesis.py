"""A hypothesis about the input after its refit, and how its residual is judged."""

import dataclasses

import numpy as np

from jaxink.fitting.hypotheses import Hypothesis
from jaxink.fitting.objective import Objective
from jaxink.fitting.verdict import exceeds_noise, falls_short_of_noise
from jaxink.measurement import GonioData
from jaxink.measurement.point_noise import SIGMA_TOLERANCE

# Neighbouring residuals that are correlated by this many standard errors are a misfit, not noise.
_ORDERED = 4.0


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
