"""What a screen and its refits say of each effect."""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.search.candidate_refits import limit_by_refits
from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.step import Screening, Step
from jaxink.diagnosis.statistics.candidate import ScreenedCandidate, Testability


@dataclasses.dataclass(frozen=True)
class CandidateRow:
    """What the first screen says of an effect, and its refit where there was one."""

    effect: str
    z: float
    p_raw: float
    p_adjusted: float
    absorbed_fraction: float
    detection_limit: float
    detection_limit_unit: str
    strength: float
    unit: str
    members: tuple[str, ...]
    predicted_drop: float
    refit_drop: float | None
    status: Testability
    reason: str


class _Limit(NamedTuple):
    """Detection limit of an effect, and what that says of whether it can be tested."""

    strength: float
    status: Testability
    reason: str


def candidate_rows(screening: Screening, steps: tuple[Step, ...]) -> tuple[CandidateRow, ...]:
    """One row for each candidate of a screen, the leading first.

    Parameters
    ----------
    screening
        The screen.
    steps
        What was found; where nothing was, refits tell whether the detection limits hold.
    """
    members = {name: step.members for step in steps for name in step.members}
    is_checked = not steps and not screening.stage.accepted
    rows = []
    for c in screening.result.candidates:
        refit = screening.refits.get(c.name)
        # A direction is per unit of what its setting does; strengths are told in a unit of their own.
        direction = screening.directions[c.name][max(c.inner, 0)]
        limit = _limit(screening, c, direction, is_checked)
        # A linear step beyond its range says nothing.
        step = c.strength * direction.column_strength if abs(c.strength) <= direction.largest else np.nan
        rows.append(
            CandidateRow(
                effect=c.name,
                z=c.z,
                p_raw=c.p_raw,
                p_adjusted=c.p_adjusted,
                absorbed_fraction=c.absorbed_fraction,
                detection_limit=limit.strength,
                detection_limit_unit=direction.unit,
                strength=refit.strength if refit else step,
                unit=refit.effect.strength.unit if refit else direction.unit,
                members=members.get(c.name, (c.name,)),
                predicted_drop=c.predicted_drop,
                refit_drop=refit.drop if refit else None,
                status=limit.status,
                reason=limit.reason,
            )
        )
    return tuple(
        sorted(rows, key=lambda r: -(r.refit_drop if r.refit_drop is not None else r.predicted_drop))
    )


def _limit(screening: Screening, c: ScreenedCandidate, direction: Direction, is_checked: bool) -> _Limit:
    limit, status, reason = c.detection_limit, c.status, c.reason
    if status == Testability.TESTABLE and is_checked:
        limit = limit_by_refits(screening.stage, direction, limit, c.critical_z)
    if limit >= direction.largest and status == Testability.TESTABLE:
        status, reason = Testability.HARDLY, "hardly any strength within its range would be seen"
    limit *= direction.column_strength
    usual = direction.effect.usual
    if status == Testability.TESTABLE and limit > usual:
        status, reason = Testability.HARDLY, f"its detection limit lies beyond its usual strength, {usual:g}"
    return _Limit(limit, status, reason)
