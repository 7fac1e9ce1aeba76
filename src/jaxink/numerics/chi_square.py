"""Probability of a chi-square in noise whose variance is known exactly or estimated."""

import numpy as np
from jaxtyping import Float
from scipy.special import chdtr, chdtrc, fdtr, fdtrc


def probability_above(
    chi_square: Float[np.ndarray, "*shape"] | float, degrees_of_freedom: float, noise_freedom: float = np.inf
) -> Float[np.ndarray, "*shape"] | float:
    """Probability that noise alone gives a chi-square at least as large.

    Noise whose variance is an estimate of so many degrees of freedom follows Fisher's F distribution.
    """
    if not np.isfinite(noise_freedom):
        return chdtrc(degrees_of_freedom, chi_square)
    return fdtrc(degrees_of_freedom, noise_freedom, chi_square / degrees_of_freedom)


def probability_below(chi_square: float, degrees_of_freedom: float, noise_freedom: float = np.inf) -> float:
    """Probability that noise alone gives a chi-square no larger, see `probability_above`."""
    if not np.isfinite(noise_freedom):
        return chdtr(degrees_of_freedom, chi_square)
    return fdtr(degrees_of_freedom, noise_freedom, chi_square / degrees_of_freedom)
