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
SIMULATED = "SIMULATED measurement"
SIDES = {"R": "reflection", "T": "transmission"}
# Components of an ink table for light from the plate.
FROM_INSIDE = {"R_II": "back into the plate", "T_IA": "to the other side"}
# With more, figures would become too many to look at.
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
        Measured minus fitted, in sigma of the point, or in per cent of the fit if the noise is unknown. A
        factor common to the scan is not removed: the residual is the distance between point and curve.
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
    return views_of(result.data, result.predicted_per_sr, drawn_residual(result), wavelength_nm, side)


def drawn_residual(result: "FitResult") -> np.ndarray:
    """Residual of each used point beside its curve, as in `ScanView`; unlike the whitened one, by point."""
    if result.whitened is None:
        return 100 * (result.data.bsdf_per_sr[result.data.used] / result.predicted_per_sr - 1)
    return in_sigma(result.data, result.predicted_per_sr, result.sigma_per_sr)


def in_sigma(data: "GonioData", predicted_per_sr: np.ndarray, sigma_per_sr: np.ndarray) -> np.ndarray:
    """Measured minus predicted at the used points, in units of the noise of each."""
    return (data.bsdf_per_sr[data.used] - predicted_per_sr) / sigma_per_sr


def views_of(
    data: "GonioData",
    predicted_per_sr: np.ndarray,
    residual_of_used: np.ndarray,
    wavelength_nm: float,
    side: str,
) -> list[ScanView]:
    """As `scan_views`, for any prediction and residuals at the used points."""
    fitted, residual = np.full((2, len(data)), np.nan)
    fitted[data.used], residual[data.used] = predicted_per_sr, residual_of_used
    views = []
    for scan in data.scans:
        if scan.side != side or abs(scan.wavelength_nm - wavelength_nm) > 1e-6:
            continue
        here = data.scan_index == scan.index
        columns = (data.theta_o_deg, data.phi_deg, data.bsdf_per_sr, fitted, residual, data.used)
        views.append(ScanView(scan.theta_i_deg, side, *(column[here] for column in columns)))
    return views


def measurement_name(result: "FitResult") -> str:
    """What was measured: the title of the sample if it has one, and whether it was simulated."""
    title = " ".join(result.sample.title.split())
    if not is_simulated(result):
        return title or "measurement"
    return title if "simulated" in title.lower() else f"{title} (simulated)" if title else SIMULATED


def headed(result: "FitResult", what: str) -> str:
    """Title of a figure: what it shows, and whether the measurement was simulated."""
    return f"{SIMULATED}: {what}" if is_simulated(result) else f"{what[0].upper()}{what[1:]}"


def is_simulated(result: "FitResult") -> bool:
    """Whether an attribute, the file name or the sample's title contains the word simulated."""
    texts = [result.data.source, result.sample.title, *(f"{k} {v}" for k, v in result.data.attrs.items())]
    return any("simulated" in str(text).lower() for text in texts)


def residual_label(result: "FitResult") -> str:
    """Axis label of the residuals."""
    return "measured / model - 1 [%]" if result.whitened is None else "residual [σ]"


def residual_words(result: "FitResult") -> str:
    """What residuals beside curves are, for a caption, and whether factors of scans are part of the noise."""
    if result.whitened is None:
        return "measured / model - 1, in per cent."
    words = "measured minus model, in standard deviations of the noise of the point."
    factor = result.noise["scan_relative"]
    if not factor:
        return words
    return (
        f"{words} A common factor of each scan, standard deviation {100 * factor:.2g} %, is part of the "
        "noise and not removed here."
    )


def residual_limit(views: list[ScanView], in_plane: bool) -> float:
    """Half-width of the common residual scale: nearly all points, and at least 3."""
    shown = [view.used & view.in_plane if in_plane else view.used for view in views]
    sizes = np.concatenate([np.abs(view.residual[here]) for view, here in zip(views, shown, strict=True)])
    return float(max(3.0, np.ceil(np.percentile(sizes, 99.5)))) if sizes.size else 3.0


def used_wavelengths(data: "GonioData") -> tuple[float, ...]:
    """Wavelengths that have used points, ascending."""
    return tuple(np.unique(data.wavelength_nm[data.used]).tolist())


def worst_wavelengths(
    data: "GonioData", residual: np.ndarray, most: int = MOST_WAVELENGTHS
) -> tuple[float, ...]:
    """The wavelengths with the largest mean square of a residual at the used points, ascending."""
    of_point = data.wavelength_nm[data.used]
    wavelengths = np.unique(of_point)
    misfit = [np.mean(residual[of_point == w] ** 2) for w in wavelengths]
    worst = np.argsort(misfit)[::-1][:most]
    return tuple(sorted(wavelengths[worst].tolist()))


def drawn_wavelengths(diagnosis: "Diagnosis") -> tuple[float, ...]:
    """Wavelengths whose scans are drawn: those where the declared model fits worst."""
    return worst_wavelengths(diagnosis.declared.data, diagnosis.before.whitened)


def fit_wavelengths(result: "FitResult") -> tuple[float, ...]:
    """Wavelengths whose scans are drawn: those where the fit is worst, in sigma, or relative to the fit."""
    return worst_wavelengths(result.data, _misfit(result))


def _misfit(result: "FitResult") -> np.ndarray:
    """Residual whose square is minimised, or the relative one if the noise is unknown."""
    return drawn_residual(result) if result.whitened is None else result.whitened


def wavelength_words(data: "GonioData") -> str:
    """That only some wavelengths are drawn; empty if all are."""
    count = len(used_wavelengths(data))
    if count <= MOST_WAVELENGTHS:
        return ""
    return f"Scans are shown at the {MOST_WAVELENGTHS} of {count} wavelengths with the largest misfit."


def worst_wavelength(result: "FitResult") -> float:
    """The wavelength that is fitted worst, which `overview_figure` shows."""
    return worst_wavelengths(result.data, _misfit(result), 1)[0]


def overview_words(result: "FitResult") -> str:
    """Caption of an `overview_figure`."""
    waves = used_wavelengths(result.data)
    worst = f", at {worst_wavelength(result):g} nm, the worst of {len(waves)}" if len(waves) > 1 else ""
    return (
        f"Circles: measured; lines: model{worst}. Triangles are residuals beyond the edge. Below: "
        f"{residual_words(result)}"
    )
