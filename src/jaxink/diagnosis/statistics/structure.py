"""Whether anything is left in a residual, without asking what.

Chi-square judges its size; runs, autocorrelation and the likeness of neighbours judge its order, and do so
whatever the level of the noise. A fit leaves less than pure noise and not independent noise: every
statistic is therefore compared with noise that went through the same linearised fit.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.special import chdtrc

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.screen_options import ScreenOptions
from jaxink.diagnosis.statistics.structure_statistics import NullStatistic, scan_statistics, share_as_large
from jaxink.diagnosis.statistics.tangent_cone import TangentCone


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
    worst_p_value
        Chance that any scan stands out as much; nan for none.
    """

    name: str
    value: float
    p_value: float
    worst_scan: int
    worst_p_value: float

    @property
    def smallest_p(self) -> float:
        """Of all scans together, or of the worst one."""
        return float(np.fmin(self.p_value, self.worst_p_value))


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
class PreparedStructure:
    """Tests of structure with their null laws, for any residual of one design; see `prepare_structure`.

    Parameters
    ----------
    cone
        What the parameters imitate.
    points
        Where the points lie.
    policy
        What has an order to test.
    """

    cone: TangentCone
    points: Points
    policy: SearchPolicy
    _square: Float[np.ndarray, " draws"]
    _nulls: tuple[NullStatistic, ...]
    _smallest: Float[np.ndarray, " draws"]

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
    """Null laws of all tests of structure, by a bootstrap of the linearised fit.

    Parameters
    ----------
    jacobian, at_bound
        As of `prepare_screen`.
    points
        Where the points lie; further rows of the Jacobian belong to priors.
    options
        Number of draws and seed; None for the defaults.
    policy
        What has an order to test.

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
        smallest = chdtrc(len(jacobian) - cone.basis.shape[1], square)
    else:
        smallest = share_as_large(ascending, square, 1)
    nulls = []
    for statistic in scan_statistics(vectors[:, : len(points)], points, policy):
        nulls.append(NullStatistic.of(statistic))
        p = nulls[-1].p_values(statistic, 1)
        smallest = np.minimum(smallest, np.minimum(p.pooled, p.worst))
    return PreparedStructure(cone, points, policy, ascending, tuple(nulls), np.sort(smallest))


def find_structure(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    points: Points,
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
    policy: SearchPolicy = DEFAULT_POLICY,
) -> StructureResult:
    """All tests of a residual, and one p for them together.

    Parameters
    ----------
    residual
        Whitened measured minus predicted at the minimum: the points, then the rows of priors.
    jacobian, points, at_bound, options, policy
        As of `prepare_structure`.
    """
    prepared = prepare_structure(jacobian, points, at_bound=at_bound, options=options, policy=policy)
    return prepared.find(residual)
