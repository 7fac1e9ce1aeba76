"""Light at smooth faces between two clear media, as random paths meet them."""

import numpy as np
from jaxtyping import Float


def fresnel(cosine: Float[np.ndarray, " n"], ratio: float) -> Float[np.ndarray, " n"]:
    """Reflectance of unpolarised light.

    Parameters
    ----------
    cosine
        Of the angles of incidence.
    ratio
        Refractive index of the medium of incidence over that beyond.
    """
    sine2 = ratio**2 * (1 - cosine**2)
    beyond = np.sqrt(np.maximum(1 - sine2, 0.0))
    s = (ratio * cosine - beyond) / (ratio * cosine + beyond)
    p = (cosine - ratio * beyond) / (cosine + ratio * beyond)
    return np.where(sine2 >= 1, 1.0, (s**2 + p**2) / 2)


def refracted(direction: Float[np.ndarray, "n 3"], axis: int, ratio: float) -> Float[np.ndarray, "n 3"]:
    """Directions beyond a face whose normal is a coordinate axis; none may be totally reflected."""
    turned = ratio * direction
    turned[:, axis] = 0.0
    along = np.sqrt(np.maximum(1 - np.sum(turned**2, axis=1), 0.0))
    turned[:, axis] = np.copysign(along, direction[:, axis])
    return turned
