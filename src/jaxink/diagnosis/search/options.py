"""Choices of a diagnosis."""

import dataclasses

from jaxink.diagnosis.policy import DEFAULT_POLICY, SearchPolicy
from jaxink.diagnosis.statistics.screen_options import ScreenOptions
from jaxink.effects import CATALOGUE, Effect
from jaxink.errors import InputRefusedError, require_integer, require_kind
from jaxink.fitting import FitOptions


@dataclasses.dataclass(frozen=True)
class DiagnosisOptions:
    """Choices of a diagnosis.

    Parameters
    ----------
    max_effects
        Most effects that are added.
    max_parameters
        Most parameters that are free at a time, those of the declared sample included; None for no limit.
    level
        Chance that the screen calls any effect where there is none.
    n_bootstrap, seed
        Null data sets of the screen, and their seed.
    fit
        Of the fit of the declared model.
    catalogue
        Classes of effects that are looked for; `CATALOGUE` and any of your own.
    policy
        Thresholds of the search and of its verdict.

    Raises
    ------
    InputRefusedError
        A number is outside its range, what stands in the catalogue is no class of effects, or two effects
        have one name.
    """

    max_effects: int = 3
    max_parameters: int | None = None
    level: float = 0.05
    n_bootstrap: int = 2000
    seed: int = 20260
    fit: FitOptions = FitOptions(profile="none")
    catalogue: tuple[type[Effect], ...] = CATALOGUE
    policy: SearchPolicy = DEFAULT_POLICY

    def __post_init__(self):
        require_integer("max_effects", self.max_effects, 0)
        if self.max_parameters is not None:
            require_integer("max_parameters", self.max_parameters, 1)
        require_kind("fit", self.fit, FitOptions)
        require_kind("policy", self.policy, SearchPolicy)
        # Refused before the fit, not after it.
        _ = self.screen
        for effect in self.catalogue:
            if not (isinstance(effect, type) and issubclass(effect, Effect)):
                raise InputRefusedError(f"the catalogue takes classes of effects; it was given {effect!r}.")
        names = [effect.name for effect in self.catalogue]
        twice = {name for name in names if names.count(name) > 1}
        if twice:
            raise InputRefusedError(f"two effects of the catalogue are called '{min(twice)}'.")
        if self.fit.objective != "chi_square" or self.fit.method != "gradient":
            raise InputRefusedError("a diagnosis needs a gradient fit with the objective 'chi_square'.")

    @property
    def screen(self) -> ScreenOptions:
        """What of it the screen is given."""
        return ScreenOptions(self.n_bootstrap, self.level, self.seed)
