"""Number of null data sets, and the significance level."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

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
