"""Input and output of a screen."""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError, require_integer, require_number


@dataclass(frozen=True)
class ScreenOptions:
    """Options of a screen.

    Parameters
    ----------
    n_bootstrap
        Number of null data sets.
    level
        Probability that any candidate is detected although none is present.
    seed
        Of the random numbers.
    noise_freedom
        Degrees of freedom of an estimated noise, infinite for a stated one.

    Raises
    ------
    InputRefusedError
        The level is not between 0 and 0.5, there are too few draws for it, or the seed is not an integer.
    """

    n_bootstrap: int = 2000
    level: float = 0.05
    seed: int = 20260
    noise_freedom: float = np.inf

    def __post_init__(self):
        require_integer("n_bootstrap", self.n_bootstrap, 1, 100_000)
        require_integer("seed", self.seed, 0)
        require_number("level", self.level)
        if not 0 < self.level < 0.5:
            raise InputRefusedError(f"level is {self.level}; it must be between 0 and 0.5.")
        if self.n_bootstrap * self.level < 10:
            raise InputRefusedError(
                f"n_bootstrap is {self.n_bootstrap}; at level {self.level:g} it must be at least "
                f"{int(np.ceil(10 / self.level))}."
            )

    def noise(self, n_rows: int) -> Float[np.ndarray, "draws rows"]:
        """Null data sets in units of the noise in use, whose level is off by that of the estimate.

        The noise was estimated from the same points: what it is made of is a part of their squares.
        """
        rng = np.random.default_rng(self.seed)
        draws = rng.standard_normal((self.n_bootstrap, n_rows))
        known = self.noise_freedom
        if known < n_rows:
            share = rng.beta(known / 2, (n_rows - known) / 2, (self.n_bootstrap, 1))
            draws /= np.sqrt(share * np.sum(draws**2, axis=1, keepdims=True) / known)
        elif np.isfinite(known):
            draws /= np.sqrt(rng.chisquare(known, (self.n_bootstrap, 1)) / known)
        return draws


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
