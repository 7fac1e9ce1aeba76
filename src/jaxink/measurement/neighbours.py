"""The value of each point as its neighbours along the scan have it, without the point's own reading.

A standard deviation relative to the reading itself is small where the noise happens to be negative: readings
that are too low weigh more, and a fit to N readings of relative noise r ends 2 r^2 below their mean, which
exceeds its standard error, r / sqrt(N), from r = 0.5 / sqrt(N) on. One relative to what the neighbours say is
independent of the noise of the point, so that the fit is unbiased.
"""

import numpy as np
from jaxtyping import Float

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.scan_lines import scan_lines

# Neighbours on each side, whose logarithms are fitted by a parabola; for the ends of a line, so many by a
# straight line.
_EACH_SIDE = 3
_FEWEST = 4
# A reading further from its neighbours, in standard deviations of the difference, is on a peak or a mistake.
_FAR = 4.0


def values_of_neighbours(
    data: GonioData, relative_sigma: Float[np.ndarray, " points"]
) -> Float[np.ndarray, " points"]:
    """Magnitude of each used point by its neighbours; by its own reading where these do not tell it.

    Parameters
    ----------
    data
        The measurement.
    relative_sigma
        Relative standard deviation of each used point.

    Returns
    -------
    Float[np.ndarray, " points"]
        In 1/sr.

    References
    ----------
    Correlation of a weight with its reading: Peelle's puzzle (Frühwirth, Neudecker, Leeb 2012 EPJ Web Conf.
    27, 00008).
    """
    magnitude = np.abs(data.bsdf_per_sr)
    found = magnitude.copy()
    sigma = np.zeros(magnitude.size)
    sigma[data.used] = relative_sigma
    for scan in np.unique(data.scan_index[data.used]).tolist():
        for points, position, group in scan_lines(data, scan):
            tells = data.bsdf_per_sr[points] > 0
            points, (used, group) = points[tells], np.unique(group[tells], return_inverse=True)
            position, group = position[used], group.reshape(-1)
            if position.size <= _FEWEST:
                continue
            weights = _weights(position)
            level = np.bincount(group, weights=np.log(magnitude[points])) / np.bincount(group)
            expected = np.exp(weights @ level)[group]
            spread = np.sqrt(1 + np.sum(weights**2, axis=1))[group]
            near = np.abs(np.log(magnitude[points] / expected)) <= _FAR * spread * sigma[points]
            found[points[near]] = expected[near]
    return found[data.used]


def _weights(position: Float[np.ndarray, " positions"]) -> Float[np.ndarray, "positions positions"]:
    """Of the values at all positions in the expected one at each; that at the position itself has none."""
    n = position.size
    weights = np.zeros((n, n))
    here = np.arange(n)[:, None]
    width = min(2 * _EACH_SIDE, n - 1)
    others = np.clip(here - _EACH_SIDE, 0, n - 1 - width) + np.arange(width)
    others += others >= here
    # The value of the fitted polynomial at the position itself.
    powers = (position[others] - position[here])[..., None] ** np.arange(3)
    np.put_along_axis(weights, others, np.linalg.pinv(powers)[:, 0], axis=1)
    for end, nearest in ((0, slice(1, 1 + _FEWEST)), (n - 1, slice(n - 1 - _FEWEST, n - 1))):
        line = (position[nearest] - position[end])[:, None] ** np.arange(2)
        weights[end] = 0.0
        weights[end, nearest] = np.linalg.pinv(line)[0]
    return weights
