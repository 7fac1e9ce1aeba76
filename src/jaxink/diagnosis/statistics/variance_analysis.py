"""Analysis of variance of a residual by side, incidence, wavelength, time and angular distances."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Shaped
from scipy.special import chdtrc

from jaxink.diagnosis.statistics.discrepancy import SmoothPart
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.display.brief import brief_repr

DISTANCE_EDGES = {
    "forward": (0.0, 5.0, 15.0, 30.0, 60.0, 180.0),
    "retro": (0.0, 5.0, 15.0, 30.0, 60.0, 180.0),
    "horizon": (0.0, 10.0, 20.0, 40.0, 90.0),
}
TARGETS = {"forward": "the forward direction", "retro": "the source", "horizon": "the horizon"}
# Tolerance at the edges of a band, because goniometers often measure at exactly these angles.
_ROUNDING_DEG = 1e-6
# Of the order of the rows, as nothing else is known of the time.
_TIMES = tuple(f"in the {which} quarter of the rows" for which in ("first", "second", "third", "last"))


@dataclass(frozen=True)
class Factor:
    """One division of the points, and how the residual depends on it.

    Parameters
    ----------
    name
        ``side``, ``incidence``, ``wavelength``, ``time``, ``forward``, ``retro`` or ``horizon``.
    levels
        Name of each level.
    means
        Mean residual of each level, in standard deviations of the noise.
    share
        Share of the smooth part's sum of squares explained by the means of the levels.
    p_value
        Probability of means this large for pure noise; exact, with the fit taken into account.
    """

    __repr__ = brief_repr

    name: str
    levels: tuple[str, ...]
    means: Float[np.ndarray, " levels"]
    share: float
    p_value: float


class Division(NamedTuple):
    """Level of each point, -1 for none, and the names of the levels."""

    labels: Int[np.ndarray, " points"]
    levels: tuple[str, ...]


class LevelMeans(NamedTuple):
    """Mean residual of each level, and the share of the smooth part that its level means explain."""

    means: Float[np.ndarray, " levels"]
    share: float


def factors_of(
    left: Float[np.ndarray, " rows"], projection: Projection, points: Points, smooth: SmoothPart
) -> tuple[Factor, ...]:
    """Analysis by every division of a residual after projection; the largest share first."""
    factors = []
    for name, (labels, levels) in divisions_of(points).items():
        if len(levels) < 2:
            continue
        means, share = level_means(labels, len(levels), left[: len(points)], smooth.values)
        factors.append(Factor(name, levels, means, share, division_p(labels, projection, left)))
    return tuple(sorted(factors, key=lambda factor: -factor.share))


def divisions_of(points: Points) -> dict[str, Division]:
    """All divisions of the points."""
    divisions = {
        "side": _distinct(points.is_transmission, lambda side: "T" if side else "R"),
        "incidence": _distinct(points.theta_i_deg, lambda angle: f"at {angle:g} degrees incidence"),
        "wavelength": _distinct(points.wavelength_nm, lambda length: f"at {length:g} nm"),
    }
    rank = np.argsort(np.argsort(points.order, kind="stable"))
    divisions["time"] = Division(rank * len(_TIMES) // len(points), _TIMES)
    for name, edges in DISTANCE_EDGES.items():
        bands = [band_words(low, high, edges[-1]) for low, high in zip(edges, edges[1:], strict=False)]
        divisions[name] = Division(_bands(points, name), tuple(f"{band} {TARGETS[name]}" for band in bands))
    return divisions


def _distinct(values: Shaped[np.ndarray, " points"], word: Callable[[float], str]) -> Division:
    distinct, labels = np.unique(np.round(values.astype(float), 3), return_inverse=True)
    return Division(labels.reshape(-1), tuple(word(value) for value in distinct))


def _bands(points: Points, name: str) -> Int[np.ndarray, " points"]:
    distance = {
        "forward": points.from_forward_deg,
        "retro": points.from_retro_deg,
        "horizon": 90 - points.theta_o_deg,
    }[name]
    inner_edges = np.array(DISTANCE_EDGES[name][1:-1]) + _ROUNDING_DEG
    return np.where(np.isfinite(distance), np.searchsorted(inner_edges, distance), -1)


def band_words(low: float, high: float, end: float) -> str:
    """A band of distances in words; `end` is the largest possible distance."""
    if low == 0:
        return f"within {high:g} degrees of"
    if high == end:
        return f"beyond {low:g} degrees from"
    return f"{low:g} to {high:g} degrees from"


def level_means(
    labels: Int[np.ndarray, " points"],
    n_levels: int,
    left: Float[np.ndarray, " points"],
    smooth: Float[np.ndarray, " points"],
) -> LevelMeans:
    """Means of a residual and of its smooth part over the levels of a division."""
    inside = labels >= 0
    count = np.bincount(labels[inside], minlength=n_levels)
    divisor = np.maximum(count, 1)
    means = np.bincount(labels[inside], left[inside], n_levels) / divisor
    smooth_means = np.bincount(labels[inside], smooth[inside], n_levels) / divisor
    total = float(np.sum(smooth**2))
    share = float(np.sum(count * smooth_means**2)) / total if total > 0 else 0.0
    return LevelMeans(np.where(count > 0, means, np.nan), share)


def division_p(
    labels: Int[np.ndarray, " points"], projection: Projection, left: Float[np.ndarray, " rows"]
) -> float:
    """Probability that noise alone follows a division this closely; arguments as for `factors_of`."""
    indicators = (labels[:, None] == np.arange(labels.max() + 1)).astype(float)
    padded = np.zeros((left.size, indicators.shape[1]))
    padded[: labels.size] = indicators
    columns = projection.unit(padded)
    basis = orthonormal_range(columns.unit[:, columns.norm > 0])
    return float(chdtrc(basis.shape[1], np.sum((basis.T @ left) ** 2))) if basis.shape[1] else 1.0
