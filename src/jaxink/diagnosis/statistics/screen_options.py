"""Number of null data sets, and the significance level."""

from dataclasses import dataclass

import numpy as np

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

    Raises
    ------
    InputRefusedError
        The level is not between 0 and 0.5, there are too few draws for it, or the seed is not an integer.
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
