"""Rival minima of the present measurements, and whether one more would exclude them."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.fitting import COMPARABLE_RISE, CompiledJointObjective, Descent, JointObjective, search, sweep_of
from jaxink.planning.forecast import Planned
from jaxink.planning.known import KnownFit
from jaxink.planning.simulation import simulated

# Minima that are so little higher are told apart by a plan, even if the fit excludes them already.
_NEAR_RISE = 3 * COMPARABLE_RISE
_MOST_RIVALS = 8
# Besides the present minimum, so many may be the right one.
_MOST_RIGHT = 4
Rival = tuple[Float[np.ndarray, " parameters"], float]


def rivals_of(known: KnownFit) -> list[Rival]:
    """Other minima that the present measurements exclude barely or not, lowest first.

    What a sweep has only passed by is searched to its end first, which may be a known minimum.
    """
    if known.minima is None:
        return []
    scale = known.objective.scale
    listed = [one for one in known.minima.found[1:] if one.rise < _NEAR_RISE][:_MOST_RIVALS]
    starts = [scale.to_unit(np.array([one.values[name] for name in known.free])) for one in listed]
    found = _minima(known.objective, known.unit, [*starts, *_starts(known, known.objective)])
    return [rival for rival in found if rival[1] < _NEAR_RISE][:_MOST_RIVALS]


def _starts(known: KnownFit, objective: JointObjective) -> list[Float[np.ndarray, " parameters"]]:
    """Where a sweep finds minima; none if no free parameter has several."""
    free = [known.project.parameters[name] for name in known.free]
    made = sweep_of(objective, free, known.unit)
    return [] if made is None else made.starts


def _minima(
    objective: JointObjective,
    right: Float[np.ndarray, " parameters"],
    starts: Sequence[Float[np.ndarray, " parameters"]],
) -> list[Rival]:
    """Minima of an objective besides the right one, by their rise above it, lowest first."""
    programs = CompiledJointObjective(objective)
    lowest, found = programs.residual(right).loss, list[Rival]()
    # Each minimum with its Jacobian, in which a distance is one in standard errors.
    known = [(right, _jacobian(programs, right))]
    for start in starts:
        end = search(Descent(), programs, np.clip(start, 0.0, 1.0))
        apart = (np.sum((jacobian @ (end.unit - unit)) ** 2) for unit, jacobian in known)
        if end.outcome.converged and min(apart) >= 1:
            known.append((end.unit, _jacobian(programs, end.unit)))
            found.append((end.unit, end.loss - lowest))
    return sorted(found, key=lambda rival: rival[1])


def _jacobian(
    programs: CompiledJointObjective, unit: Float[np.ndarray, " parameters"]
) -> Float[np.ndarray, "residuals parameters"]:
    jacobian = programs.linearised(unit).jacobian
    assert jacobian is not None, "every measurement has one"
    return jacobian


def separated(known: KnownFit, planned: Planned, rivals: Sequence[Rival]) -> float | None:
    """Least chi-square of the rivals, all parameters refitted, on noise-free data of the present minimum."""
    if not rivals:
        return None
    programs = CompiledJointObjective(simulated(known, planned, known.unit))
    return min(search(Descent(), programs, unit).loss for unit, _ in rivals)


def chance_to_decide(
    known: KnownFit, rivals: Sequence[Rival], planned: Planned, separation: float
) -> tuple[float, float]:
    """Least separation and chance to decide of a measurement.

    A minimum of both measurements need not be near one of the present alone: in a flat valley, they may meet
    elsewhere, so that a sweep looks for more if the present one is right.

    Parameters
    ----------
    known
        The present measurements.
    rivals
        Other minima, the lowest first.
    planned
        The further measurement.
    separation
        That of the rivals, if the present minimum is right.
    """
    units = [known.unit, *(unit for unit, _ in rivals)]
    objective = simulated(known, planned, known.unit)
    apart = [rise for _, rise in _minima(objective, known.unit, _starts(known, objective))]
    least = min([*apart, separation])
    weights, separations = [1.0], [least]
    for truth, rise in [rival for rival in rivals if rival[1] < COMPARABLE_RISE][:_MOST_RIGHT]:
        others = [unit for unit in units if unit is not truth]
        found = _minima(simulated(known, planned, truth), truth, others)
        weights.append(float(np.exp(-rise / 2)))
        separations.append(min((one for _, one in found), default=np.inf))
    decides = np.array(separations) >= COMPARABLE_RISE
    return least, float(np.average(decides, weights=weights))
