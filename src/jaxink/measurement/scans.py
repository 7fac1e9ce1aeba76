"""Scans of a measurement: the points of one incidence, wavelength and side."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

# Angles and wavelengths that differ by less are equal: far below any goniometer's steps, far above rounding.
SAME = 1e-6


@dataclass(frozen=True)
class Scan:
    """The points of one incidence, wavelength and side.

    Parameters
    ----------
    index
        Number in ``GonioData.scan_index``.
    side
        ``"R"`` or ``"T"``.
    wavelength_nm, theta_i_deg
        Common to all its points.
    points, used
        Number of points, and of those that no mask excludes.
    """

    index: int
    side: str
    wavelength_nm: float
    theta_i_deg: float
    points: int
    used: int


def wavelength_words(wavelengths_nm: Sequence[float]) -> str:
    """Ascending wavelengths in words, such as ``550 nm`` or ``3 wavelengths from 450 to 650 nm``."""
    first, *others = wavelengths_nm
    if not others:
        return f"{first:g} nm"
    return f"{len(wavelengths_nm)} wavelengths from {first:g} to {others[-1]:g} nm"


def scan_numbers(
    is_transmission: Bool[np.ndarray, " points"],
    wavelength_nm: Float[np.ndarray, " points"],
    theta_i_deg: Float[np.ndarray, " points"],
) -> Int[np.ndarray, " points"]:
    """Number of the scan of each point: reflection first, then by wavelength, then by incidence."""
    columns = (is_transmission, wavelength_nm / SAME, theta_i_deg / SAME)
    keys = np.stack([np.rint(column).astype(np.int64) for column in columns], axis=1)
    return np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
