"""Readings that are ten times what their neighbours read, or a tenth: a slip of the pen, not noise."""

from typing import NamedTuple

import numpy as np

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.masks import angular_distance_deg
from jaxink.measurement.scan_lines import scan_lines

# A decimal point in the wrong place.
_LEAST_FACTOR = 8.0
# Neighbours tell a value if the two in the middle of four agree to within this factor.
_AGREE = 1.5
_EACH_SIDE = 2
# A peak that is narrower than the steps of a scan is one reading, but at the regular direction; near the
# retroreflected one is the detector's shadow.
_NEAR_REGULAR_DEG, _NEAR_RETRO_DEG = 6.0, 10.0


class OutOfLine(NamedTuple):
    """A reading that its neighbours contradict.

    Parameters
    ----------
    point
        Its index.
    expected_per_sr
        Median of its four neighbours along the scan.
    """

    point: int
    expected_per_sr: float


def readings_out_of_line(data: GonioData) -> tuple[OutOfLine, ...]:
    """Used readings that are far from what two neighbours on each side say, the farthest first."""
    found = []
    regular = angular_distance_deg(data.theta_o_deg, data.phi_deg, data.theta_i_deg, 180.0)
    retro = angular_distance_deg(data.theta_o_deg, data.phi_deg, data.theta_i_deg, 0.0)
    plain = (regular > _NEAR_REGULAR_DEG) & (retro > _NEAR_RETRO_DEG) & (data.bsdf_per_sr > 0)
    for scan in np.unique(data.scan_index[data.used]).tolist():
        for points, position, group in scan_lines(data, scan):
            # Repeats are judged by each other elsewhere.
            if position.size <= 2 * _EACH_SIDE or points.size != position.size:
                continue
            ordered = points[np.argsort(group)]
            with np.errstate(divide="ignore", invalid="ignore"):
                level = np.log(data.bsdf_per_sr[ordered])
            inner = np.arange(_EACH_SIDE, ordered.size - _EACH_SIDE)
            around = inner[:, None] + np.array([*range(-_EACH_SIDE, 0), *range(1, _EACH_SIDE + 1)])
            near = np.sort(level[around], axis=1)
            expected = near[:, 1:3].mean(axis=1)
            with np.errstate(invalid="ignore"):
                agree = np.isfinite(near).all(axis=1) & (near[:, 2] - near[:, 1] < np.log(_AGREE))
                far = np.abs(level[inner] - expected) > np.log(_LEAST_FACTOR)
            for k in np.flatnonzero(agree & far & plain[ordered[inner]]):
                found.append(OutOfLine(int(ordered[inner[k]]), float(np.exp(expected[k]))))

    def factor(one: OutOfLine) -> float:
        return abs(float(np.log(data.bsdf_per_sr[one.point] / one.expected_per_sr)))

    return tuple(sorted(found, key=factor, reverse=True))
