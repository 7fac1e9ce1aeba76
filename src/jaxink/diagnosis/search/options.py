"""Options of a diagnosis."""

import dataclasses

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.statistics.candidate import ScreenOptions
from jaxink.display.brief import brief_repr
from jaxink.effects import CATALOGUE, Effect
from jaxink.errors import InputRefusedError, require_integer, require_kind, require_number, shown
from jaxink.fitting import FitOptions


@dataclasses.dataclass(frozen=True)
class DiagnosisOptions:
    """Options of a diagnosis.

    Parameters
    ----------
    max_effects
        Largest number of effects added.
    max_parameters
        Largest number of free parameters, including those of the declared sample; None for no limit.
    level
        Probability that the screen detects any effect although none is present.
    n_bootstrap, seed
        Number of null data sets of the screen, and their seed.
    fit
        Of the fit of the declared model.
    catalogue
        Classes of effects that are considered: `CATALOGUE`, and your own.
    policy
        Thresholds of the search and of its verdict.
    time_limit_s
        Seconds after which the diagnosis ends with the best verdict so far; None for no limit. The declared
        model is fitted in any case, and a fit or a compilation that has begun is ended.

    Raises
    ------
    InputRefusedError
        A number is out of range, an entry of the catalogue is not a class of effects, or two have the same
        name.
    """

    __repr__ = brief_repr

    max_effects: int = 3
    max_parameters: int | None = None
    level: float = 0.05
    n_bootstrap: int = 2000
    seed: int = 20260
    fit: FitOptions = FitOptions(profile="none")
    catalogue: tuple[type[Effect], ...] = CATALOGUE
    policy: SearchPolicy = DEFAULT_POLICY
    time_limit_s: float | None = None

    def __post_init__(self):
        require_integer("max_effects", self.max_effects, 0)
        if self.max_parameters is not None:
            require_integer("max_parameters", self.max_parameters, 1)
        if self.time_limit_s is not None:
            require_number("time_limit_s", self.time_limit_s)
            if not self.time_limit_s > 0:
                raise InputRefusedError(f"time_limit_s is {shown(self.time_limit_s)}; it must be positive.")
        require_kind("fit", self.fit, FitOptions)
        require_kind("policy", self.policy, SearchPolicy)
        _ = self.screen  # Rejected before the fit, not after it.
        for effect in self.catalogue:
            if not (isinstance(effect, type) and issubclass(effect, Effect)):
                raise InputRefusedError(f"catalogue has the entry {effect!r}; it takes classes of effects.")
            effect.require_methods()
        names = [effect.name for effect in self.catalogue]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise InputRefusedError(f"catalogue has two effects named '{min(twice)}'; names must be unique.")
        if self.fit.objective != "chi_square" or self.fit.method != "gradient":
            raise InputRefusedError("fit: a diagnosis requires method 'gradient' and objective 'chi_square'.")

    @property
    def screen(self) -> ScreenOptions:
        """Options of the screen."""
        return ScreenOptions(self.n_bootstrap, self.level, self.seed)
