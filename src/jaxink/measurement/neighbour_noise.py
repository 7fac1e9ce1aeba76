"""Noise of a point, from the roughness of scans: what five neighbours leave of a cubic through them.

A fourth divided difference of five neighbours removes any cubic, at any spacing; scaled by the root sum of
squares of its terms, it has the relative standard deviation of the noise. Curvature of the scan itself would
add to it. The same difference of every second point contains up to 16 times as much curvature, and no more
noise: where it exceeds the noise, the curvature is not negligible, and the neighbours are left out. In a scan
with ripples, the two kinds of differences differ everywhere, and the scan is left out.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxink.measurement.dataset import GonioData
from jaxink.measurement.scan_lines import scan_lines

_ORDER = 4
# Differences of every second point above this many standard deviations reveal curvature, which then is below
# a quarter of the noise in the others.
_CURVED = 4.0
# Of noise, both kinds of differences are equally large, to within this factor in a scan of 20 points or more.
_LIKE = 2.0
_OUTLIER = 5.0
_TO_DEVIATION = 1.4826


@dataclass(frozen=True)
class ScanRoughness:
    """Noise of one scan from its roughness.

    Parameters
    ----------
    scan
        Its number.
    relative
        Relative standard deviation of a value.
    degrees_of_freedom
        Of its square; overlapping differences are not independent.
    outliers
        Differences left out as outliers.
    """

    scan: int
    relative: float
    degrees_of_freedom: float
    outliers: int


def roughness_of_scans(data: GonioData) -> tuple[ScanRoughness, ...]:
    """Noise of each scan that is dense and smooth enough to tell it.

    Parameters
    ----------
    data
        Its used points must be positive and no copies of each other. Repeats are averaged.
    """
    found = []
    for scan in np.unique(data.scan_index[data.used]).tolist():
        lines = [_Line.of(*line) for line in _lines(data, scan)]
        one = _roughness(scan, [line for line in lines if line is not None])
        if one is not None:
            found.append(one)
    return tuple(found)


@dataclass(frozen=True)
class _Line:
    """Scaled differences along a line of points; `coarse` are those of every second point.

    Of each difference, `terms` are the standard deviations that its five values contribute, with signs.
    """

    difference: Float[np.ndarray, " differences"]
    coarse: Float[np.ndarray, " differences"]
    terms: Float[np.ndarray, "differences 5"]

    @classmethod
    def of(cls, position: np.ndarray, value: np.ndarray, count: np.ndarray) -> "_Line | None":
        """Of mean values of so many readings at each position."""
        # Every second point of nine makes the first coarse difference.
        if position.size < 2 * _ORDER + 1:
            return None
        fine, terms = _differences(position, value, count, 1)
        coarse, _ = _differences(position, value, count, 2)
        # Each fine difference is judged by the coarse one around the same point, or the nearest one.
        nearest = np.clip(np.arange(fine.size) - _ORDER // 2, 0, coarse.size - 1)
        return cls(fine, np.abs(coarse)[nearest], terms)

    def squared_correlations(self, keep: np.ndarray) -> float:
        """Sum over all pairs of the differences kept, each with itself included."""
        total = float(keep.sum())
        for lag in range(1, min(_ORDER, keep.size - 1) + 1):
            shared = np.sum(self.terms[:-lag, lag:] * self.terms[lag:, :-lag], axis=1)
            total += 2 * float(np.sum(shared[keep[:-lag] & keep[lag:]] ** 2))
        return total


def _differences(
    position: np.ndarray, value: np.ndarray, count: np.ndarray, stride: int
) -> tuple[np.ndarray, np.ndarray]:
    """Fourth divided differences over their standard deviation for a relative noise of 1, and its terms."""
    index = np.arange(position.size - _ORDER * stride)[:, None] + stride * np.arange(_ORDER + 1)
    at = position[index]
    gaps = at[:, :, None] - at[:, None, :] + np.eye(_ORDER + 1)
    terms = value[index] / np.sqrt(count[index]) / gaps.prod(axis=2)
    terms /= np.linalg.norm(terms, axis=1, keepdims=True)
    return np.sum(terms * np.sqrt(count[index]), axis=1), terms


def _roughness(scan: int, lines: list[_Line]) -> ScanRoughness | None:
    if not lines:
        return None
    difference = np.concatenate([line.difference for line in lines])
    coarse = np.concatenate([line.coarse for line in lines])
    size = np.abs(difference)
    flat = np.ones(size.size, bool)
    # The scale shrinks as curved parts are left out.
    for _ in range(3):
        if 2 * flat.sum() < size.size:
            return None
        scale = _TO_DEVIATION * np.median(size[flat])
        flat = coarse <= _CURVED * scale
    if 2 * flat.sum() < size.size or scale == 0:
        return None
    if not 1 / _LIKE < _TO_DEVIATION * np.median(coarse[flat]) / scale < _LIKE:
        return None
    keep = flat & (size <= _OUTLIER * scale)
    starts = np.cumsum([0, *(line.difference.size for line in lines)])
    squares = sum(
        line.squared_correlations(keep[a:b])
        for line, a, b in zip(lines, starts[:-1], starts[1:], strict=True)
    )
    freedom = keep.sum() ** 2 / squares
    relative = float(np.sqrt(np.mean(difference[keep] ** 2)))
    return ScanRoughness(scan, relative, float(freedom), int((flat & ~keep).sum()))


def _lines(data: GonioData, scan: int) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Positions, mean values and numbers of readings along the planes of a scan, or around its rings."""
    for points, position, group in scan_lines(data, scan):
        count = np.bincount(group)
        yield position, np.bincount(group, weights=data.bsdf_per_sr[points]) / count, count
