"""Lines of neighbouring points of a scan: along its planes, or around its rings."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float, Int

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.pairs import ANGLE_TOLERANCE_DEG


def scan_lines(
    data: GonioData, scan: int
) -> Iterator[tuple[Int[np.ndarray, " points"], Float[np.ndarray, " positions"], Int[np.ndarray, " points"]]]:
    """Used points of each line of a scan, its positions in order, and the position of each point.

    Parameters
    ----------
    data
        The measurement.
    scan
        Number of the scan.
    """
    here = np.flatnonzero(data.used & (data.scan_index == scan))
    polar, azimuth = data.theta_o_deg[here], data.phi_deg[here]
    plane = np.rint(np.mod(azimuth, 180) / ANGLE_TOLERANCE_DEG).astype(int) % round(180 / ANGLE_TOLERANCE_DEG)
    ring = np.rint(polar / ANGLE_TOLERANCE_DEG).astype(int)
    signed = np.where(np.cos(np.deg2rad(azimuth - plane * ANGLE_TOLERANCE_DEG)) >= 0, polar, -polar)
    line, along = plane, signed
    if np.unique(ring).size < np.unique(plane).size:
        line, along = ring, azimuth
    for number in np.unique(line):
        these = np.flatnonzero(line == number)
        position, group = _distinct(along[these])
        yield here[these], position, group


def _distinct(along: np.ndarray) -> tuple[np.ndarray, Int[np.ndarray, " points"]]:
    _, first, group = np.unique(np.rint(along / ANGLE_TOLERANCE_DEG), return_index=True, return_inverse=True)
    return along[first], group.reshape(-1)
