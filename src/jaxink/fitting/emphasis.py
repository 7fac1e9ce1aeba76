"""Factors of residuals that make them those of an intensity, or of what the eye sees of it."""

import numpy as np
from jaxtyping import Float

from jaxink.colour.cie import illuminant_spectrum, matching_functions
from jaxink.errors import InputRefusedError
from jaxink.measurement import GonioData

# Objectives of a goniometer whose residual is that of the BSDF times a factor of each point.
INTENSITIES = ("intensity", "photometric")
_ILLUMINANT = "D65"


def factor_of_points(kind: str, data: GonioData) -> Float[np.ndarray, " used"]:
    """Factor of the residual of each used point; 1 unless the objective is one of `INTENSITIES`.

    Parameters
    ----------
    kind
        ``intensity``: cos(theta_o), which makes a BSDF an angular intensity per incident power;
        ``photometric``: that times V(lambda) and the power of D65, over their mean at the wavelengths of the
        points, so that each wavelength counts as the eye sees it.
    data
        The measurement.

    Raises
    ------
    InputRefusedError
        If no wavelength is visible.
    """
    used = data.used
    if kind not in INTENSITIES:
        return np.ones(int(used.sum()))
    cosine = np.cos(np.deg2rad(data.theta_o_deg[used]))
    if kind == "intensity":
        return cosine
    wave = data.wavelength_nm[used]
    at, functions = matching_functions(2)
    # V(lambda) is the second colour-matching function of 1931.
    seen = np.interp(wave, at, functions[1], 0.0, 0.0)
    seen = seen * np.interp(wave, *illuminant_spectrum(_ILLUMINANT), 0.0, 0.0)
    if not seen.mean() > 0:
        raise InputRefusedError(
            f"{data.source or 'the measurement'}: has no visible wavelength, so nothing is photometric; "
            "choose the objective 'intensity'."
        )
    return cosine * seen / np.mean([seen[wave == one][0] for one in np.unique(wave)])
