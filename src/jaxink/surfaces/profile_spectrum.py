"""The isotropic power spectrum of a surface from that of a profile."""

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.numerics.quadrature import gauss_legendre_unit


def isotropic_from_profile(
    frequency_per_um: Float[np.ndarray, " nodes"], profile_density_um3: Float[np.ndarray, " nodes"]
) -> tuple[Float[np.ndarray, " inner"], Float[np.ndarray, " inner"]]:
    """Power spectral density in the plane of frequencies from that of a profile of an isotropic surface.

    PSD(f) = -1/pi times the integral of PSD_1'(t) / sqrt(t^2 - f^2) over t > f, with PSD_1 a power law
    between its nodes and beyond the last.

    Parameters
    ----------
    frequency_per_um
        Ascending, above 0.
    profile_density_um3
        Two-sided density of the profile: its integral over positive and negative frequencies is the height
        variance.

    Returns
    -------
    frequency_per_um, density_um4
        Without the last node and nodes at which noise makes the density negative.

    References
    ----------
    Church, Takacs, Leonard 1989 Proc. SPIE 1165, 136 (the relation of both densities).
    """
    frequency, profile = np.asarray(frequency_per_um, float), np.asarray(profile_density_um3, float)
    if len(frequency) < 4 or np.any(np.diff(frequency) <= 0) or np.any(profile <= 0):
        raise InputRefusedError(
            "the spectrum of a profile must have at least 4 ascending frequencies with densities above 0."
        )
    x, y = np.log(frequency), np.log(profile)
    fall = np.diff(y) / np.diff(x)
    unit, weight = gauss_legendre_unit(12)
    # The power law of the whole last octave, because the last two nodes alone are noisy.
    last = np.arange(len(x)) >= len(x) - 2
    last |= x > x[-1] - np.log(2)
    tail = min(np.polyfit(x[last], y[last], 1)[0], -1.5)
    starts, stops = np.append(x[:-1], x[-1]), np.append(x[1:], x[-1] + 12.0)
    powers, levels = np.append(fall, tail), np.append(y[:-1], y[-1])
    found = []
    for k, here in enumerate(frequency[:-1]):
        # t = f cosh(w): dt / sqrt(t^2 - f^2) = dw.
        begin, end = (np.arccosh(np.exp(np.maximum(edge[k:] - x[k], 0.0))) for edge in (starts, stops))
        w = begin[:, None] + (end - begin)[:, None] * unit
        logarithm = np.log(here * np.cosh(w))
        slope = powers[k:, None] * np.exp(
            levels[k:, None] + powers[k:, None] * (logarithm - starts[k:, None]) - logarithm
        )
        found.append(-np.sum((end - begin)[:, None] * weight * slope) / np.pi)
    density = np.array(found)
    positive = density > 0
    return frequency[:-1][positive], density[positive]
