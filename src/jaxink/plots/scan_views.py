"""Data of one scan for figures: signed in-plane angles, fit and residual."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from jaxink.diagnosis import Diagnosis
    from jaxink.fitting import FitResult
    from jaxink.measurement import GonioData

# In-plane points: azimuth this close to 0 or 180 degrees, or viewing direction this close to the normal.
IN_PLANE_DEG = 1.0
_NORMAL_DEG = 1e-3
FEWEST_IN_PLANE = 5
SIDES = {"R": "reflection", "T": "transmission"}
# Components of an ink table for light from the plate.
FROM_INSIDE = {"R_II": "back into the plate", "T_IA": "to the other side"}
# With more, the report of a diagnosis would become too long.
MOST_WAVELENGTHS = 3


@dataclasses.dataclass(frozen=True)
class ScanView:
    """One incidence at one wavelength and side.

    Parameters
    ----------
    theta_i_deg, side
        Which scan.
    theta_o_deg, phi_deg
        Viewing directions.
    measured, fitted
        BSDF, 1/sr; fitted is nan at masked points.
    residual
        Measured minus fitted, in sigma, or in per cent of the fit if the noise is unknown.
    used
        False at masked points.
    """

    theta_i_deg: float
    side: str
    theta_o_deg: np.ndarray
    phi_deg: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray
    residual: np.ndarray
    used: np.ndarray

    @property
    def in_plane(self) -> np.ndarray:
        """Points in the plane of incidence."""
        azimuth = np.abs(self.phi_deg)
        return (azimuth < IN_PLANE_DEG) | (azimuth > 180 - IN_PLANE_DEG) | (self.theta_o_deg < _NORMAL_DEG)

    @property
    def has_cut(self) -> bool:
        """Whether enough used points are in the plane of incidence."""
        return int((self.in_plane & self.used).sum()) >= FEWEST_IN_PLANE

    @property
    def signed_deg(self) -> np.ndarray:
        """Viewing angle, negative towards the source."""
        return np.where(np.abs(self.phi_deg) < 90, -self.theta_o_deg, self.theta_o_deg)


def scan_views(result: "FitResult", wavelength_nm: float, side: str) -> list[ScanView]:
    """The scans of one wavelength and side, in the order of incidence."""
    return views_of(result.data, result.predicted_per_sr, result.whitened, wavelength_nm, side)


def views_of(
    data: "GonioData",
    predicted_per_sr: np.ndarray,
    whitened: np.ndarray | None,
    wavelength_nm: float,
    side: str,
) -> list[ScanView]:
    """As `scan_views`, for any prediction and whitened residuals at the used points."""
    fitted, residual = np.full((2, len(data)), np.nan)
    fitted[data.used] = predicted_per_sr
    if whitened is None:
        residual[data.used] = 100 * (data.bsdf_per_sr[data.used] / predicted_per_sr - 1)
    else:
        residual[data.used] = whitened
    views = []
    for scan in data.scans:
        if scan.side != side or abs(scan.wavelength_nm - wavelength_nm) > 1e-6:
            continue
        here = data.scan_index == scan.index
        columns = (data.theta_o_deg, data.phi_deg, data.bsdf_per_sr, fitted, residual, data.used)
        views.append(ScanView(scan.theta_i_deg, side, *(column[here] for column in columns)))
    return views


def measurement_name(result: "FitResult") -> str:
    """Name of the measurement, and whether it was simulated."""
    kind = "SIMULATED measurement" if is_simulated(result) else "Measurement"
    return f"{kind} {result.data.source}" if result.data.source else kind


def is_simulated(result: "FitResult") -> bool:
    """Whether an attribute, the file name or the sample's title contains the word simulated."""
    texts = [result.data.source, result.sample.title, *(f"{k} {v}" for k, v in result.data.attrs.items())]
    return any("simulated" in str(text).lower() for text in texts)


def residual_label(result: "FitResult") -> str:
    """Axis label of the residuals."""
    return "(measured - fitted) / fitted [%]" if result.whitened is None else "residual [σ]"


def residual_limit(views: list[ScanView], in_plane: bool) -> float:
    """Half-width of the common residual scale: nearly all points, and at least 3."""
    shown = [view.used & view.in_plane if in_plane else view.used for view in views]
    sizes = np.concatenate([np.abs(view.residual[here]) for view, here in zip(views, shown, strict=True)])
    return float(max(3.0, np.ceil(np.percentile(sizes, 99.5)))) if sizes.size else 3.0


def drawn_wavelengths(diagnosis: "Diagnosis") -> tuple[float, ...]:
    """Wavelengths to draw: the `MOST_WAVELENGTHS` where the declared model fits worst, ascending."""
    data = diagnosis.declared.data
    of_point = data.wavelength_nm[data.used]
    wavelengths = np.unique(of_point)
    misfit = [np.mean(diagnosis.before.whitened[of_point == w] ** 2) for w in wavelengths]
    worst = np.argsort(misfit)[::-1][:MOST_WAVELENGTHS]
    return tuple(sorted(wavelengths[worst].tolist()))
