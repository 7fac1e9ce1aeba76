"""Score tests of all candidates at once, without refits.

Near the minimum a residual is J dtheta + D s + noise; it constrains the strengths s through the part of D
that is orthogonal to J. The score has Neyman's C(alpha) form, so a small distance of the fit from its minimum
does not matter.

Significance of each candidate of a screen, and of the best one.

Candidates with different null laws are compared by their own p; one bootstrap for all gives the probability
that the best of them passes a threshold (Westfall-Young).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import ndtr, ndtri, stdtr, stdtrit

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.statistics.candidate import (
    Candidate,
    ScreenedCandidate,
    ScreenOptions,
    ScreenResult,
    Testability,
)
from jaxink.diagnosis.statistics.null_law import NullLaw, admissible, tree_links
from jaxink.diagnosis.statistics.projection import UnitColumns
from jaxink.diagnosis.statistics.tangent_cone import TangentCone
from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError

_KEPT_VIEWS = 4


@dataclass(frozen=True)
class Significance:
    """Null laws and thresholds of all candidates.

    Parameters
    ----------
    laws
        Of the testable candidates, by position.
    critical_z
        |z| at which each is detected; nan if not testable.
    smallest_p
        Smallest p of all candidates in each null data set, ascending.
    noise_freedom
        Degrees of freedom of an estimated noise: scores then follow Student's t, and are replaced by the
        normal deviates of equal probability.
    """

    laws: dict[int, NullLaw]
    critical_z: tuple[float, ...]
    smallest_p: Float[np.ndarray, " draws"]
    noise_freedom: float = np.inf

    @classmethod
    def of(
        cls,
        scores: Float[np.ndarray, "draws columns"],
        slices: Sequence[slice],
        candidates: Sequence[Candidate],
        correlation: Float[np.ndarray, "columns columns"],
        level: float,
        is_exact: bool,
        noise_freedom: float = np.inf,
    ) -> "Significance":
        """Laws from the scores of null data sets along the columns of all candidates.

        The correlation of the columns has 0 on the diagonal for untestable ones; `is_exact` means that no
        parameter is at a bound, so that a single column needs no draws.
        """
        laws: dict[int, NullLaw] = {}
        smallest = np.ones(len(scores))
        for position, (candidate, part) in enumerate(zip(candidates, slices, strict=True)):
            kept = np.flatnonzero(np.diag(correlation)[part] > 0) + part.start
            if kept.size == 0:
                continue
            statistic = best_admissible(scores[:, kept], candidate.sign)
            links = tree_links(correlation[np.ix_(kept, kept)], candidate.sign)
            draws = np.zeros(0) if is_exact and kept.size == 1 else np.sort(statistic)
            laws[position] = NullLaw(candidate.sign, links, draws)
            smallest = np.minimum(smallest, laws[position].p_value(statistic))
        smallest = np.sort(smallest)
        count = int(np.floor(level * (smallest.size + 1)))
        threshold = float(smallest[count - 1])
        critical = tuple(
            _student(laws[k].critical(threshold), noise_freedom) if k in laws else np.nan
            for k in range(len(candidates))
        )
        return cls(laws, critical, smallest, noise_freedom)

    def adjusted(self, p: Float[np.ndarray, "*shape"] | float) -> Float[np.ndarray, "*shape"] | float:
        """Family-wise adjusted p: probability that any candidate has a p this small if none is present."""
        as_small = np.searchsorted(self.smallest_p, p, side="right")
        return (1 + as_small) / (self.smallest_p.size + 1)

    def p_raw(self, position: int, z: float) -> float:
        """Probability that noise alone gives the candidate at a position a score this large."""
        law = self.laws[position]
        oriented = max(float(admissible(z, law.sign)), 0.0)
        return float(self.p_values(law, np.array(oriented**2)))

    def p_values(
        self, law: NullLaw, statistic: Float[np.ndarray, "*shape"]
    ) -> Float[np.ndarray, "*shape"] | float:
        """Probabilities of best admissible scores, squared, of one candidate."""
        if np.isfinite(self.noise_freedom):
            statistic = ndtri(stdtr(self.noise_freedom, -np.sqrt(statistic))) ** 2
        return law.p_value(statistic)


def _student(z: float, freedom: float) -> float:
    """The deviate of Student's t whose probability is that of a normal one."""
    return float(-stdtrit(freedom, ndtr(-z))) if np.isfinite(freedom) else z


