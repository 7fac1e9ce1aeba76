"""Statistics of serial and spatial correlation of residuals, and their null laws."""

from dataclasses import dataclass
from typing import overload

import numpy as np
from jaxtyping import Float, Int

from jaxink.diagnosis.policy import SearchPolicy
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.serial_correlation import ByScan, ljung_box, moran, runs_z


@dataclass(frozen=True)
class ScanStatistic:
    """One statistic of several residuals.

    Parameters
    ----------
    name
        ``runs``, ``ljung_box``, ``neighbours``, ``incidence`` or ``wavelength``.
    values
        Over all scans, and in those that are long enough.
    scans
        Numbers of these scans.
    side
        +1 if large values indicate structure, -1 if small ones do.
    """

    name: str
    values: ByScan
    scans: Int[np.ndarray, " scans"]
    side: int = 1

    @property
    def oriented(self) -> ByScan:
        """Values with a sign such that large ones indicate structure."""
        return ByScan(self.side * self.values.per_scan, self.side * self.values.pooled)


@dataclass(frozen=True)
class StatisticP:
    """p-values of one statistic: over all scans, and of the most significant scan with its position."""

    pooled: Float[np.ndarray, " vectors"]
    worst: Float[np.ndarray, " vectors"]
    worst_scan: Int[np.ndarray, " vectors"]


@dataclass(frozen=True)
class NullStatistic:
    """Law of one statistic for noise that has passed through the fit.

    Parameters
    ----------
    pooled, worst
        Over all scans, and standardised for the most significant scan; ascending.
    centre, scatter
        Mean and standard deviation in each scan.
    """

    pooled: Float[np.ndarray, " draws"]
    worst: Float[np.ndarray, " draws"]
    centre: Float[np.ndarray, " scans"]
    scatter: Float[np.ndarray, " scans"]

    @classmethod
    def of(cls, statistic: ScanStatistic) -> "NullStatistic":
        """Law of a statistic from its values for noise."""
        values = statistic.oriented
        centre, scatter = values.per_scan.mean(axis=0), values.per_scan.std(axis=0)
        scatter = np.where(scatter > 0, scatter, 1.0)
        worst = np.max((values.per_scan - centre) / scatter, axis=1)
        return cls(np.sort(values.pooled), np.sort(worst), centre, scatter)

    def p_values(self, statistic: ScanStatistic, own: int) -> StatisticP:
        """p-values of the statistic; own = 1 if the residuals are the draws themselves."""
        values = statistic.oriented
        standardised = (values.per_scan - self.centre) / self.scatter
        return StatisticP(
            share_as_large(self.pooled, values.pooled, own),
            share_as_large(self.worst, standardised.max(axis=1), own),
            np.argmax(standardised, axis=1),
        )


@overload
def share_as_large(
    ascending: Float[np.ndarray, " draws"], values: Float[np.ndarray, "*shape"], own: int = 0
) -> Float[np.ndarray, "*shape"]: ...
@overload
def share_as_large(ascending: Float[np.ndarray, " draws"], values: float, own: int = 0) -> float: ...
def share_as_large(
    ascending: Float[np.ndarray, " draws"], values: Float[np.ndarray, "*shape"] | float, own: int = 0
) -> Float[np.ndarray, "*shape"] | float:
    """Share of draws, and the value itself, that are at least as large; own = 1 if it is one of the draws."""
    as_large = ascending.size - np.searchsorted(ascending, values, side="left")
    return (1 - own + as_large) / (ascending.size + 1)


def scan_statistics(
    vectors: Float[np.ndarray, "vectors points"], points: Points, policy: SearchPolicy
) -> list[ScanStatistic]:
    """All statistics of residuals, one in each row, for which the scans are long enough."""
    path = points.path
    along, scan = vectors[:, path], points.scan[path]
    starts = np.flatnonzero(np.diff(scan, prepend=-1))
    size = np.diff(np.append(starts, scan.size))
    found = []
    long = np.flatnonzero(size >= policy.shortest_scan)
    if long.size:
        runs = runs_z(along > 0, starts)
        found.append(ScanStatistic("runs", ByScan(runs.per_scan[:, long], runs.pooled), long, -1))
        q = ljung_box(along, starts, policy.ljung_box_lags)[:, long]
        found.append(ScanStatistic("ljung_box", ByScan(q, q.sum(axis=1)), long))
    graphs = {
        "neighbours": points.neighbours,
        "incidence": points.across_incidence,
        "wavelength": points.across_wavelength,
    }
    for name, graph in graphs.items():
        ordered = graph[path][:, path]
        pairs = np.add.reduceat(np.asarray(ordered.sum(axis=1)).reshape(-1), starts)
        long_enough = np.flatnonzero(pairs >= policy.shortest_scan)
        if long_enough.size:
            likeness = moran(along, ordered, scan)
            found.append(
                ScanStatistic(name, ByScan(likeness.per_scan[:, long_enough], likeness.pooled), long_enough)
            )
    return found
