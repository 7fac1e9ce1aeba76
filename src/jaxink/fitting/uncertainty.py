"""Standard errors, correlations and profiles."""

import dataclasses

import numpy as np
from scipy.special import ndtr, stdtrit

from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.outcome import Search

# Below this share of the largest singular value of the scaled Jacobian, errors are unknown, not just large.
_UNKNOWN = 1e-9
# A profile follows chi-square up to this increase: two standard errors.
_RISE = 4.0
_STEPS_EACH_WAY = 7


@dataclasses.dataclass(frozen=True)
class Covariance:
    """Covariance of the free parameters in the unit variables.

    Parameters
    ----------
    matrix
        Shape ``(parameters, parameters)``; infinite on the diagonal for a parameter that the data do not
        constrain, 0 for one held by its bound.
    held
        True for a parameter at a bound with the gradient pointing outward.
    """

    matrix: np.ndarray
    held: np.ndarray

    def for_noise_of(self, degrees_of_freedom: float) -> "Covariance":
        """The covariance whose standard errors cover 68.3 % if the noise is an estimate: Student's t."""
        if not np.isfinite(degrees_of_freedom):
            return self
        return dataclasses.replace(self, matrix=self.matrix * stdtrit(degrees_of_freedom, ndtr(1.0)) ** 2)

    @property
    def deviation(self) -> np.ndarray:
        """Standard errors in the unit variables."""
        return np.sqrt(np.diag(self.matrix))

    @property
    def correlation(self) -> np.ndarray:
        """Correlations; nan for a parameter without a finite, positive standard error."""
        deviation = self.deviation
        good = np.isfinite(deviation) & (deviation > 0)
        scale = np.where(good, deviation, np.nan)
        return self.matrix / (scale[:, None] * scale[None, :])


def covariance(triangle: np.ndarray, unit: np.ndarray, gradient: np.ndarray) -> Covariance:
    """Covariance (J^T J)^-1 of the parameters that are not held by a bound.

    Parameters
    ----------
    triangle
        R of the QR factorisation of the Jacobian of residuals in sigma.
    unit
        The minimum.
    gradient
        J^T r there.
    """
    n = len(unit)
    held = ((unit <= 0) & (gradient > 0)) | ((unit >= 1) & (gradient < 0))
    free = ~held
    matrix = np.zeros((n, n))
    if not np.all(np.isfinite(triangle)):
        # Without derivatives all of them are unknown.
        matrix[free, free] = np.inf
    elif free.any():
        reduced = triangle[:, free]
        norms = np.linalg.norm(reduced, axis=0)
        norms = np.where(norms > 0, norms, 1.0)
        _, singular, right = np.linalg.svd(reduced / norms)
        known = singular > _UNKNOWN * singular[0]
        inverse = np.where(known, 1 / np.where(known, singular, 1.0), 0.0)
        root = right.T * inverse / norms[:, None]
        block = root @ root.T
        # A direction without information makes every parameter that contributes to it unknown.
        open_share = np.sum(right[~known] ** 2, axis=0)
        unknown = open_share > 1e-6
        block[unknown, :] = block[:, unknown] = 0.0
        block[unknown, unknown] = np.inf
        matrix[np.ix_(free, free)] = block
    return Covariance(matrix, held)


@dataclasses.dataclass(frozen=True)
class Profile:
    """Chi-square along one parameter, with all others refitted at each value.

    Parameters
    ----------
    position
        Index of the parameter.
    unit
        Its values in the unit variable, ascending.
    rise
        Increase in chi-square above the minimum at each.
    lower, upper
        Ends of the interval in which it increases by less than 1, in the unit variable.
    open_below, open_above
        True if the end of the range was reached first.
    searches
        Fits of the others, in the order in which they were made.
    """

    position: int
    unit: np.ndarray
    rise: np.ndarray
    lower: float
    upper: float
    open_below: bool
    open_above: bool
    searches: tuple[Search, ...]

    @property
    def determined(self) -> bool:
        """Whether the interval is closed on both sides."""
        return not (self.open_below or self.open_above)


def profile(search: GradientSearch, best: Search, position: int, deviation: float) -> Profile:
    """Follow chi-square along one parameter in both directions.

    Parameters
    ----------
    search
        The compiled search; no further compilation is needed.
    best
        The minimum.
    position
        Index of the parameter.
    deviation
        Its standard error in the unit variable; sets the first step.

    References
    ----------
    Venzon, Moolgavkar 1988 Appl. Stat. 37, 87.
    """
    centre = float(best.unit[position])
    samples, searches = {centre: 0.0}, []
    for direction in (-1.0, 1.0):
        room = centre if direction < 0 else 1 - centre
        step = deviation if np.isfinite(deviation) and deviation > 0 else 0.02
        step = min(max(step, 1e-4), room)
        start, at = best.unit, centre
        for _ in range(_STEPS_EACH_WAY):
            if room <= 0:
                break
            at = float(np.clip(centre + direction * min(step, room), 0.0, 1.0))
            found = search.run(start, held={position: at})
            searches.append(found)
            if not np.isfinite(found.loss):
                break
            samples[at] = found.loss - best.loss
            if samples[at] > _RISE or step >= room:
                break
            start = found.unit
            # Chi-square increases roughly quadratically: aim at the next integer standard error.
            step *= 2.0 if samples[at] < 1.0 else 1.5
    unit = np.array(sorted(samples))
    rise = np.array([samples[u] for u in unit])
    lower, open_below = _crossing(unit, rise, centre, -1)
    upper, open_above = _crossing(unit, rise, centre, 1)
    return Profile(position, unit, rise, lower, upper, open_below, open_above, tuple(searches))


def _crossing(unit, rise, centre, direction):
    """Where the root of the increase passes 1 on one side; the end of the range if it does not."""
    side = unit >= centre if direction > 0 else unit <= centre
    u, root = unit[side], np.sqrt(np.maximum(rise[side], 0.0))
    if direction < 0:
        u, root = u[::-1], root[::-1]
    for i in range(1, len(u)):
        if root[i] >= 1:
            share = (1 - root[i - 1]) / (root[i] - root[i - 1])
            return float(u[i - 1] + share * (u[i] - u[i - 1])), False
    return (1.0 if direction > 0 else 0.0), True
