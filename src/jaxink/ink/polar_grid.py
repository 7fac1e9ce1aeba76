"""Polar angles of a table, dense at critical angles, and interpolation between them."""

import math

import numpy as np

from jaxink.errors import InputRefusedError

# Critical angles closer to each other, or to grazing, than this are merged.
_SAME_DEG = 0.05
_FEWEST = 4
_MOST_ENTRIES = 50_000_000


def critical_angles_deg(index_ratios) -> list[float]:
    """Critical angles in a medium, from the refractive indices of other media over its own."""
    return [math.degrees(math.asin(ratio)) for ratio in index_ratios if ratio < 1]


def require_few_entries(n_theta: int, n_phi: int) -> None:
    """Reject a table that would not fit into memory."""
    n_entries = int(n_theta) ** 2 * int(n_phi)
    if n_entries > _MOST_ENTRIES:
        raise InputRefusedError(
            f"n_theta is {n_theta} and n_phi is {n_phi}, so each of the four components would have "
            f"{n_entries:.3g} entries; reduce them to at most {_MOST_ENTRIES:.3g} entries."
        )


def polar_grid(n_theta: int, critical_deg) -> np.ndarray:
    """Ascending angles from 0 to 90 degrees that include the critical angles, shape ``(n_theta,)``.

    Towards grazing and each critical angle, steps shrink in proportion to the square root of the distance,
    like the variation of Fresnel reflectance; elsewhere they are equal to within a factor of two.

    Raises
    ------
    InputRefusedError
        If there are too few angles for the number of critical ones.
    """
    ends = [0.0]
    for angle in sorted(critical_deg):
        if angle > ends[-1] + _SAME_DEG and angle < 90 - _SAME_DEG:
            ends.append(angle)
    ends.append(90.0)
    widths = np.diff(ends)
    fewest = _FEWEST * len(widths) + 1
    if n_theta < fewest:
        raise InputRefusedError(
            f"n_theta is {n_theta}; a table with {len(widths) - 1} critical angles needs at least {fewest}."
        )
    steps = np.full(len(widths), _FEWEST)
    for _ in range(n_theta - fewest):
        # The next angle goes into the segment with the largest steps.
        steps[np.argmax(widths / steps)] += 1
    parts = [np.zeros(1)]
    for start, width, n_steps in zip(ends, widths, steps, strict=False):
        unit = np.arange(1, n_steps + 1) / n_steps
        dense_at_end = np.sin(np.pi / 2 * unit)
        dense_at_both = (1 - np.cos(np.pi * unit)) / 2
        parts.append(start + width * (dense_at_end if start == 0 else dense_at_both))
    angles = np.concatenate(parts)
    # Exact ends, without rounding errors of sine and cosine.
    angles[np.cumsum(steps)] = ends[1:]
    return angles


def linear_matrix(grid: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Matrix of linear interpolation from an ascending grid, shape ``(targets, nodes)``."""
    right = np.clip(np.searchsorted(grid, targets), 1, len(grid) - 1)
    share = (targets - grid[right - 1]) / (grid[right] - grid[right - 1])
    rows = np.zeros((len(targets), len(grid)))
    at = np.arange(len(targets))
    rows[at, right], rows[at, right - 1] = share, 1 - share
    return rows
