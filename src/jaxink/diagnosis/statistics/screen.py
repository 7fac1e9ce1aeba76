"""Score tests of all candidates at once, without a refit.

Near the minimum a residual is J dtheta + D s + noise: what it says of the strengths s is what is left of D
without the parameters' own part. The score is of Neyman's C(alpha) form, so the small distance of a fit from
its minimum does not count. Candidates with different null laws share one scale, their own p, and the chance
that the best of them passes a threshold is counted in one bootstrap for all.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from jaxink.diagnosis.statistics.candidate import (
    HARDLY,
    Candidate,
    ScreenedCandidate,
    ScreenOptions,
    ScreenResult,
    untestable,
)
from jaxink.diagnosis.statistics.null_law import NullLaw, admissible, tree_links
from jaxink.diagnosis.statistics.projection import Projection, TangentCone
from jaxink.errors import InputRefusedError

# With fewer scans their scatter does not tell the variance of a score.
MINIMUM_CLUSTERS = 20
_KEPT_VIEWS = 4


@dataclass(frozen=True)
class _Columns:
    """All directions of all candidates side by side."""

    directions: np.ndarray
    norm: np.ndarray
    slices: tuple[slice, ...]

    @classmethod
    def of(cls, candidates: Sequence[Candidate], rows: int) -> "_Columns":
        for candidate in candidates:
            if len(candidate.directions) != rows:
                raise InputRefusedError(
                    f"candidate {candidate.name} has {len(candidate.directions)} rows; the Jacobian "
                    f"has {rows}."
                )
        widths = [candidate.directions.shape[1] for candidate in candidates]
        ends = np.concatenate([[0], np.cumsum(widths, dtype=int)])
        stacked = np.hstack([np.zeros((rows, 0)), *(candidate.directions for candidate in candidates)])
        # A column that is not finite is one that says nothing.
        stacked = np.where(np.isfinite(stacked).all(axis=0), stacked, 0.0)
        slices = tuple(slice(int(a), int(b)) for a, b in zip(ends[:-1], ends[1:], strict=True))
        return cls(stacked, np.linalg.norm(stacked, axis=0), slices)


@dataclass(frozen=True)
class _Decision:
    """Laws of the candidates and the smallest p of each null data set, ascending."""

    laws: tuple[NullLaw | None, ...]
    critical_z: tuple[float, ...]
    smallest_p: np.ndarray

    def adjusted(self, p):
        as_small = np.searchsorted(self.smallest_p, p, side="right")
        return (1 + as_small) / (self.smallest_p.size + 1)

    def judged(self, record: ScreenedCandidate, position: int) -> ScreenedCandidate:
        """The record with its significance."""
        oriented = max(float(admissible(record.z, record.sign)), 0.0)
        p = float(self.laws[position].p_value(np.array(oriented**2)))
        critical = self.critical_z[position]
        return dataclasses.replace(
            record,
            p_raw=p,
            p_adjusted=float(self.adjusted(p)),
            critical_z=critical,
            detection_limit=critical * record.standard_error,
            detection_limits=critical * record.standard_errors,
        )


def _decide(scores, columns: _Columns, candidates, correlation, level, is_exact) -> _Decision:
    """Laws from scores of null data sets, shape (draws, columns)."""
    laws, smallest = [], np.ones(len(scores))
    for candidate, part in zip(candidates, columns.slices, strict=True):
        kept = np.flatnonzero(np.diag(correlation)[part] > 0) + part.start
        if kept.size == 0:
            laws.append(None)
            continue
        statistic = _statistic(scores[:, kept], candidate.sign)
        links = tree_links(correlation[np.ix_(kept, kept)], candidate.sign)
        draws = np.zeros(0) if is_exact and kept.size == 1 else np.sort(statistic)
        laws.append(NullLaw(candidate.sign, links, draws))
        smallest = np.minimum(smallest, laws[-1].p_value(statistic))
    smallest = np.sort(smallest)
    count = int(np.floor(level * (smallest.size + 1)))
    threshold = float(smallest[count - 1])
    critical = tuple(np.nan if law is None else law.critical(threshold) for law in laws)
    return _Decision(tuple(laws), critical, smallest)


def _statistic(scores, sign):
    """T of each row: the best admissible score, squared."""
    return np.maximum(admissible(scores, sign).max(axis=1), 0.0) ** 2


@dataclass(frozen=True)
class _View:
    """The directions as seen with some parameters on a bound free: what the others do not imitate."""

    active: np.ndarray
    projection: Projection
    unit: np.ndarray
    norm: np.ndarray

    @classmethod
    def of(cls, cone: TangentCone, columns: _Columns, active) -> "_View":
        projection = cone.projection(active)
        return cls(active, projection, *projection.unit(columns.directions))


@dataclass(frozen=True)
class PreparedScreen:
    """Candidates, tangent cone and null laws: all of a screen that does not depend on the residual.

    Make it with `prepare_screen`; many residuals of one design can then be screened at the cost of a few
    products each.

    Parameters
    ----------
    candidates, options
        As given.
    cone
        What the parameters imitate.
    """

    candidates: tuple[Candidate, ...]
    options: ScreenOptions
    cone: TangentCone
    _columns: _Columns
    _views: tuple[_View, ...]
    _decision: _Decision | None

    def screen(self, residual: Float[np.ndarray, " rows"]) -> ScreenResult:
        """Screen one residual.

        Parameters
        ----------
        residual
            Whitened measured minus predicted, rows of priors included.

        Raises
        ------
        InputRefusedError
            The residual is not finite.
        """
        _check_finite(residual)
        view = self._view(self.cone.active(residual[None, :])[0])
        score = _Score(view, view.unit.T @ residual, np.ones(view.norm.size))
        return _result(self, residual, score)

    def p_values(
        self, residuals: Float[np.ndarray, "sets rows"]
    ) -> tuple[Float[np.ndarray, "sets candidates"], Float[np.ndarray, "sets candidates"]]:
        """Significance alone, of many residuals at once: for studies of power and of false alarms.

        Parameters
        ----------
        residuals
            One row for each data set.

        Returns
        -------
        p_raw, p_adjusted
            As of `ScreenedCandidate`; nan where not testable.
        """
        scores = np.zeros((len(residuals), self._columns.norm.size))
        for active, members in self.cone.groups(residuals):
            scores[members] = residuals[members] @ self._view(active).unit
        p_raw = np.full((len(residuals), len(self.candidates)), np.nan)
        for position, (law, part) in enumerate(zip(self._decision.laws, self._columns.slices, strict=True)):
            if law is not None:
                p_raw[:, position] = law.p_value(_statistic(scores[:, part], law.sign))
        return p_raw, np.where(np.isnan(p_raw), np.nan, self._decision.adjusted(p_raw))

    def _view(self, active) -> _View:
        seen = [view for view in self._views if np.array_equal(view.active, active)]
        return seen[0] if seen else _View.of(self.cone, self._columns, active)


def _check_finite(residual) -> None:
    finite = np.isfinite(residual)
    if not finite.all():
        row = int(np.argmin(finite))
        raise InputRefusedError(f"row {row} of the residual is {residual[row]}; every row must be finite.")


def prepare_screen(
    jacobian: Float[np.ndarray, "rows parameters"],
    candidates: Sequence[Candidate],
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
) -> PreparedScreen:
    """Null laws and family-wise threshold of a screen, by a bootstrap of the linearised fit.

    Parameters
    ----------
    jacobian
        Derivatives of the whitened prediction by the parameters, rows of priors included.
    candidates
        The catalogue.
    at_bound
        -1 where a parameter sits on its lower bound or cannot be told from it, +1 on its upper, 0 inside.
        Null data sets then have it on the bound: half of them pull it inside, the others push against it.
    options
        None for the defaults.

    Raises
    ------
    InputRefusedError
        Two candidates have one name, rows differ in number, or the Jacobian is not finite.

    References
    ----------
    Rao 1948 Proc. Camb. Phil. Soc. 44, 50; Westfall, Young 1993 Resampling-Based Multiple Testing (min-p);
    Bertinelli Salucci, Kvellestad, De Bin 2025 arXiv 2509.00223 (nuisance parameter on its bound).
    """
    options = ScreenOptions() if options is None else options
    names = [candidate.name for candidate in candidates]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise InputRefusedError(f"two candidates are called '{min(twice)}'; every name must be its own.")
    cone = TangentCone.of(jacobian, at_bound)
    columns = _Columns.of(candidates, len(jacobian))
    noise = np.random.default_rng(options.seed).standard_normal((options.n_bootstrap, len(jacobian)))
    scores = np.zeros((options.n_bootstrap, columns.norm.size))
    views = []
    for active, members in cone.groups(noise):
        views.append(_View.of(cone, columns, active))
        scores[members] = noise[members] @ views[-1].unit
    # What is testable with every bound holding is the most that can be.
    unit = _View.of(cone, columns, np.zeros(cone.n_edges, bool)).unit if cone.n_edges else views[0].unit
    decision = _decide(scores, columns, candidates, unit.T @ unit, options.level, cone.n_edges == 0)
    # A view for each pattern would need much memory where many parameters sit on bounds.
    return PreparedScreen(tuple(candidates), options, cone, columns, tuple(views[:_KEPT_VIEWS]), decision)


def screen(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    candidates: Sequence[Candidate],
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    clusters: Int[np.ndarray, " rows"] | None = None,
    options: ScreenOptions | None = None,
) -> ScreenResult:
    """Score, strength, significance and detection limit of every candidate.

    Parameters
    ----------
    residual
        Whitened measured minus predicted at the minimum, followed by the rows of priors.
    jacobian, candidates, at_bound, options
        As of `prepare_screen`.
    clusters
        Only where the noise is not known: scan of each row, -1 for priors. The variance of a score is then
        its scatter over whole scans, and signs of whole scans are drawn at random instead of noise.

    Raises
    ------
    InputRefusedError
        As of `prepare_screen`, or the residual is not finite.

    References
    ----------
    Rao 1948 Proc. Camb. Phil. Soc. 44, 50; Silvey 1959 Ann. Math. Stat. 30, 389; Neyman 1959 (C(alpha)).
    Scatter over clusters: Liang, Zeger 1986 Biometrika 73, 13; Kline, Santos 2012 J. Econometr. Meth. 1, 23.
    """
    options = ScreenOptions() if options is None else options
    if clusters is None:
        prepared = prepare_screen(jacobian, candidates, at_bound=at_bound, options=options)
        return prepared.screen(residual)
    return _screen_by_clusters(residual, jacobian, candidates, at_bound, clusters, options)


def _screen_by_clusters(residual, jacobian, candidates, at_bound, clusters, options) -> ScreenResult:
    _check_finite(residual)
    columns = _Columns.of(candidates, len(jacobian))
    cone = TangentCone.of(jacobian, at_bound)
    view = _View.of(cone, columns, cone.active(residual[None, :])[0])
    labels, cluster = np.unique(clusters, return_inverse=True)
    shares = np.zeros((labels.size, view.norm.size))
    np.add.at(shares, cluster.reshape(-1), view.unit * view.projection.remove(residual)[:, None])
    deviation = np.linalg.norm(shares, axis=0)
    # A column of no information has no scatter either.
    deviation = np.where(deviation > 0, deviation, 1.0)
    decision = None
    if np.sum(labels >= 0) >= MINIMUM_CLUSTERS:
        signs = np.random.default_rng(options.seed).choice([-1.0, 1.0], (options.n_bootstrap, labels.size))
        correlation = view.unit.T @ view.unit
        decision = _decide(
            signs @ (shares / deviation), columns, candidates, correlation, options.level, False
        )
    prepared = PreparedScreen(tuple(candidates), options, cone, columns, (view,), decision)
    return _result(prepared, residual, _Score(view, view.unit.T @ residual, deviation))


@dataclass(frozen=True)
class _Score:
    """Scores along the unit directions, and their standard deviations."""

    view: _View
    value: np.ndarray
    deviation: np.ndarray


def _result(prepared: PreparedScreen, residual, score: _Score) -> ScreenResult:
    view, columns, decision = score.view, prepared._columns, prepared._decision
    records, best = [], []
    for position, (candidate, part) in enumerate(zip(prepared.candidates, columns.slices, strict=True)):
        if not np.any(view.norm[part] > 0):
            records.append(_nothing(candidate, columns.norm[part]))
            best.append(-1)
            continue
        z = np.where(view.norm[part] > 0, score.value[part] / score.deviation[part], np.nan)
        inner = int(np.nanargmax(admissible(z, candidate.sign)))
        best.append(part.start + inner)
        record = _linear_record(candidate, z, inner, score, columns.norm, part)
        records.append(record if decision is None else decision.judged(record, position))
    chosen = np.full((len(residual), len(best)), np.nan)
    for position, column in enumerate(best):
        if column >= 0:
            chosen[:, position] = view.unit[:, column]
    fitted = view.projection.remove(residual)
    held = np.zeros(prepared.cone.bounded.size, bool)
    held[prepared.cone.parameter[~view.active]] = True
    return ScreenResult(
        candidates=tuple(records),
        correlation=chosen.T @ chosen,
        options=prepared.options,
        is_significance_known=decision is not None,
        chi_square=float(fitted @ fitted),
        degrees_of_freedom=int(fitted.size - view.projection.basis.shape[1]),
        unfitted_drop=float(residual @ residual - fitted @ fitted),
        held=held,
    )


def _nothing(candidate: Candidate, norm) -> ScreenedCandidate:
    if np.any(norm > 0):
        return untestable(candidate, "the free parameters imitate it to rounding", 1.0)
    if np.isfinite(candidate.directions).all():
        return untestable(candidate, "it changes no point", np.nan)
    return untestable(candidate, "its derivative is not finite", np.nan)


def _linear_record(candidate, z, inner, score: _Score, length, part) -> ScreenedCandidate:
    """All of a record but its significance."""
    known = score.view.norm[part] > 0
    norm = np.where(known, score.view.norm[part], np.nan)
    absorbed = np.where(known, 1 - (norm / np.where(known, length[part], 1.0)) ** 2, 1.0)
    value = float(score.value[part][inner])
    return ScreenedCandidate(
        name=candidate.name,
        sign=candidate.sign,
        status="hardly_testable" if np.all(absorbed > HARDLY) else "testable",
        reason="",
        inner=inner,
        z=float(z[inner]),
        strength=value / float(norm[inner]),
        standard_error=float(score.deviation[part][inner] / norm[inner]),
        predicted_drop=value**2 if admissible(value, candidate.sign) > 0 else 0.0,
        p_raw=np.nan,
        p_adjusted=np.nan,
        absorbed_fraction=float(absorbed[inner]),
        critical_z=np.nan,
        detection_limit=np.nan,
        z_inner=z,
        standard_errors=score.deviation[part] / norm,
        detection_limits=np.full(z.shape, np.nan),
        sensitivities=score.view.norm[part],
    )
