"""Steps of a search: effects that were added to the model."""

import dataclasses
from typing import Any, NamedTuple

from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.screen import Screen
from jaxink.diagnosis.statistics.predictive_density import HeldOutGain
from jaxink.display.brief import brief_repr
from jaxink.effects import DeclaredConstant, Effect, in_numbers


@dataclasses.dataclass(frozen=True)
class Step:
    """An effect that was added.

    Parameters
    ----------
    effect, form
        Its name and form.
    members
        Its class: effects whose refits the data cannot distinguish, the best first.
    predicted_delta_chi_square, actual_delta_chi_square
        Decrease in chi-square according to the screen, and by the refit.
    held_out_gain
        Gain in log density of held-out points.
    strength, standard_error, unit
        Distance of its first term from the declared model; the error is None at a bound.
    terms, term_errors
        Values of all its terms and their standard errors.
    refit
        The refit.
    """

    __repr__ = brief_repr

    effect: str
    form: Effect
    members: tuple[str, ...]
    predicted_delta_chi_square: float
    actual_delta_chi_square: float
    held_out_gain: HeldOutGain
    strength: float
    standard_error: float | None
    unit: str
    terms: dict[str, float]
    term_errors: dict[str, float | None]
    refit: Refit | None

    @classmethod
    def of(cls, screen: Screen, best: Refit, members: tuple[str, ...], held_out_gain: HeldOutGain) -> "Step":
        """The step that adds the effect of a refit."""
        effect = best.effect
        return cls(
            effect=effect.name,
            form=effect,
            members=members,
            predicted_delta_chi_square=screen.result[effect.name].predicted_delta_chi_square,
            actual_delta_chi_square=best.delta_chi_square,
            held_out_gain=held_out_gain,
            unit=effect.strength.unit,
            refit=best,
            **_numbers(best),
        )

    def with_numbers_of(self, refit: Refit) -> "Step":
        """The step with the numbers of another fit of its effect."""
        return dataclasses.replace(self, **_numbers(refit))

    def __getstate__(self) -> dict[str, Any]:
        """What another process gets: without the refit, whose compiled programs belong to this one."""
        return {**self.__dict__, "refit": None}

    @property
    def shown(self) -> float:
        """What a reader is told of the first term: its value; of a declared constant, the difference."""
        is_difference = isinstance(self.form, DeclaredConstant)
        return self.strength if is_difference else self.strength + self.form.neutral

    @property
    def sentence(self) -> str:
        """What is true with this effect, with all of its numbers; without a capital letter or a full stop."""
        first, is_constant = self.form.strength.name, isinstance(self.form, DeclaredConstant)
        values = {**self.terms, first: self.shown}
        errors = {**self.term_errors, first: self.standard_error}
        return in_numbers(self.form, values, errors, difference=is_constant)


def _numbers(refit: Refit) -> dict[str, Any]:
    """The fields of a step that tell the values of its effect."""
    found, effect = refit.estimates(), refit.effect
    return {
        "strength": refit.strength,
        "standard_error": found[effect.strength.name].standard_error,
        "terms": {t.name: found[t.name].value for t in effect.terms},
        "term_errors": {t.name: found[t.name].standard_error for t in effect.terms},
    }


class Addition(NamedTuple):
    """A step of a search that goes on, with the refit that it goes on from."""

    step: Step
    refit: Refit
