"""Directions of effects: the columns of a screen."""

import dataclasses
from collections.abc import Sequence
from functools import partial

import numpy as np
from jaxtyping import Float

from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Place, Solution
from jaxink.effects import AreaWithOtherValues, Effect
from jaxink.errors import NotFiniteError
from jaxink.numerics.failures import Failures

# Norm of a change, in units of the noise, below which it is rounding.
_ROUNDING = 1e-6
# What failed if an effect has no directions.
SCREEN = "the screen for {}"


@dataclasses.dataclass(frozen=True)
class Direction:
    """One way in which an effect may be present: a column of the screen.

    Parameters
    ----------
    effect
        The form.
    setting
        Values of its parameters.
    column
        Whitened change of the prediction for a strength of one.
    largest
        Largest strength in units of the column.
    """

    effect: Effect
    setting: dict[str, float]
    column: Float[np.ndarray, " rows"]
    largest: float

    @property
    def column_strength(self) -> float:
        """Strength that the column stands for, in `unit`; 1 for a share of the area."""
        here = self.setting.get(self.effect.strength.name)
        return abs(here - self.effect.neutral) if here is not None and self.effect.scales else 1.0

    @property
    def unit(self) -> str:
        """Unit of strengths in a screen: that of the effect, or ``share`` for a share of the area."""
        is_share = self.effect.strength.name in self.setting and not self.effect.scales
        return "share" if is_share else self.effect.strength.unit

    def without_rounding(self) -> "Direction":
        """The direction; a zero column if the effect changes nothing but rounding."""
        if np.linalg.norm(self.column) * self.largest <= _ROUNDING:
            return dataclasses.replace(self, column=np.zeros_like(self.column))
        return self

    def reachable_delta_chi_square(self, z: float, norm: float) -> float:
        """Largest decrease in chi-square for a strength within its range, in the linear approximation."""
        if z <= 0 and not self.effect.may_be_negative:
            return 0.0
        step = min(abs(z) / norm, self.largest) * norm
        return 2 * step * abs(z) - step**2


def tangents(
    objective: CandidateObjective,
    solution: Solution | Place,
    free: tuple[str, ...],
    effects: list[Effect],
    failures: Failures,
) -> list[Direction]:
    """Columns of effects that share a program, at all their settings: derivatives at strength 0.

    An effect whose derivatives are not finite at a setting is left out there, and noted.
    """
    found = []
    # One setting of each effect at a time: effects do not interact while their strengths are zero.
    for rank in range(max((len(e.settings) for e in effects), default=0)):
        here = [e for e in effects if rank < len(e.settings)]
        of_rank = partial(_tangents_at, objective, solution, free, rank)
        found += failures.in_parts(of_rank, here, SCREEN, lambda effect: effect.name)
    return found


def _tangents_at(
    objective: CandidateObjective,
    solution: Solution | Place,
    free: tuple[str, ...],
    rank: int,
    effects: Sequence[Effect],
) -> list[Direction]:
    if not effects:
        return []
    values = dict(solution.values)
    for effect in effects:
        values |= effect.settings[rank]
    names = tuple(dict.fromkeys(e.strength.name for e in effects))
    columns = objective.jacobian(values, free + names).jacobian
    if not np.all(np.isfinite(columns)):
        raise NotFiniteError("the model or its derivatives are not finite")
    found = []
    for effect in effects:
        column = columns[:, len(free) + names.index(effect.strength.name)]
        span = max(effect.strength.maximum - effect.neutral, effect.neutral - effect.strength.minimum)
        found.append(Direction(effect, effect.settings[rank], column, span))
    return found


def secants(
    objective: CandidateObjective, own: CandidateObjective, solution: Solution | Place, effect: Effect
) -> list[Direction]:
    """Differences that the settings of an effect make, predicted by its `own` objective."""
    found = []
    for setting in effect.settings:
        values = solution.values | setting
        if isinstance(effect, AreaWithOtherValues):
            predicted, there = solution.predicted_per_sr, 0.0
            for share, other in effect.mixture(values):
                there = there + share * (own.predict(values | other) - predicted)
            change = there
        else:
            change = own.predict(values) - solution.predicted_per_sr
        column = objective.whiten(solution.predicted_per_sr, np.asarray(change))
        found.append(Direction(effect, setting, column, effect.largest_share(setting)))
    return found
