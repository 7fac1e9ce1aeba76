"""Candidates fitted with all other parameters of a stage, and how strong they must be to be seen so."""

import dataclasses
import logging
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.stage import Stage
from jaxink.diagnosis.search.workbench import Solution
from jaxink.effects import AreaWithOtherValues, Effect

_LOG = logging.getLogger("jaxink")


class _Start(NamedTuple):
    """Where a refit may begin: values of the other parameters, a direction of the effect, and its step."""

    promise: float
    origin: dict[str, float]
    setting: dict[str, float]
    step: float


def best_refit(stage: Stage, directions: list[Direction]) -> Refit:
    """Refit of the form of an effect that fits best, its number of terms being paid for."""
    name = directions[0].effect.name
    found = [refit(stage, form, directions) for form in stage.listed.forms if form.name == name]
    return max(found, key=lambda r: r.penalised(len(stage.residual)))


def polished(stage: Stage, begun: Refit) -> Refit:
    """The refit, followed to its minimum."""
    if begun.solution.search.outcome.converged:
        return begun
    found = begun.bench.fit(begun.solution.values, begun.solution.free)
    done = dataclasses.replace(begun, solution=found, drop=stage.solution.chi_square - found.chi_square)
    stage.refits[begun.effect] = done
    return done


def refit(stage: Stage, effect: Effect, directions: list[Direction]) -> Refit:
    """Fit an effect with all other parameters, from its most promising settings."""
    if effect in stage.refits:
        return stage.refits[effect]
    bench = stage.own_bench(effect) if effect.own_program else stage.bench
    free = stage.free + tuple(t.name for t in effect.terms)
    neutral = {t.name: t.value for t in effect.terms}
    best: Solution | None = None
    for start in _starts(stage, effect, directions):
        values = neutral | start.origin | start.setting | effect.start(start.setting, start.step)
        found = bench.fit(values, free, max_jacobians=stage.setup.policy.refit_jacobians)
        if np.isfinite(found.chi_square) and (best is None or found.chi_square < best.chi_square):
            best = found
    if best is None or best.chi_square > stage.solution.chi_square:
        # From where the effect is absent nothing gets worse.
        absent = neutral | stage.solution.values
        # A face that is hardly rough has peaks too narrow to be resolved: it is not the smooth one.
        if best is None or _is_same(stage, bench.predict(absent)):
            here = bench.fit(absent, free, max_jacobians=stage.setup.policy.refit_jacobians)
            best = here if best is None or here.chi_square < best.chi_square else best
    done = Refit(effect, best, bench, stage.solution.chi_square - best.chi_square)
    _LOG.debug("%s: chi-square falls by %.6g", effect.name, done.drop)
    stage.refits[effect] = done
    return done


def _starts(stage: Stage, effect: Effect, directions: list[Direction]) -> list[_Start]:
    """Where a refit begins: the solution, and where that is far off, the start of the declared sample."""
    found = []
    for direction in (d for d in directions if d.effect == effect or not effect.is_screened):
        z, norm = stage.score(direction)
        if not norm > 0:
            continue
        step = float(np.clip(z / norm, -direction.largest, direction.largest))
        promise = direction.reachable_drop(z, norm)
        found.append(_Start(promise, stage.solution.values, direction.setting, step))
    found.sort(key=lambda start: -start.promise)
    chosen = found[: stage.setup.policy.refit_starts]
    if stage.is_far and found:
        base = stage.bench.base_free
        declared = {name: value for name, value in stage.bench.start.items() if name in base}
        chosen.insert(1, found[0]._replace(origin=stage.solution.values | declared))
    return chosen


def _is_same(stage: Stage, predicted) -> bool:
    rtol = stage.setup.policy.same_prediction
    return np.allclose(predicted, stage.solution.predicted_per_sr, rtol=rtol)


def limit_by_refits(stage: Stage, direction: Direction, limit: float, critical_z: float) -> float:
    """Strength from which on refits of the model leave what a screen calls; the largest where none does.

    The limit of a screen is linear: it does not know how far the free parameters can follow an effect.

    Parameters
    ----------
    stage
        The model without the effect.
    direction
        The effect.
    limit
        Detection limit of the screen, in units of the direction's column.
    critical_z
        Score that is called.

    Returns
    -------
    float
        In units of the column; at least the given limit, unless its range ends before.
    """
    effect, name = direction.effect, direction.effect.strength.name
    if isinstance(effect, AreaWithOtherValues) or not (effect.scales or name not in direction.setting):
        return limit
    bench = stage.own_bench(effect) if effect.own_program else stage.bench
    unit = direction.setting[name] - effect.neutral if name in direction.setting else 1.0
    terms = {t.name: t.value for t in effect.terms}

    def left_at(step):
        there = terms | stage.solution.values | direction.setting | {name: effect.neutral + step * unit}
        truth = bench.predict(there)
        # To the end: what a search has not yet followed is not left.
        return stage.bench.fit(stage.solution.values, stage.free, measured=truth).chi_square

    multiples = stage.setup.policy.limit_multiples
    steps = sorted({min(factor * limit, direction.largest) for factor in multiples}, reverse=True)
    middle = steps[len(steps) // 2]
    # A linear limit leaves the square of the multiple; half of that is near enough.
    if left_at(middle) >= (critical_z * middle / limit) ** 2 / 2:
        return limit
    seen = direction.largest
    for step in steps:
        if not left_at(step) >= critical_z**2:
            break
        seen = step
    return seen
