"""One colour that stands for a measurement, for reports and batches."""

import dataclasses
import importlib.util

import numpy as np
from jaxtyping import Float

from jaxink.colour.at_points import ColoursAtPoints, colours_at_points
from jaxink.errors import InputRefusedError
from jaxink.measurement import GonioData

# The usual geometry of an instrument for colours, which the direction shown is nearest to.
_LIT_DEG, _SEEN_DEG = 45.0, 0.0


@dataclasses.dataclass(frozen=True)
class ShownColour:
    """Colours of the measured direction that is nearest to 45:0.

    Parameters
    ----------
    theta_i_deg, theta_o_deg, phi_deg
        The direction.
    light
        Illuminant, observer and band.
    measured_lab, fitted_lab
        CIELAB of pi times the BSDF.
    """

    theta_i_deg: float
    theta_o_deg: float
    phi_deg: float
    light: str
    measured_lab: tuple[float, float, float]
    fitted_lab: tuple[float, float, float]

    @property
    def direction(self) -> str:
        """Angles of incidence and view."""
        return f"{self.theta_i_deg:g}:{self.theta_o_deg:g}"


def colours_if_any(data: GonioData, predicted_per_sr: np.ndarray) -> ColoursAtPoints | None:
    """Colours at the measured directions; None without colour-science, or if nothing was measured of them."""
    if importlib.util.find_spec("colour") is None:
        return None
    try:
        return colours_at_points(data, predicted_per_sr)
    except InputRefusedError:
        return None


def shown_colour(found: ColoursAtPoints) -> ShownColour | None:
    """The colour of the direction in reflection that is nearest to 45:0; None without reflection."""
    data, first = found.data, found.first
    in_front = ~data.is_transmission[first]
    if not in_front.any():
        return None
    away = np.hypot(data.theta_i_deg[first] - _LIT_DEG, data.theta_o_deg[first] - _SEEN_DEG)
    k = int(np.argmin(np.where(in_front, away, np.inf)))
    at = first[k]
    return ShownColour(
        float(data.theta_i_deg[at]),
        float(data.theta_o_deg[at]),
        float(data.phi_deg[at]),
        found.viewing.sentence,
        _lab(found.measured[k]),
        _lab(found.fitted[k]),
    )


def _lab(values: Float[np.ndarray, " 3"]) -> tuple[float, float, float]:
    lightness, a, b = values.tolist()
    return lightness, a, b
