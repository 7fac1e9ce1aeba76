"""Clear layers between the surroundings and one side of an ink table."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from jaxink.sample import Layer


@dataclasses.dataclass(frozen=True)
class ClearRun:
    """Clear layers between the surroundings and one side of the sheet.

    Parameters
    ----------
    indices
        Refractive indices of the surroundings and of each layer, inwards; the last is on the sheet's side.
    optical_thickness
        Optical thickness of each layer.
    """

    indices: tuple[float, ...]
    optical_thickness: tuple[float, ...]

    def reflected_and_transmitted(self, kappa: Float[np.ndarray, " channels"]):
        """Reflectance towards the sheet, and transmittance (the same in both directions), by n sin(theta)."""
        cosines = [np.sqrt(np.maximum(1 - (kappa / n) ** 2, 0.0)) for n in self.indices]
        reflected, transmitted = np.zeros_like(kappa), (cosines[0] > 0).astype(float)
        for k, thickness in enumerate(self.optical_thickness):
            r = _fresnel(*self.indices[k : k + 2], *cosines[k : k + 2])
            gain = 1 / np.maximum(1 - r * reflected, 1e-12)
            reflected = r + (1 - r) ** 2 * gain * reflected
            transmitted = (1 - r) * gain * transmitted
            inside = cosines[k + 1] > 0
            through = np.where(inside, np.exp(-thickness / np.where(inside, cosines[k + 1], 1.0)), 0.0)
            reflected, transmitted = through**2 * reflected, through * transmitted
        return reflected, transmitted


def _fresnel(index_1, index_2, cosine_1, cosine_2):
    """Unpolarised reflectance, independent of the solver's like the whole verification."""
    s_1, s_2, p_1, p_2 = index_1 * cosine_1, index_2 * cosine_2, index_2 * cosine_1, index_1 * cosine_2
    some = (cosine_1 > 0) | (cosine_2 > 0)
    r_s, r_p = ((a - b) / np.where(some, a + b, 1.0) for a, b in ((s_1, s_2), (p_1, p_2)))
    return (r_s**2 + r_p**2) / 2


def clear_run(
    values: Mapping[str, float], surroundings: str, layers: Sequence[Layer], wavelength: float
) -> ClearRun:
    """Clear layers from the surroundings inwards to the sheet."""

    def get(name):
        return float(values.get(f"{name}@{wavelength:g}", values.get(name)))

    indices = [get(surroundings)] + [get(f"{layer.name}.refractive_index") for layer in layers]
    thickness = [
        get(f"{layer.name}.absorption_per_mm") * get(f"{layer.name}.thickness_mm") for layer in layers
    ]
    return ClearRun(tuple(indices), tuple(thickness))
