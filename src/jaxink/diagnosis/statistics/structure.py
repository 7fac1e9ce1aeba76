"""Whether anything is left in a residual, without asking what.

Chi-square judges its size; runs, autocorrelation and the likeness of neighbours judge its order, and do so
whatever the level of the noise. A fit leaves less than pure noise and not independent noise: every
statistic is therefore compared with noise that went through the same linearised fit.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.special import chdtrc

from jaxink.diagnosis.statistics.candidate import ScreenOptions
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.projection import TangentCone
from jaxink.diagnosis.statistics.serial_correlation import ljung_box, moran, runs_z

# Shorter scans have no order to speak of.
_SHORTEST_SCAN = 8


@dataclass(frozen=True)
class StructureStatistic:
    """One way of finding structure.

    Parameters
    ----------
    name
        ``chi_square``, ``runs``, ``ljung_box``, ``neighbours``, ``incidence`` or ``wavelength``.
    value
        Over all scans: chi-square; z of the runs, negative for too few; sum of Ljung-Box Q; Moran's I.
    p_value
        Chance of as much where there is noise alone.
    worst_scan
        Number of the scan in which it stands out most, -1 where scans are not looked at.
    worst_value
        Its value in that scan; nan for none.
    worst_p_value
        Chance that any scan stands out as much; nan for none.
    """

    name: str
    value: float
    p_value: float
    worst_scan: int
    worst_value: float
    worst_p_value: float


@dataclass(frozen=True)
class StructureResult:
    """What is left in a residual.

    Parameters
    ----------
    statistics
        One record each; those for which the data have no neighbours are absent.
    p_value
        Chance that the most telling of all, over all scans or in its worst scan, tells as much of noise.
    leading
        Name of the most telling.
    chi_square, degrees_of_freedom
        Of the residual that the parameters leave, rows of priors included.
    """

    statistics: tuple[StructureStatistic, ...]
    p_value: float
    leading: str
    chi_square: float
    degrees_of_freedom: int

    def __getitem__(self, name: str) -> StructureStatistic:
        return next(statistic for statistic in self.statistics if statistic.name == name)


@dataclass(frozen=True)
class _Null:
    """One statistic of noise that went through the fit."""

    pooled: np.ndarray
    worst: np.ndarray
    centre: np.ndarray
    scatter: np.ndarray

    @classmethod
    def of(cls, statistic: "_Statistic") -> "_Null":
        pooled, per_scan = statistic.oriented
        centre, scatter = per_scan.mean(axis=0), per_scan.std(axis=0)
        scatter = np.where(scatter > 0, scatter, 1.0)
        worst = np.max((per_scan - centre) / scatter, axis=1)
        return cls(np.sort(pooled), np.sort(worst), centre, scatter)

    def p_values(self, statistic: "_Statistic", own: int):
        """Of all scans together and of the worst scan, and which that is; own = 1 for one of the draws."""
        pooled, per_scan = statistic.oriented
        standardised = (per_scan - self.centre) / self.scatter
        worst = np.argmax(standardised, axis=1)
        return (
            _p_value(self.pooled, pooled, own),
            _p_value(self.worst, standardised.max(axis=1), own),
            worst,
        )


def _p_value(ascending, values, own=0):
    """Share of draws and the value itself that are as large; own = 1 where it is among the draws."""
    as_large = ascending.size - np.searchsorted(ascending, values, side="left")
    return (1 - own + as_large) / (ascending.size + 1)


@dataclass(frozen=True)
class PreparedStructure:
    """Tests of structure with their null laws, for any residual of one design; see `prepare_structure`.

    Parameters
    ----------
    cone
        What the parameters imitate.
    points
        Where the points lie.
    is_noise_known
        Whether chi-square takes part.
    """

    cone: TangentCone
    points: Points
    is_noise_known: bool
    _square: np.ndarray
    _nulls: tuple[_Null, ...]
    _smallest: np.ndarray

    def find(self, residual: Float[np.ndarray, " rows"]) -> StructureResult:
        """Test one residual.

        Parameters
        ----------
        residual
            Whitened measured minus predicted: the points, then the rows of priors.
        """
        projection = self.cone.projection(self.cone.active(residual[None, :])[0])
        left = projection.remove(residual)
        square, freedom = float(left @ left), left.size - projection.basis.shape[1]
        if self.cone.n_edges == 0:
            p_square = float(chdtrc(freedom, square))
        else:
            p_square = float(_p_value(self._square, square))
        records = [StructureStatistic("chi_square", square, p_square, -1, np.nan, np.nan)]
        found = [("chi_square", p_square)] if self.is_noise_known else []
        observed = _statistics(left[None, : len(self.points)], self.points)
        for statistic, null in zip(observed, self._nulls, strict=True):
            p_pooled, p_worst, worst = (float(value[0]) for value in null.p_values(statistic, 0))
            at = int(worst)
            found += [(statistic.name, p_pooled), (statistic.name, p_worst)]
            records.append(
                StructureStatistic(
                    statistic.name,
                    float(statistic.pooled[0]),
                    p_pooled,
                    int(statistic.scans[at]),
                    float(statistic.per_scan[0, at]),
                    p_worst,
                )
            )
        if not found:
            return StructureResult(tuple(records), 1.0, "", square, freedom)
        leading, smallest = min(found, key=lambda entry: entry[1])
        as_small = np.searchsorted(self._smallest, smallest, side="right")
        p_value = float((1 + as_small) / (self._smallest.size + 1))
        return StructureResult(tuple(records), p_value, leading, square, freedom)


def prepare_structure(
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    is_noise_known: bool = True,
    options: ScreenOptions | None = None,
) -> PreparedStructure:
    """Null laws of all tests of structure, by a bootstrap of the linearised fit.

    Parameters
    ----------
    jacobian, at_bound
        As of `prepare_screen`.
    points
        Where the points lie; further rows of the Jacobian belong to priors.
    is_noise_known
        False leaves chi-square out of the common p.
    options
        Number of draws and seed; None for the defaults.

    References
    ----------
    Westfall, Young 1993 Resampling-Based Multiple Testing (min-p).
    """
    options = ScreenOptions() if options is None else options
    cone = TangentCone.of(jacobian, at_bound)
    noise = np.random.default_rng(options.seed).standard_normal((options.n_bootstrap, len(jacobian)))
    vectors = cone.residuals(noise)
    square = np.sum(vectors**2, axis=1)
    ascending = np.sort(square)
    if cone.n_edges == 0:
        p_square = chdtrc(len(jacobian) - cone.basis.shape[1], square)
    else:
        p_square = _p_value(ascending, square, 1)
    smallest = p_square if is_noise_known else np.ones(len(vectors))
    nulls = []
    for statistic in _statistics(vectors[:, : len(points)], points):
        nulls.append(_Null.of(statistic))
        p_pooled, p_worst, _ = nulls[-1].p_values(statistic, 1)
        smallest = np.minimum(smallest, np.minimum(p_pooled, p_worst))
    return PreparedStructure(cone, points, is_noise_known, ascending, tuple(nulls), np.sort(smallest))


def find_structure(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    is_noise_known: bool = True,
    options: ScreenOptions | None = None,
) -> StructureResult:
    """All tests of a residual, and one p for them together.

    Parameters
    ----------
    residual
        Whitened measured minus predicted at the minimum: the points, then the rows of priors.
    jacobian, points, at_bound, is_noise_known, options
        As of `prepare_structure`.
    """
    prepared = prepare_structure(
        jacobian, points, at_bound=at_bound, is_noise_known=is_noise_known, options=options
    )
    return prepared.find(residual)


@dataclass(frozen=True)
class _Statistic:
    """One measure of order of several residuals, over all scans and by scan."""

    name: str
    pooled: np.ndarray
    per_scan: np.ndarray
    scans: np.ndarray
    side: int = 1

    @property
    def oriented(self):
        """Such that large values tell of structure."""
        return self.side * self.pooled, self.side * self.per_scan


def _statistics(vectors, points: Points) -> list[_Statistic]:
    path = points.path
    along, scan = vectors[:, path], points.scan[path]
    starts = np.flatnonzero(np.diff(scan, prepend=-1))
    size = np.diff(np.append(starts, scan.size))
    found = []
    long = np.flatnonzero(size >= _SHORTEST_SCAN)
    if long.size:
        per_scan, pooled = runs_z(along > 0, starts)
        found.append(_Statistic("runs", pooled, per_scan[:, long], long, -1))
        q = ljung_box(along, starts)[:, long]
        found.append(_Statistic("ljung_box", q.sum(axis=1), q, long))
    graphs = {
        "neighbours": points.neighbours,
        "incidence": points.across_incidence,
        "wavelength": points.across_wavelength,
    }
    for name, graph in graphs.items():
        ordered = graph[path][:, path]
        pairs = np.add.reduceat(np.asarray(ordered.sum(axis=1)).reshape(-1), starts)
        told = np.flatnonzero(pairs >= _SHORTEST_SCAN)
        if told.size:
            per_scan, pooled = moran(along, ordered, scan)
            found.append(_Statistic(name, pooled, per_scan[:, told], told))
    return found
