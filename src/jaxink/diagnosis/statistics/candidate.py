"""What enters a screen, and what comes out of it."""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxink.diagnosis.statistics.screen_options import ScreenOptions
from jaxink.errors import InputRefusedError


class Testability(enum.StrEnum):
    """Whether data can decide on a candidate."""

    __test__ = False

    TESTABLE = "testable"
    HARDLY = "hardly_testable"
    NOT = "not_testable"


@dataclass(frozen=True)
class Candidate:
    """A possible change of the model, by its effect on the whitened prediction while it is weak.

    Parameters
    ----------
    name
        Its identifier.
    directions
        Derivative by the strength at strength 0, one column for each value of an inner parameter that has
        no effect at strength 0, such as the size of particles that are not there; shape ``(rows,)`` for
        none. Rows as of the residual, those of priors included (0 there).
    sign
        +1 where the strength cannot be negative, -1 where it cannot be positive, 0 where it can be either.
    """

    name: str
    directions: Float[np.ndarray, "rows *inner"]
    sign: int

    def __post_init__(self):
        directions = np.asarray(self.directions, float)
        if directions.ndim == 1:
            directions = directions[:, None]
        object.__setattr__(self, "directions", directions)
        if self.sign not in (-1, 0, 1):
            raise InputRefusedError(f"candidate {self.name}: sign is {self.sign}; it must be -1, 0 or 1.")
        if directions.ndim != 2 or directions.shape[1] == 0:
            raise InputRefusedError(
                f"candidate {self.name}: directions have shape {directions.shape}; they must be "
                "(rows, inner) with at least one inner value."
            )


@dataclass(frozen=True)
class ScreenedCandidate:
    """What the residual says of one candidate, without a refit.

    Parameters
    ----------
    name, sign
        Of the candidate.
    status
        Hardly testable where the parameters imitate more of it than `SearchPolicy.hardly_absorbed` at every
        inner value; not testable where they imitate all of it, or its direction is zero or not finite.
    reason
        Why it is not testable, otherwise empty.
    inner
        Index of the best inner value; -1 where it is not testable.
    z
        Score in standard errors, positive where the residual looks like a positive strength.
    strength, standard_error
        One Gauss-Newton step from zero. The strength is not cut at zero.
    predicted_drop
        Of chi-square after a refit; 0 where the sign is not admissible.
    p_raw
        Of this candidate alone.
    p_adjusted
        Chance that any candidate of the screen looks as significant where none is present.
    absorbed_fraction
        Share of the squared direction that the parameters imitate.
    critical_z
        |z| from which the candidate is called, all candidates of the screen being accounted for.
    detection_limit
        Strength that is called in half of the cases: critical_z standard errors.
    z_inner, standard_errors, detection_limits
        z, standard error and detection limit at each inner value; nan where not testable.
    """

    name: str
    sign: int
    status: Testability
    reason: str
    inner: int
    z: float
    strength: float
    standard_error: float
    predicted_drop: float
    p_raw: float
    p_adjusted: float
    absorbed_fraction: float
    critical_z: float
    detection_limit: float
    z_inner: Float[np.ndarray, " inner"]
    standard_errors: Float[np.ndarray, " inner"]
    detection_limits: Float[np.ndarray, " inner"]


def untestable(candidate: Candidate, reason: str, absorbed_fraction: float) -> ScreenedCandidate:
    """The record of a candidate on which these data say nothing.

    Parameters
    ----------
    candidate
        The candidate.
    reason
        Why.
    absorbed_fraction
        1 where the parameters imitate it, nan where there is no direction.
    """
    nothing = np.full(candidate.directions.shape[1], np.nan)
    return ScreenedCandidate(
        name=candidate.name,
        sign=candidate.sign,
        status=Testability.NOT,
        reason=reason,
        inner=-1,
        z=np.nan,
        strength=np.nan,
        standard_error=np.nan,
        predicted_drop=0.0,
        p_raw=np.nan,
        p_adjusted=np.nan,
        absorbed_fraction=absorbed_fraction,
        critical_z=np.nan,
        detection_limit=np.nan,
        z_inner=nothing,
        standard_errors=nothing,
        detection_limits=nothing,
    )


@dataclass(frozen=True)
class ScreenResult:
    """All candidates of a screen, in the order given.

    Parameters
    ----------
    candidates
        One record each.
    options
        As asked for.
    """

    candidates: tuple[ScreenedCandidate, ...]
    options: ScreenOptions

    def __getitem__(self, name: str) -> ScreenedCandidate:
        """Record of a candidate; InputRefusedError where there is none of that name."""
        names = [candidate.name for candidate in self.candidates]
        if name not in names:
            raise InputRefusedError(f"no candidate is called '{name}'; there are: {', '.join(names)}.")
        return self.candidates[names.index(name)]
