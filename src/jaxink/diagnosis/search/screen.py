"""The screen of a model: what each of its candidates promises, and the refits that followed."""

import dataclasses
import itertools
from collections.abc import Iterable
from functools import cached_property

import numpy as np

from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.direction import SCREEN, Direction, secants, tangents
from jaxink.diagnosis.search.model import FittedModel, screened_programs
from jaxink.diagnosis.search.refit import Refits
from jaxink.diagnosis.statistics.candidate import Candidate, ScreenResult
from jaxink.diagnosis.statistics.screen import screen
from jaxink.effects import AreaWithOtherValues, Effect
from jaxink.numerics.progress import StepOf
from jaxink.numerics.threads import in_threads


@dataclasses.dataclass(frozen=True, eq=False)
class Screen:
    """The candidates of a model.

    Parameters
    ----------
    model
        The model without them.
    directions
        Columns of all forms at all settings, by the name of the effect.
    refits
        Filled by the search.
    """

    model: FittedModel
    directions: dict[str, list[Direction]]
    refits: Refits

    @classmethod
    def of(cls, model: FittedModel, with_own: bool = True) -> "Screen":
        """Compute the directions of all candidates; `with_own`: also of those with their own program."""
        return cls(model, _directions(model, with_own), Refits(len(model.residual)))

    @cached_property
    def candidates(self) -> list[Candidate]:
        """What the effects would change, each with all of its directions."""
        return [
            Candidate(
                name,
                np.stack([d.column for d in found], axis=1),
                sign=0 if found[0].effect.may_be_negative else 1,
            )
            for name, found in self.directions.items()
        ]

    @cached_property
    def result(self) -> ScreenResult:
        """Scores of all candidates, with their significance."""
        return screen(
            self.model.residual,
            self.model.jacobian,
            self.candidates,
            at_bound=self.model.at_bound,
            options=self.model.problem.screen_options,
            policy=self.model.problem.policy,
        )

    def promise(self, name: str) -> float:
        """Largest predicted decrease in chi-square among the directions of an effect."""
        decreases = [0.0]
        for direction in self.directions[name]:
            z, norm = self.model.score(direction)
            if norm > 1e-9 * max(float(np.linalg.norm(direction.column)), 1e-300):
                decreases.append(direction.reachable_delta_chi_square(z, norm))
        return max(decreases)

    @property
    def lowest_chi_square(self) -> float:
        """Of the model and of the refits so far."""
        refits = (refit.solution.chi_square for refit in self.refits.best.values())
        return min([self.model.solution.chi_square, *refits])


def _directions(model: FittedModel, with_own: bool) -> dict[str, list[Direction]]:
    by_name: dict[str, list[Direction]] = {}
    inside = [e for e in model.listed.forms if not e.own_program]
    inside = inside if _may_screen(model, inside) else []
    problem = model.problem
    shared = tangents(model.objective, model.solution, model.free, inside, problem.failures)
    for direction in [*shared, *(_all_secants(model) if with_own else ())]:
        name = direction.effect.name
        if not np.all(np.isfinite(direction.column)):
            problem.failures.note(SCREEN, name, "the model or its derivatives are not finite")
        by_name.setdefault(name, []).append(direction.without_rounding())
    return by_name


def _may_screen(model: FittedModel, effects: Iterable[Effect]) -> bool:
    task = OptionalTask.REPETITION if model.accepted else OptionalTask.SCREEN
    return model.problem.deadline.permits(task, () if model.accepted else (e.name for e in effects))


def _all_secants(model: FittedModel) -> list[Direction]:
    """Directions of the candidates with programs of their own, two programs at a time."""
    problem, number = model.problem, itertools.count(1)
    programs = screened_programs(model.listed)

    def of(effects: list[Effect]) -> list[Direction]:
        found: list[Direction] = []
        if not _may_screen(model, effects):
            return found
        names = ", ".join(dict.fromkeys(effect.name for effect in effects))
        step = StepOf(next(number), len(programs))
        problem.follow(f"screen with {names}", step, model.solution.chi_square)
        for effect in effects:
            with problem.failures.sparing(SCREEN, effect.name):
                found += secants(model.objective, _predicting(model, effect), model.solution, effect)
        return found

    return [direction for directions in in_threads(of, programs) for direction in directions]


def _predicting(model: FittedModel, effect: Effect):
    """The objective that predicts what an effect does."""
    is_mixture = isinstance(effect, AreaWithOtherValues)
    return model.objective if is_mixture else model.objectives.of(effect)
