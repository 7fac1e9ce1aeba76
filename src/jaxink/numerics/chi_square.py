"""Probability of a chi-square in noise whose variance is known exactly or estimated."""

import numpy as np
from jaxtyping import Float
from scipy.special import chdtr, chdtrc, fdtr, fdtrc


def probability_above(
    chi_square: Float[np.ndarray, "*shape"] | float, degrees_of_freedom: float, noise_freedom: float = np.inf
) -> Float[np.ndarray, "*shape"] | float:
    """Probability that noise alone gives a chi-square at least as large.

    Noise whose variance is an independent estimate of so many degrees of freedom follows Fisher's F
    distribution.
    """
    if not np.isfinite(noise_freedom):
        return chdtrc(degrees_of_freedom, chi_square)
    return fdtrc(degrees_of_freedom, noise_freedom, chi_square / degrees_of_freedom)


def residual_above(
    chi_square: Float[np.ndarray, "*shape"] | float, degrees_of_freedom: float, noise_freedom: float = np.inf
) -> Float[np.ndarray, "*shape"] | float:
    """As `probability_above`, for all the residuals of the points from which the noise was estimated.

    What the estimate is made of, the pure error, is part of their chi-square and equals its degrees of
    freedom; the rest, the lack of fit, follows Fisher's F distribution.

    References
    ----------
    Draper, Smith 1998 Applied Regression Analysis, 3rd ed., sect. 2.1.
    """
    rest = degrees_of_freedom - noise_freedom
    if not 0 < rest < np.inf:
        return probability_above(chi_square, degrees_of_freedom, noise_freedom)
    return fdtrc(rest, noise_freedom, np.maximum(chi_square - noise_freedom, 0.0) / rest)


def residual_below(chi_square: float, degrees_of_freedom: float, noise_freedom: float = np.inf) -> float:
    """Probability that noise alone gives a chi-square no larger, see `residual_above`."""
    if not np.isfinite(noise_freedom):
        return chdtr(degrees_of_freedom, chi_square)
    rest = degrees_of_freedom - noise_freedom
    if rest <= 0:
        return fdtr(degrees_of_freedom, noise_freedom, chi_square / degrees_of_freedom)
    return fdtr(rest, noise_freedom, max(chi_square - noise_freedom, 0.0) / rest)
