"""What enters a screen, and what comes out of it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import ndtr

from jaxink.errors import InputRefusedError, require_integer, require_number

# Share of a candidate that the parameters imitate, beyond which data hardly decide on it.
HARDLY = 0.98
STATUSES = ("testable", "hardly_testable", "not_testable")


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
class ScreenOptions:
    """How a screen decides.

    Parameters
    ----------
    n_bootstrap
        Null data sets drawn.
    level
        Chance that any candidate is called where none is present.
    seed
        Of the random numbers.

    Raises
    ------
    InputRefusedError
        The level is not between 0 and 0.5, there are too few draws for it, or the seed is not a whole number.
    """

    n_bootstrap: int = 2000
    level: float = 0.05
    seed: int = 20260

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


@dataclass(frozen=True)
class ScreenedCandidate:
    """What the residual says of one candidate, without a refit.

    Parameters
    ----------
    name, sign
        Of the candidate.
    status
        ``testable``; ``hardly_testable`` where the parameters imitate more than 98 % of it at every inner
        value; ``not_testable`` where they imitate all of it, or its direction is zero or not finite.
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
    sensitivities
        What a strength of 1 changes at each inner value beyond what the parameters imitate, as the root of
        a chi-square; 0 where not testable.
    """

    name: str
    sign: int
    status: str
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
    sensitivities: Float[np.ndarray, " inner"]

    def power(self, strength: float) -> float:
        """Chance that this candidate is called where it is present.

        Parameters
        ----------
        strength
            True strength, of an admissible sign, at the best inner value.

        Returns
        -------
        float
            Phi(|s|/se - c); the search over other inner values can only add to it.
        """
        shift = abs(strength) * self.critical_z / self.detection_limit
        wrong_side = ndtr(-shift - self.critical_z) if self.sign == 0 else 0.0
        return float(ndtr(shift - self.critical_z) + wrong_side)


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
        status="not_testable",
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
        sensitivities=np.zeros(nothing.size),
    )


@dataclass(frozen=True)
class ScreenResult:
    """All candidates of a screen, in the order given.

    Parameters
    ----------
    candidates
        One record each.
    correlation
        Cosine between what is left of the directions without the parameters, at the best inner values;
        nan for those not testable. With its sign: -1 means opposite strengths are alike.
    options
        As asked for.
    is_significance_known
        False where the noise was not given and there are too few scans to do without: no p then.
    chi_square, degrees_of_freedom
        Of the residual that the parameters leave.
    unfitted_drop
        By how much the parameters alone would still lower chi-square; near 0 at a minimum.
    held
        True for each parameter whose bound holds it: its column is not among those projected out.
    """

    candidates: tuple[ScreenedCandidate, ...]
    correlation: Float[np.ndarray, "candidates candidates"]
    options: ScreenOptions
    is_significance_known: bool
    chi_square: float
    degrees_of_freedom: int
    unfitted_drop: float
    held: Bool[np.ndarray, " parameters"]

    def __getitem__(self, name: str) -> ScreenedCandidate:
        return self.candidates[self.index(name)]

    def index(self, name: str) -> int:
        """Position of a candidate.

        Parameters
        ----------
        name
            Its identifier.

        Raises
        ------
        InputRefusedError
            There is no such candidate.
        """
        names = [candidate.name for candidate in self.candidates]
        if name not in names:
            raise InputRefusedError(f"no candidate is called '{name}'; there are: {', '.join(names)}.")
        return names.index(name)

    @property
    def ranked(self) -> tuple[ScreenedCandidate, ...]:
        """The testable candidates, the largest predicted drop of chi-square first."""
        testable = [c for c in self.candidates if c.status != "not_testable"]
        return tuple(sorted(testable, key=lambda c: -c.predicted_drop))

    @property
    def called(self) -> tuple[ScreenedCandidate, ...]:
        """Those that are significant at the level, the most significant first."""
        significant = [c for c in self.ranked if c.p_adjusted <= self.options.level]
        return tuple(sorted(significant, key=lambda c: c.p_raw))
