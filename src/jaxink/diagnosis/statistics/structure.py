"""Whether a residual contains structure of any kind.

Chi-square tests its size. Runs, autocorrelation and spatial correlation between neighbours test its pattern,
independently of the noise level. Residuals of a fit are smaller than noise and not independent, so every
statistic is compared with noise that has passed through the same linearised fit.
"""

from dataclasses import dataclass
from typing import overload

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import csr_array

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.statistics.candidate import ScreenOptions
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.tangent_cone import TangentCone
from jaxink.display.brief import brief_repr
from jaxink.numerics.chi_square import residual_above


@dataclass(frozen=True)
class ByScan:
    """A statistic of several residuals, in each scan and over all scans."""

    per_scan: Float[np.ndarray, "vectors scans"]
    pooled: Float[np.ndarray, " vectors"]


def runs_z(signs_positive: Bool[np.ndarray, "vectors points"], starts: Int[np.ndarray, " scans"]) -> ByScan:
    """Number of runs of one sign, in standard deviations from its mean given the signs.

    Negative for too few runs; 0 for a scan with a single sign.

    Parameters
    ----------
    signs_positive
        True for positive residuals, in the order along the scans.
    starts
        First index of each scan.

    References
    ----------
    Wald, Wolfowitz 1940 Ann. Math. Stat. 11, 147.
    """
    size = np.diff(np.append(starts, signs_positive.shape[1]))
    changes = np.zeros(signs_positive.shape)
    changes[:, 1:] = signs_positive[:, 1:] != signs_positive[:, :-1]
    # The first point of a scan always begins a run.
    changes[:, starts] = 1
    runs = np.add.reduceat(changes, starts, axis=1)
    positive = np.add.reduceat(signs_positive.astype(float), starts, axis=1)
    mean = 2 * positive * (size - positive) / size + 1
    variance = (mean - 1) * (mean - 2) / np.maximum(size - 1, 1)
    excess = np.where(variance > 0, runs - mean, 0.0)
    per_scan = excess / np.sqrt(np.where(variance > 0, variance, 1.0))
    total = np.sum(variance, axis=1)
    return ByScan(per_scan, np.sum(excess, axis=1) / np.sqrt(np.where(total > 0, total, 1.0)))


def ljung_box(
    residuals: Float[np.ndarray, "vectors points"], starts: Int[np.ndarray, " scans"], lags: int
) -> Float[np.ndarray, "vectors scans"]:
    """Ljung-Box Q of each scan, about zero and not about the mean: an offset is structure too.

    Parameters
    ----------
    residuals
        In the order along the scans.
    starts
        First index of each scan.
    lags
        Largest lag; in a scan of n points at most n - 1.

    References
    ----------
    Ljung, Box 1978 Biometrika 65, 297.
    """
    ends = np.append(starts[1:], residuals.shape[1])
    q = np.zeros((len(residuals), starts.size))
    for scan, (start, end) in enumerate(zip(starts, ends, strict=True)):
        here, size = residuals[:, start:end], int(end - start)
        power = np.einsum("ij,ij->i", here, here)
        power = np.where(power > 0, power, 1.0)
        for lag in range(1, min(lags, size - 1) + 1):
            rho = np.einsum("ij,ij->i", here[:, lag:], here[:, :-lag]) / power
            q[:, scan] += size * (size + 2) * rho**2 / (size - lag)
    return q


def moran(
    residuals: Float[np.ndarray, "vectors points"], graph: csr_array, scan: Int[np.ndarray, " points"]
) -> ByScan:
    """Moran's I, about zero: mean of r_i r_j over pairs of neighbours, divided by the mean square.

    Parameters
    ----------
    residuals
        One row for each vector.
    graph
        Sparse matrix with 1 for each pair of neighbours, each pair once.
    scan
        Scan of each point, ascending; a pair counts for the scan of its row.

    References
    ----------
    Moran 1950 Biometrika 37, 17.
    """
    starts = np.flatnonzero(np.diff(scan, prepend=-1))
    products = residuals * (graph @ residuals.T).T
    pairs = np.add.reduceat(np.asarray(graph.sum(axis=1)).reshape(-1), starts)
    size = np.diff(np.append(starts, scan.size))
    square = np.add.reduceat(residuals**2, starts, axis=1)
    each = np.add.reduceat(products, starts, axis=1)
    mean_square = square / size
    per_scan = each / np.maximum(pairs, 1) / np.where(mean_square > 0, mean_square, 1.0)
    overall = np.sum(square, axis=1) / scan.size
    pooled = np.sum(each, axis=1) / max(pairs.sum(), 1) / np.where(overall > 0, overall, 1.0)
    return ByScan(per_scan, pooled)


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


