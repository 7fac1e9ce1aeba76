"""Power balance of a measurement: the share of the incident light that leaves, where the data allow it."""

import dataclasses

import numpy as np

from jaxink.measurement.dataset import GonioData

# Closer to the normal, an isotropic sample scatters alike into all azimuths, so that one plane is enough.
_NORMAL_DEG = 2.0
# A sum over fewer angles of view, or up to a smaller one, is none of the hemisphere.
_FEWEST_ANGLES = 6
_WIDEST_DEG = 60.0


@dataclasses.dataclass(frozen=True)
class Balance:
    """Share of the power that leaves the sample as scattered light, at normal incidence.

    Parameters
    ----------
    wavelength_nm, theta_i_deg
        Where.
    sides
        ``R``, ``T`` or ``RT``: what was measured and is included.
    share
        Integral of the BSDF times the cosine of the angle of view over the measured part of the hemispheres:
        a lower limit.
    """

    wavelength_nm: float
    theta_i_deg: float
    sides: str
    share: float


def balances(data: GonioData) -> tuple[Balance, ...]:
    """Power balances at each wavelength and normal incidence with enough angles of view; masks count.

    Integration is trapezoidal in the angle of view, from the normal to the largest measured angle.
    """
    found: dict[tuple[float, float], dict[str, float]] = {}
    for scan in data.scans:
        if scan.theta_i_deg > _NORMAL_DEG:
            continue
        here = data.used & (data.scan_index == scan.index)
        share = _integral(data.theta_o_deg[here], data.bsdf_per_sr[here])
        if share is not None:
            found.setdefault((scan.wavelength_nm, scan.theta_i_deg), {})[scan.side] = share
    return tuple(
        Balance(wavelength, incidence, "".join(sides), sum(sides.values()))
        for (wavelength, incidence), sides in found.items()
    )


def _integral(theta_deg: np.ndarray, bsdf_per_sr: np.ndarray) -> float | None:
    """2 pi times the integral of f cos(theta) sin(theta), readings at equal angles averaged."""
    angles, ring = np.unique(np.round(theta_deg, 6), return_inverse=True)
    if angles.size < _FEWEST_ANGLES or angles[-1] < _WIDEST_DEG:
        return None
    mean = np.bincount(ring.reshape(-1), weights=bsdf_per_sr) / np.bincount(ring.reshape(-1))
    # Inside the innermost ring the value of that ring.
    theta, mean = np.deg2rad(np.concatenate([[0.0], angles])), np.concatenate([mean[:1], mean])
    return float(np.pi * np.trapezoid(mean * np.sin(2 * theta), theta))
