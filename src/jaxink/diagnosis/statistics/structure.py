"""Whether a residual contains structure of any kind.

Chi-square tests its size. Runs, autocorrelation and spatial correlation between neighbours test its pattern,
independently of the noise level. Residuals of a fit are smaller than noise and not independent, so every
statistic is compared with noise that has passed through the same linearised fit.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.screen_options import ScreenOptions
from jaxink.diagnosis.statistics.structure_statistics import NullStatistic, scan_statistics, share_as_large
from jaxink.diagnosis.statistics.tangent_cone import TangentCone
from jaxink.display.brief import brief_repr
from jaxink.numerics.chi_square import residual_above


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
        As of `prepare_screen`.
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
        As of `prepare_structure`.
    """
    prepared = prepare_structure(jacobian, points, at_bound=at_bound, options=options, policy=policy)
    return prepared.find(residual)
