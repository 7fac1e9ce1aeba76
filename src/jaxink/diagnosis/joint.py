"""Several effects together: what they explain jointly, and which of them imitate another."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float, Int

from jaxink.diagnosis.candidate import ScreenedCandidate, ScreenOptions, ScreenResult
from jaxink.diagnosis.projection import TangentCone

# A third direction adds nothing to two whose cosine is this close to 1.
_PARALLEL = 1e-9


@dataclass(frozen=True)
class JointDrop:
    """Predicted fall of chi-square by several strengths at once.

    Parameters
    ----------
    drop
        Below the minimum of the parameters alone.
    strengths
        One step from zero, within their signs.
    standard_errors
        With the parameters and the other strengths free that are not 0; nan for those that are.
    p_value
        Chance of such a drop where none is present (chi-bar-square), by simulation.
    """

    drop: float
    strengths: Float[np.ndarray, " strengths"]
    standard_errors: Float[np.ndarray, " strengths"]
    p_value: float


def joint_drop(
    residual: Float[np.ndarray, " rows"],
    jacobian: Float[np.ndarray, "rows parameters"],
    directions: Float[np.ndarray, "rows strengths"],
    signs: Int[np.ndarray, " strengths"],
    *,
    at_bound: Int[np.ndarray, " parameters"] | None = None,
    options: ScreenOptions | None = None,
) -> JointDrop:
    """Least squares of several strengths and all parameters, linearised, within their signs.

    A strength of one sign is a parameter that sits on its bound at 0; so parameters on bounds of their own
    are treated alike.

    Parameters
    ----------
    residual, jacobian, at_bound
        As of `screen`.
    directions
        Derivatives by the strengths.
    signs
        +1, -1 or 0 for each strength.
    options
        Number of draws and seed; None for the defaults.

    References
    ----------
    Self, Liang 1987 JASA 82, 605; Shapiro 1988 Int. Stat. Rev. 56, 49 (chi-bar-square).
    """
    options = ScreenOptions() if options is None else options
    bound = np.zeros(jacobian.shape[1], int) if at_bound is None else at_bound
    columns = np.hstack([jacobian, directions])
    # Nothing outside the span of all columns takes part, so the rows are few from here on.
    rotation, columns = np.linalg.qr(columns)
    small = TangentCone.of(columns[:, : bound.size], bound)
    large = TangentCone.of(columns, np.concatenate([bound, -signs]))
    noise = np.random.default_rng(options.seed).standard_normal((options.n_bootstrap, len(columns)))
    vectors = np.vstack([rotation.T @ residual, noise])
    drops = _fall(large, vectors) - _fall(small, vectors)
    strengths, errors = _solution(large, columns, vectors[0], bound.size)
    # Draws in which no strength is admissible fall by nothing but rounding.
    drop = float(drops[0]) if drops[0] > 1e-9 * max(float(vectors[0] @ vectors[0]), 1e-300) else 0.0
    as_large = int(np.sum(drops[1:] >= drop)) if drop > 0 else options.n_bootstrap
    return JointDrop(drop, strengths, errors, (1 + as_large) / (1 + options.n_bootstrap))


def _fall(cone: TangentCone, vectors):
    return np.sum((vectors @ cone.basis) ** 2, axis=1) + cone.fit(vectors).drop


def _solution(cone: TangentCone, columns, vector, n_parameters):
    """Strengths of the fit and their standard errors."""
    held = cone.bounded.copy()
    held[cone.parameter[cone.fit(vector[None, :]).active[0]]] = False
    free = np.flatnonzero(~held)
    norm = np.linalg.norm(columns[:, free], axis=0)
    norm = np.where(norm > 0, norm, 1.0)
    inverse = np.linalg.pinv(columns[:, free] / norm, rcond=1e-9) / norm[:, None]
    values, errors = np.zeros(columns.shape[1]), np.full(columns.shape[1], np.nan)
    values[free] = inverse @ vector
    errors[free] = np.linalg.norm(inverse, axis=1)
    return values[n_parameters:], errors[n_parameters:]


@dataclass(frozen=True)
class ImitatingPair:
    """Two effects that together look like a third.

    Parameters
    ----------
    names
        Of the two.
    share
        Squared multiple correlation: how much of the third they make up.
    ratios
        Their strengths for a strength of 1 of the third.
    """

    names: tuple[str, str]
    share: float
    ratios: tuple[float, float]


def pairs_that_imitate(
    result: ScreenResult, name: str, minimum_share: float = 0.95
) -> tuple[ImitatingPair, ...]:
    """Pairs of candidates that imitate another where neither does so alone.

    Parameters
    ----------
    result
        A screen.
    name
        The candidate to be imitated, in its admissible sign; the observed one where it may have either.
    minimum_share
        Least squared multiple correlation, of directions without what the parameters imitate.

    Returns
    -------
    tuple of ImitatingPair
        The closest first; only those that do it with strengths of admissible signs.
    """
    this = result.index(name)
    wanted = result.candidates[this]
    if wanted.status == "not_testable":
        return ()
    orientation = wanted.sign or (1 if wanted.z >= 0 else -1)
    others = [
        i
        for i, candidate in enumerate(result.candidates)
        if i != this and candidate.status != "not_testable"
        if not _alone(candidate, orientation * result.correlation[this, i], minimum_share)
    ]
    pairs = []
    for i, j in combinations(others, 2):
        with_i, with_j = orientation * result.correlation[this, [i, j]]
        between = result.correlation[i, j]
        determinant = 1 - between**2
        if determinant < _PARALLEL:
            continue
        a = (with_i - between * with_j) / determinant
        b = (with_j - between * with_i) / determinant
        share = a * with_i + b * with_j
        first, second = result.candidates[i], result.candidates[j]
        if share < minimum_share or first.sign * a < 0 or second.sign * b < 0:
            continue
        ratios = (_ratio(a, wanted, first, orientation), _ratio(b, wanted, second, orientation))
        pairs.append(ImitatingPair((first.name, second.name), float(share), ratios))
    return tuple(sorted(pairs, key=lambda pair: -pair.share))


def _alone(candidate: ScreenedCandidate, cosine: float, minimum_share: float) -> bool:
    return bool(cosine**2 >= minimum_share and candidate.sign * cosine >= 0)


def _ratio(coefficient, wanted: ScreenedCandidate, other: ScreenedCandidate, orientation) -> float:
    """Coefficient of unit directions as a ratio of strengths."""
    norm_ratio = wanted.sensitivities[wanted.inner] / other.sensitivities[other.inner]
    return float(orientation * coefficient * norm_ratio)
