"""What effects that are too weak to be seen may do to the parameters."""

import dataclasses

import numpy as np

from jaxink.diagnosis.search.model import FittedModel
from jaxink.diagnosis.search.screen import Screen
from jaxink.diagnosis.statistics.candidate import Testability
from jaxink.display.brief import brief_repr


@dataclasses.dataclass(frozen=True)
class HiddenEffect:
    """An effect that may be present unseen, as the final model would be fitted to the data with it.

    Parameters
    ----------
    effect
        Its name.
    strength, unit
        The strength: its detection limit, or its usual strength if that is less.
    shifts
        Shift of each parameter in its own unit, linearised.
    largest_in_errors
        The largest shift, in standard errors of the parameter.
    """

    __repr__ = brief_repr

    effect: str
    strength: float
    unit: str
    shifts: dict[str, float]
    largest_in_errors: float


def hidden_effects(last: FittedModel, screen: Screen) -> tuple[HiddenEffect, ...]:
    """Effects that were not added and may hide, those that shift a parameter most first.

    Parameters
    ----------
    last
        The final model.
    screen
        With the directions of the effects and their limits; of an earlier model if the last has none.
    """
    inside = last.at_bound == 0
    jacobian = last.jacobian[:, inside]
    names = [name for name, is_inside in zip(last.free, inside, strict=True) if is_inside]
    if not names:
        return ()
    solve = np.linalg.pinv(jacobian)
    errors = np.linalg.norm(solve, axis=1)
    added, found = {effect.name for effect in last.accepted}, []
    for candidate in screen.result.candidates:
        if candidate.name in added or candidate.status == Testability.NOT:
            continue
        direction = screen.directions[candidate.name][candidate.inner]
        _, norm = last.score(direction)
        if not norm > 0:
            continue
        unit = direction.column_strength
        strength = min(candidate.critical_z / norm, direction.largest, direction.effect.usual / unit)
        shifts = strength * (solve @ direction.column)
        found.append(
            HiddenEffect(
                effect=candidate.name,
                strength=strength * unit,
                unit=direction.unit,
                shifts=dict(zip(names, shifts.tolist(), strict=True)),
                largest_in_errors=float(np.max(np.abs(shifts) / errors)),
            )
        )
    return tuple(sorted(found, key=lambda one: -one.largest_in_errors))
