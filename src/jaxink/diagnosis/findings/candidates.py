"""Table of candidate effects: the result of the screen, and of the refit if there was one."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.search.candidate_refits import limit_by_refits
from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.screen import Screen
from jaxink.diagnosis.search.step import Step
from jaxink.diagnosis.statistics.candidate import ScreenedCandidate, Testability
from jaxink.display.brief import brief_repr
from jaxink.effects import Effect
from jaxink.numerics.progress import StepOf


@dataclasses.dataclass(frozen=True)
class CandidateRow:
    """A candidate effect in the first or last screen; fields as in ``report.json``."""

    __repr__ = brief_repr

    effect: str
    z: float
    p_raw: float
    p_adjusted: float
    degenerate_fraction: float
    detection_limit: float
    detection_limit_unit: str
    strength: float
    unit: str
    members: tuple[str, ...]
    predicted_delta_chi_square: float
    refit_delta_chi_square: float | None
    status: Testability
    reason: str

    @property
    def delta_chi_square(self) -> float:
        """Decrease in chi-square by the refit, or as predicted by the screen."""
        refit = self.refit_delta_chi_square
        return self.predicted_delta_chi_square if refit is None else refit


class _Limit(NamedTuple):
    """Detection limit of an effect, and whether the data can test for it."""

    strength: float
    status: Testability
    reason: str


def candidate_rows(screen: Screen, steps: tuple[Step, ...]) -> tuple[CandidateRow, ...]:
    """One row for each candidate of a screen, largest decrease in chi-square first.

    If no step was taken, refits verify the detection limits.
    """
    members = {name: step.members for step in steps for name in step.members}
    is_checked = not steps and not screen.model.accepted
    rows, refits = [], screen.refits.best
    for c in screen.result.candidates:
        refit = refits.get(c.name)
        # A direction is normalised by its setting; reported strengths have the unit of the effect.
        directions = screen.directions[c.name]
        direction = directions[max(c.inner, 0)]
        inner = inner_of_refit(c, directions, refit.effect if refit else direction.effect)
        limit = _limit(screen, c, directions, inner, is_checked)
        # A linear step beyond its range is meaningless.
        step = c.strength * direction.column_strength if abs(c.strength) <= direction.largest else np.nan
        rows.append(
            CandidateRow(
                effect=c.name,
                z=c.z,
                p_raw=c.p_raw,
                p_adjusted=c.p_adjusted,
                degenerate_fraction=c.degenerate_fraction,
                detection_limit=limit.strength,
                detection_limit_unit=directions[inner].unit,
                strength=refit.strength if refit else step,
                unit=refit.effect.strength.unit if refit else direction.unit,
                members=members.get(c.name, (c.name,)),
                predicted_delta_chi_square=c.predicted_delta_chi_square,
                refit_delta_chi_square=refit.delta_chi_square if refit else None,
                status=limit.status,
                reason=limit.reason,
            )
        )
    return tuple(sorted(rows, key=lambda row: -row.delta_chi_square))


def inner_of_refit(c: ScreenedCandidate, directions: Sequence[Direction], effect: Effect) -> int:
    """Which direction has the term of the strength of a refit, which may be of another form."""
    best = max(c.inner, 0)
    same = [i for i, one in enumerate(directions) if one.effect.strength.name == effect.strength.name]
    known = [i for i in same if np.isfinite(c.standard_errors[i])]
    return best if best in same or not known else min(known, key=lambda i: float(c.standard_errors[i]))


def _limit(
    screen: Screen,
    c: ScreenedCandidate,
    directions: Sequence[Direction],
    inner: int,
    is_checked: bool,
) -> _Limit:
    direction = directions[inner]
    limit, status, reason = float(c.detection_limits[inner]), c.status, c.reason
    is_checked, problem = is_checked and status == Testability.TESTABLE, screen.model.problem
    if is_checked and problem.deadline.permits(OptionalTask.LIMIT, [c.name]):
        names = [candidate.name for candidate in screen.result.candidates]
        step = StepOf(names.index(c.name) + 1, len(names))
        problem.follow(f"detection limit, {c.name}", step, screen.model.solution.chi_square)
        with problem.failures.sparing("the verification of the detection limit of {}", c.name):
            limit = limit_by_refits(screen.model, direction, limit, c.critical_z)
    if limit >= direction.largest and status == Testability.TESTABLE:
        status, reason = Testability.HARDLY, "hardly any strength within its range would be detected"
    limit *= direction.column_strength
    usual = direction.effect.usual
    if status == Testability.TESTABLE and limit > usual:
        status, reason = Testability.HARDLY, f"its detection limit exceeds its usual strength, {usual:g}"
    return _Limit(limit, status, reason)