def best_admissible(scores: Float[np.ndarray, "sets columns"], sign: int) -> Float[np.ndarray, " sets"]:
    """T of each row: the best admissible score, squared."""
    return np.maximum(admissible(scores, sign).max(axis=1), 0.0) ** 2


@dataclass(frozen=True)
class _Columns:
    """All directions of all candidates side by side."""

    directions: Float[np.ndarray, "rows columns"]
    norm: Float[np.ndarray, " columns"]
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
        # A column that is not finite carries no information.
        stacked = np.where(np.isfinite(stacked).all(axis=0), stacked, 0.0)
        slices = tuple(slice(int(a), int(b)) for a, b in zip(ends[:-1], ends[1:], strict=True))
        return cls(stacked, np.linalg.norm(stacked, axis=0), slices)


@dataclass(frozen=True)
class _View:
    """The directions after projection, with some of the parameters at a bound treated as free."""

    active: Bool[np.ndarray, " edges"]
    left: UnitColumns

    @classmethod
    def of(cls, cone: TangentCone, columns: _Columns, active) -> "_View":
        return cls(active, cone.projection(active).unit(columns.directions))


@dataclass(frozen=True)
class PValues:
    """Significance of all candidates in many residuals, as in `ScreenedCandidate`; nan if not testable."""

    raw: Float[np.ndarray, "sets candidates"]
    adjusted: Float[np.ndarray, "sets candidates"]


@dataclass(frozen=True)
class PreparedScreen:
    """Candidates, tangent cone and null laws: everything in a screen that does not depend on the residual.

    Made by `prepare_screen`; many residuals of one design can then be screened with a few products each.
    """

    __repr__ = brief_repr

    candidates: tuple[Candidate, ...]
    options: ScreenOptions
    policy: SearchPolicy
    cone: TangentCone
    _columns: _Columns
    _views: tuple[_View, ...]
    _significance: Significance

    def screen(self, residual: Float[np.ndarray, " rows"]) -> ScreenResult:
        """Screen one residual: whitened measured minus predicted, followed by the rows of priors.

        Raises
        ------
        InputRefusedError
            The residual is not finite.
        """
        finite = np.isfinite(residual)
        if not finite.all():
            row = int(np.argmin(finite))
            raise InputRefusedError(
                f"row {row} of the residual is {residual[row]}; every row must be finite."
            )
        left = self._view(self.cone.active(residual[None, :])[0]).left
        value = left.unit.T @ residual
        records = []
        for position, part in enumerate(self._columns.slices):
            length = self._columns.norm[part]
            if np.any(left.norm[part] > 0):
                records.append(self._record(position, value[part], left.norm[part], length))
            else:
                records.append(_untestable(self.candidates[position], length))
        return ScreenResult(tuple(records), self.options)

    def p_values(self, residuals: Float[np.ndarray, "sets rows"]) -> PValues:
        """Significance for many residuals at once, for studies of power and false alarms."""
        scores = np.zeros((len(residuals), self._columns.norm.size))
        for active, members in self.cone.groups(residuals):
            scores[members] = residuals[members] @ self._view(active).left.unit
        raw = np.full((len(residuals), len(self.candidates)), np.nan)
        for position, part in enumerate(self._columns.slices):
            law = self._significance.laws.get(position)
            if law is not None:
                best = best_admissible(scores[:, part], law.sign)
                raw[:, position] = self._significance.p_values(law, best)
        return PValues(raw, np.where(np.isnan(raw), np.nan, self._significance.adjusted(raw)))

    def _view(self, active) -> _View:
        seen = [view for view in self._views if np.array_equal(view.active, active)]
        return seen[0] if seen else _View.of(self.cone, self._columns, active)

    def _record(self, position: int, value, left_norm, length) -> ScreenedCandidate:
        """Record of a testable candidate from the scores and norms of its columns."""
        candidate, known = self.candidates[position], left_norm > 0
        norm = np.where(known, left_norm, np.nan)
        inner = int(np.nanargmax(admissible(np.where(known, value, np.nan), candidate.sign)))
        degenerate = np.where(known, 1 - (norm / np.where(known, length, 1.0)) ** 2, 1.0)
        z, is_hardly = float(value[inner]), bool(np.all(degenerate > self.policy.largest_degenerate_fraction))
        p_raw = self._significance.p_raw(position, z)
        return ScreenedCandidate(
            name=candidate.name,
            status=Testability.HARDLY if is_hardly else Testability.TESTABLE,
            degenerate_fraction=float(degenerate[inner]),
            standard_errors=1.0 / norm,
            inner=inner,
            z=z,
            strength=z / float(norm[inner]),
            predicted_delta_chi_square=z**2 if admissible(z, candidate.sign) > 0 else 0.0,
            p_raw=p_raw,
            p_adjusted=float(self._significance.adjusted(p_raw)),
            critical_z=self._significance.critical_z[position],
        )


