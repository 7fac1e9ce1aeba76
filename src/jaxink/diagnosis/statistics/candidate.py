"""Input and output of a screen."""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxink.diagnosis.statistics.screen_options import ScreenOptions
from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError


class Testability(enum.StrEnum):
    """Whether the data can test for a candidate."""

    __test__ = False

    TESTABLE = "testable"
    HARDLY = "hardly_testable"
    NOT = "not_testable"


@dataclass(frozen=True)
class Candidate:
    """A possible change of the model, given by its first-order effect on the whitened prediction.

    Parameters
    ----------
    name
        Its identifier.
    directions
        Derivative with respect to the strength at strength 0, one column for each value of an inner parameter
        that has no effect at strength 0 (such as the radius of absent particles); or shape ``(rows,)``. Rows
        as in the residual, including those of priors, which are 0.
    sign
        +1 if the strength cannot be negative, -1 if it cannot be positive, 0 if it can be either.
    """

    __repr__ = brief_repr

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
    """Result of the screen for one candidate, without a refit.

    Parameters
    ----------
    name
        Of the candidate.
    status
        Hardly testable if the degenerate fraction exceeds `SearchPolicy.largest_degenerate_fraction` at every
        inner value; not testable if it is 1 everywhere, or the direction is zero or not finite.
    degenerate_fraction
        Share of the squared direction that is degenerate with the free parameters.
    standard_errors
        Of the strength at each inner value; nan if not testable.
    reason
        Why it is not testable, otherwise empty.
    inner
        Index of the best inner value; -1 if not testable.
    z
        Score in standard errors, positive if the residual resembles a positive strength.
    strength
        One Gauss-Newton step from zero, not limited to admissible values.
    predicted_delta_chi_square
        Predicted decrease in chi-square by a refit; 0 if the sign is not admissible.
    p_raw
        p-value of this candidate alone.
    p_adjusted
        Family-wise adjusted p: probability that any candidate looks as significant although none is present.
    critical_z
        |z| at which the candidate is detected, adjusted for the number of candidates.
    """

    __repr__ = brief_repr

    name: str
    status: Testability
    degenerate_fraction: float
    standard_errors: Float[np.ndarray, " inner"]
    reason: str = ""
    inner: int = -1
    z: float = np.nan
    strength: float = np.nan
    predicted_delta_chi_square: float = 0.0
    p_raw: float = np.nan
    p_adjusted: float = np.nan
    critical_z: float = np.nan

    @property
    def standard_error(self) -> float:
        """Of the strength at the best inner value."""
        return float(self.standard_errors[self.inner])

    @property
    def detection_limits(self) -> Float[np.ndarray, " inner"]:
        """Strength that is detected in half of the cases, at each inner value: critical_z standard errors."""
        return self.critical_z * self.standard_errors

    @property
    def detection_limit(self) -> float:
        """The same at the best inner value."""
        return self.critical_z * self.standard_error


@dataclass(frozen=True)
class ScreenResult:
    """All candidates of a screen, in the order given."""

    __repr__ = brief_repr

    candidates: tuple[ScreenedCandidate, ...]
    options: ScreenOptions

    def __getitem__(self, name: str) -> ScreenedCandidate:
        """Record of a candidate; InputRefusedError if there is none of that name."""
        names = [candidate.name for candidate in self.candidates]
        if name not in names:
            raise InputRefusedError(f"there is no candidate '{name}'; there are: {', '.join(names)}.")
        return self.candidates[names.index(name)]
