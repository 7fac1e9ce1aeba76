"""What a search goes through: screens with the refits that followed, and effects that were added."""

import dataclasses

from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.stage import Stage
from jaxink.diagnosis.statistics.candidate import ScreenResult
from jaxink.diagnosis.statistics.predictive_density import HeldOutGain
from jaxink.effects import Effect


@dataclasses.dataclass(frozen=True)
class Screening:
    """The screen of one stage, and what was refitted after it.

    Parameters
    ----------
    stage
        The model with the effects found so far.
    directions
        Ways of being present, by the name of the effect.
    result
        The screen.
    refits
        By the name of the effect; grows while the search goes on.
    """

    stage: Stage
    directions: dict[str, list[Direction]]
    result: ScreenResult
    refits: dict[str, Refit] = dataclasses.field(default_factory=dict)

    @classmethod
    def of(cls, stage: Stage) -> "Screening":
        """Screen a stage."""
        directions = stage.directions()
        return cls(stage, directions, stage.screened(directions))


@dataclasses.dataclass(frozen=True)
class Step:
    """An effect that was added.

    Parameters
    ----------
    effect, form
        Its name and form.
    members
        Its class: effects whose refits the data do not tell apart, the best first.
    predicted_drop, actual_drop
        Fall of chi-square by the screen and by the refit.
    held_out_gain
        Gain in the log density of held-out points.
    strength, standard_error, unit
        Distance of its first term from the declared model; the error is None where a bound holds it.
    terms, term_errors
        Values of all its terms and their standard errors.
    refit
        The refit.
    """

    effect: str
    form: Effect
    members: tuple[str, ...]
    predicted_drop: float
    actual_drop: float
    held_out_gain: HeldOutGain
    strength: float
    standard_error: float | None
    unit: str
    terms: dict[str, float]
    term_errors: dict[str, float | None]
    refit: Refit | None