def _untestable(candidate: Candidate, length) -> ScreenedCandidate:
    """Record of a candidate that these data cannot test."""
    degenerate = 1.0 if np.any(length > 0) else np.nan
    if np.any(length > 0):
        reason = "it is degenerate with the free parameters"
    elif np.isfinite(candidate.directions).all():
        reason = "it changes no point"
    else:
        reason = "its derivative is not finite"
    nothing = np.full(candidate.directions.shape[1], np.nan)
    return ScreenedCandidate(candidate.name, Testability.NOT, degenerate, nothing, reason=reason)


def prepare_screen(
    jacobian: Float[np.ndarray, "rows parameters"],
    candidates: Sequence[Candidate],
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
    policy: SearchPolicy = DEFAULT_POLICY,
) -> PreparedScreen:
    """Null laws and family-wise threshold of a screen, by a bootstrap of the linearised fit.

    Parameters
    ----------
    jacobian
        Derivatives of the whitened prediction with respect to the parameters, including rows of priors.
    candidates
        The catalogue.
    at_bound
        -1 for a parameter at its lower bound or indistinguishable from it, +1 at its upper bound, 0 inside.
        In null data sets such a parameter is at the bound: half of them pull it inside, the others push
        against the bound.
    options
        None for the defaults.
    policy
        When a candidate is hardly testable.

    Raises
    ------
    InputRefusedError
        Two candidates have the same name, numbers of rows differ, or the Jacobian is not finite.

    References
    ----------
    Rao 1948 Proc. Camb. Phil. Soc. 44, 50; Westfall, Young 1993 Resampling-Based Multiple Testing (min-p);
    Bertinelli Salucci, Kvellestad, De Bin 2025 arXiv 2509.00223 (nuisance parameter at its bound).
    """
    options = ScreenOptions() if options is None else options
    names = [candidate.name for candidate in candidates]
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise InputRefusedError(f"two candidates have the name '{min(twice)}'; names must be unique.")
    cone = TangentCone.of(jacobian, at_bound)
    columns = _Columns.of(candidates, len(jacobian))
    noise = np.random.default_rng(options.seed).standard_normal((options.n_bootstrap, len(jacobian)))
    scores = np.zeros((options.n_bootstrap, columns.norm.size))
    views = []
    for active, members in cone.groups(noise):
        views.append(_View.of(cone, columns, active))
        scores[members] = noise[members] @ views[-1].left.unit
    # If every bound holds, as many candidates as possible are testable.
    most = _View.of(cone, columns, np.zeros(cone.n_edges, bool)) if cone.n_edges else views[0]
    correlation = most.left.unit.T @ most.left.unit
    significance = Significance.of(
        scores,
        columns.slices,
        candidates,
        correlation,
        options.level,
        is_exact=cone.n_edges == 0,
        noise_freedom=options.noise_freedom,
    )
    # Storing a view for each pattern would need much memory if many parameters are at bounds.
    kept = tuple(views[:_KEPT_VIEWS])
    return PreparedScreen(tuple(candidates), options, policy, cone, columns, kept, significance)


def screen(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    candidates: Sequence[Candidate],
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
    policy: SearchPolicy = DEFAULT_POLICY,
) -> ScreenResult:
    """Score, strength, significance and detection limit of every candidate.

    Parameters
    ----------
    residual
        Whitened measured minus predicted at the minimum, followed by the rows of priors.
    jacobian, candidates, at_bound, options, policy
        See `prepare_screen`.

    Raises
    ------
    InputRefusedError
        See `prepare_screen`, or the residual is not finite.

    References
    ----------
    Rao 1948 Proc. Camb. Phil. Soc. 44, 50; Silvey 1959 Ann. Math. Stat. 30, 389; Neyman 1959 (C(alpha)).
    """
    prepared = prepare_screen(jacobian, candidates, at_bound=at_bound, options=options, policy=policy)
    return prepared.screen(residual)
