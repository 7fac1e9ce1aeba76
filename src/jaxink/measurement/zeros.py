"""Values of exactly 0 where nothing was measured: the detector's shadow, gaps, NaN that became 0.

A 0 is a reading where the values around it go to 0 continuously, scatter as far as 0, or are rounded so
coarsely that they reach it. It is none where they agree on a value that is clearly not 0.
"""

import numpy as np
from jaxtyping import Bool, Float

# Number of readings around a zero that judge it, and the fewest that can.
_NEIGHBOURS, _FEWEST = 8, 5
# They agree if their median exceeds so many times their scatter (1.4826 times the median deviation), and do
# not go to 0 if no more than two, as of a half-shaded beam, are below this share of the median.
_AGREEING, _SMALL, _FEW = 3.0, 0.1, 2
# Distance of one radian of incidence among directions of view: neighbours are of the same scan if it has any.
_BETWEEN_SCANS = 10.0
# Towards the horizon every BSDF through a smooth face goes to 0.
_HORIZON_DEG = 90 - 1e-6
# Of all values of a side and wavelength; if most are 0, they are the dark surroundings of a lobe.
_MOST_ZEROS = 0.5
_WHOLE = 1e-6


def without_reading(
    directions: tuple[np.ndarray, ...], bsdf_per_sr: Float[np.ndarray, " points"]
) -> Bool[np.ndarray, " points"]:
    """True for values of exactly 0 that are no readings; ``directions`` as in `GonioData.directions`."""
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission = directions
    found = np.zeros(bsdf_per_sr.shape, bool)
    zero = (bsdf_per_sr == 0) & (theta_o_deg < _HORIZON_DEG) & (theta_i_deg < _HORIZON_DEG)
    if not zero.any():
        return found
    theta, phi = np.deg2rad(theta_o_deg), np.deg2rad(phi_deg)
    across = np.sin(theta)
    places = np.stack(
        [
            _BETWEEN_SCANS * np.deg2rad(theta_i_deg),
            across * np.cos(phi),
            across * np.sin(phi),
            np.cos(theta),
        ],
        axis=1,
    )
    for side in (False, True):
        for wavelength in np.unique(wavelength_nm[zero & (is_transmission == side)]):
            here = np.flatnonzero((is_transmission == side) & (wavelength_nm == wavelength))
            at, value = places[here], bsdf_per_sr[here]
            found[here[zero[here]]] = _are_no_readings(at[zero[here]], at[value != 0], value[value != 0])
    return found


def _are_no_readings(at: np.ndarray, others_at: np.ndarray, others: np.ndarray) -> np.ndarray:
    """For zeros at these places, among the other values of their side and wavelength."""
    # Imported late because most files have no zeros, and reading them needs no scipy.
    from scipy.spatial import cKDTree

    if others.size < _FEWEST or len(at) > _MOST_ZEROS * (len(at) + others.size):
        return np.zeros(len(at), bool)
    _, nearest = cKDTree(others_at).query(at, min(_NEIGHBOURS, others.size))
    around = others[nearest]
    middle = np.median(around, axis=1)
    small = np.sort(around, axis=1)[:, min(_FEW, around.shape[1] - 1)]
    scatter = 1.4826 * np.median(np.abs(around - middle[:, None]), axis=1)
    agree = (middle > _AGREEING * scatter) & (small > _SMALL * middle)
    return agree & (middle > 2 * _rounding_step(others))


def _rounding_step(values: np.ndarray) -> float:
    """The step of values that are rounded, or counted, to whole multiples of it; 0 if they are not."""
    step = np.abs(values).min()
    multiples = np.abs(values) / step
    is_whole = np.abs(multiples - np.round(multiples)) < _WHOLE * multiples
    return float(step) if is_whole.all() and (np.round(multiples) == 2).any() else 0.0
