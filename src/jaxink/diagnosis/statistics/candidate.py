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
    name
        Of the candidate.
    status
        Hardly testable where the parameters imitate more of it than `SearchPolicy.hardly_absorbed` at every
        inner value; not testable where they imitate all of it, or its direction is zero or not finite.
    absorbed_fraction
        Share of the squared direction that the parameters imitate.
    standard_errors
        Of the strength at each inner value; nan where not testable.
    reason
        Why it is not testable, otherwise empty.
    inner
        Index of the best inner value; -1 where it is not testable.
    z
        Score in standard errors, positive where the residual looks like a positive strength.
    strength
        One Gauss-Newton step from zero, not cut at zero.
    predicted_drop
        Of chi-square after a refit; 0 where the sign is not admissible.
    p_raw
        Of this candidate alone.
    p_adjusted
        Chance that any candidate of the screen looks as significant where none is present.
    critical_z
        |z| from which the candidate is called, all candidates of the screen being accounted for.
    """

    name: str
    status: Testability
    absorbed_fraction: float
    standard_errors: Float[np.ndarray, " inner"]
    reason: str = ""
    inner: int = -1
    z: float = np.nan
    strength: float = np.nan
    predicted_drop: float = 0.0
    p_raw: float = np.nan
    p_adjusted: float = np.nan
    critical_z: float = np.nan

    @property
    def standard_error(self) -> float:
        """Of the strength at the best inner value."""
        return float(self.standard_errors[self.inner])

    @property
    def detection_limits(self) -> Float[np.ndarray, " inner"]:
        """Strength that is called in half of the cases, at each inner value: critical_z standard errors."""
        return self.critical_z * self.standard_errors

    @property
    def detection_limit(self) -> float:
        """The same at the best inner value."""
        return self.critical_z * self.standard_error


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