@dataclass(frozen=True)
class StructureStatistic:
    """One test for structure.

    Parameters
    ----------
    name
        ``chi_square``, ``runs``, ``ljung_box``, ``neighbours``, ``incidence`` or ``wavelength``.
    value
        Over all scans: chi-square; z of the runs, negative for too few; sum of Ljung-Box Q; Moran's I.
    p_value
        Probability of at least this value for pure noise.
    worst_scan
        Number of the most significant scan, -1 if scans are not tested.
    worst_p_value
        Probability that any scan is this significant; nan if scans are not tested.
    """

    name: str
    value: float
    p_value: float
    worst_scan: int
    worst_p_value: float

    @property
    def smallest_p(self) -> float:
        """The smaller of both p-values."""
        return float(np.fmin(self.p_value, self.worst_p_value))


@dataclass(frozen=True)
class StructureResult:
    """Tests for structure in a residual.

    Parameters
    ----------
    statistics
        One record each; tests for which the data have no neighbours are absent.
    p_value
        Family-wise p: probability that the most significant test, over all scans or in its worst scan, is
        this significant for pure noise.
    leading
        Name of the most significant test.
    chi_square, degrees_of_freedom
        Of the residual after projection off the parameters, including rows of priors.
    """

    __repr__ = brief_repr

    statistics: tuple[StructureStatistic, ...]
    p_value: float
    leading: str
    chi_square: float
    degrees_of_freedom: int

    def __getitem__(self, name: str) -> StructureStatistic:
        return next(statistic for statistic in self.statistics if statistic.name == name)


@dataclass(frozen=True)
class PreparedStructure:
    """Tests for structure with null laws, for any residual of one design; made by `prepare_structure`."""

    __repr__ = brief_repr

    cone: TangentCone
    points: Points
    policy: SearchPolicy
    noise_freedom: float
    _square: Float[np.ndarray, " draws"]
    _nulls: tuple[NullStatistic, ...]
    _smallest: Float[np.ndarray, " draws"]

    def find(self, residual: Float[np.ndarray, " rows"]) -> StructureResult:
        """Test one residual: whitened measured minus predicted, the points, then the rows of priors."""
        projection = self.cone.projection(self.cone.active(residual[None, :])[0])
        left = projection.remove(residual)
        square, freedom = float(left @ left), left.size - projection.basis.shape[1]
        if self.cone.n_edges == 0:
            p_square = float(residual_above(square, freedom, self.noise_freedom))
        else:
            p_square = float(share_as_large(self._square, square))
        records = [StructureStatistic("chi_square", square, p_square, -1, np.nan)]
        observed = scan_statistics(left[None, : len(self.points)], self.points, self.policy)
        for statistic, null in zip(observed, self._nulls, strict=True):
            p = null.p_values(statistic, 0)
            value, worst = float(statistic.values.pooled[0]), int(statistic.scans[p.worst_scan[0]])
            records.append(
                StructureStatistic(statistic.name, value, float(p.pooled[0]), worst, float(p.worst[0]))
            )
        leading = min(records, key=lambda record: record.smallest_p)
        as_small = np.searchsorted(self._smallest, leading.smallest_p, side="right")
        p_value = float((1 + as_small) / (self._smallest.size + 1))
        return StructureResult(tuple(records), p_value, leading.name, square, freedom)


def prepare_structure(
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
    policy: SearchPolicy = DEFAULT_POLICY,
) -> PreparedStructure:
    """Null laws of all tests for structure, by a bootstrap of the linearised fit.

    Parameters
    ----------
    jacobian, at_bound
        See `prepare_screen`.
    points
        Settings of the points; further rows of the Jacobian belong to priors.
    options
        Number of draws, seed and degrees of freedom of the noise; None for the defaults.
    policy
        Thresholds of the tests.

    References
    ----------
    Westfall, Young 1993 Resampling-Based Multiple Testing (min-p).
    """
    options = ScreenOptions() if options is None else options
    cone = TangentCone.of(jacobian, at_bound)
    known = options.noise_freedom
    vectors = cone.residuals(options.noise(len(jacobian)))
    square = np.sum(vectors**2, axis=1)
    ascending = np.sort(square)
    if cone.n_edges == 0:
        smallest = residual_above(square, len(jacobian) - cone.basis.shape[1], known)
    else:
        smallest = share_as_large(ascending, square, 1)
    nulls = []
    for statistic in scan_statistics(vectors[:, : len(points)], points, policy):
        nulls.append(NullStatistic.of(statistic))
        p = nulls[-1].p_values(statistic, 1)
        smallest = np.minimum(smallest, np.minimum(p.pooled, p.worst))
    return PreparedStructure(cone, points, policy, known, ascending, tuple(nulls), np.sort(smallest))


def find_structure(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
    policy: SearchPolicy = DEFAULT_POLICY,
) -> StructureResult:
    """All tests of a residual, and their family-wise p.

    Parameters
    ----------
    residual
        Whitened measured minus predicted at the minimum: the points, then the rows of priors.
    jacobian, points, at_bound, options, policy
        See `prepare_structure`.
    """
    prepared = prepare_structure(jacobian, points, at_bound=at_bound, options=options, policy=policy)
    return prepared.find(residual)
