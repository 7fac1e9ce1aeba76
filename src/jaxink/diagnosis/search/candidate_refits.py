"""Refits of candidates with all other parameters of a stage, and detection limits verified by refits."""

import dataclasses
import itertools
import logging
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.stage import Stage, by_program
from jaxink.effects import AreaWithOtherValues, Effect
from jaxink.fitting import DECREMENT, Outcome, UnitScale, require_slope
from jaxink.numerics.threads import in_threads

_LOG = logging.getLogger("jaxink")


class _Start(NamedTuple):
    """Start of a refit: other parameters, setting and step of the effect, and the promised decrease."""

    promise: float
    origin: dict[str, float]
    setting: dict[str, float]
    step: float


def best_refit(stage: Stage, directions: list[Direction]) -> Refit | None:
    """Refit of the form of an effect that fits best, after a penalty for its number of terms.

    Forms whose refit fails are noted; None if all of them do.
    """
    name = directions[0].effect.name
    programs = by_program(form for form in stage.listed.forms if form.name == name)
    is_alone = sum(map(len, programs.values())) == 1

    def refits_of(forms: list[Effect]) -> list[Refit]:
        found = []
        for form in forms:
            which = "" if is_alone else f" as {form}"
            with stage.setup.failures.sparing(f"the refit with {name}{which}", name):
                found.append(refit(stage, form, directions))
        return found

    found = itertools.chain.from_iterable(in_threads(refits_of, programs.values()))
    return max(found, key=lambda r: r.penalised(len(stage.residual)), default=None)


def refit_from(stage: Stage, directions: list[Direction], origins: Sequence[dict[str, float]]) -> None:
    """Refit all forms of an effect, also from further values of the other parameters."""
    name = directions[0].effect.name
    for form in [form for form in stage.listed.forms if form.name == name]:
        with stage.setup.failures.sparing(f"the refit with {name} from another start", name):
            bench = refit(stage, form, directions).bench
            for begun, there in itertools.product(_promising(stage, form, directions)[:1], origins):
                start = begun._replace(origin=stage.solution.values | there)
                _keep_if_lower(stage, form, bench, _from_start(stage, form, bench, start))


def refit_by_scan(stage: Stage, directions: list[Direction]) -> Refit | None:
    """As `best_refit`, for an effect of the particles also from the best of many sizes of particles.

    The other parameters are fitted at each size with the effect at a usual strength, roughly, as in the scan
    of the declared model: the size that is true with the effect need not be a minimum without it.
    """
    name, policy = directions[0].effect.name, stage.setup.policy
    sizes = [p for p in stage.setup.sample.parameters.free if p.multimodal]
    if not sizes or not directions[0].effect.changes_particles:
        return best_refit(stage, directions)
    scale = UnitScale.of((sizes[0],))
    for form in [form for form in stage.listed.forms if form.name == name]:
        with stage.setup.failures.sparing(f"the refit with {name} at other sizes", name):
            bench, found = refit(stage, form, directions).bench, list[Solution]()
            rest = tuple(n for n in _free_with(stage, form) if n != sizes[0].name)
            at = {t.name: t.value for t in form.terms} | stage.solution.values | form.settings[-1]
            for unit in np.linspace(0, 1, policy.scanned_sizes):
                there = {sizes[0].name: float(scale.to_physical(np.array([unit]))[0])}
                how = policy.scan_jacobians, policy.limit_decrement
                found.append(bench.fit(at | there, rest, *how))
            found = sorted((one for one in found if _has_slope(one)), key=lambda one: one.chi_square)
            for one in found[: policy.scanned_kept]:
                end = bench.fit(one.values, _free_with(stage, form), policy.refit_jacobians)
                _keep_if_lower(stage, form, bench, end)
    return best_refit(stage, directions)


def _free_with(stage: Stage, effect: Effect) -> tuple[str, ...]:
    return stage.free + tuple(t.name for t in effect.terms)


def _keep_if_lower(stage: Stage, effect: Effect, bench: CandidateObjective, found: Solution) -> None:
    if _has_slope(found) and found.chi_square < stage.refits[effect].solution.chi_square:
        lower = stage.solution.chi_square - found.chi_square
        stage.refits[effect] = Refit(effect, found, bench, lower)


def continued_refit(stage: Stage, begun: Refit) -> Refit:
    """The refit, continued until chi-square is known well enough to compare it with others."""
    policy, done = stage.setup.policy, begun
    if begun.is_polished:
        return begun
    for _ in range(policy.polish_rounds):
        if done.solution.search.outcome.converged:
            break
        before = done
        done = _continued(stage, before, policy.polish_decrement, policy.polish_jacobians)
        if done.delta_chi_square - before.delta_chi_square < policy.polish_gain:
            break
    return done


def converged(stage: Stage, begun: Refit) -> Refit:
    """The refit, continued to convergence."""
    return _continued(stage, begun, DECREMENT, stage.setup.policy.converged_jacobians)


def _continued(stage: Stage, begun: Refit, decrement: float, most: int) -> Refit:
    values, free = begun.solution.values, begun.solution.free
    found = begun.bench.fit(values, free, max_jacobians=most, decrement=decrement)
    require_slope(found.search)
    lower = stage.solution.chi_square - found.chi_square
    done = dataclasses.replace(begun, solution=found, delta_chi_square=lower, is_polished=True)
    stage.refits[begun.effect] = done
    return done


def refit(stage: Stage, effect: Effect, directions: list[Direction]) -> Refit:
    """Fit an effect with all other parameters, from its most promising settings.

    Raises
    ------
    NotFiniteError
        No search ends where the model and its derivatives are finite.
    """
    if effect in stage.refits:
        return stage.refits[effect]
    bench = stage.own_bench(effect) if effect.own_program else stage.bench
    free = _free_with(stage, effect)
    neutral = {t.name: t.value for t in effect.terms}
    best: Solution | None = None
    for start in _starts(stage, effect, directions):
        found = _from_start(stage, effect, bench, start)
        if _has_slope(found) and (best is None or found.chi_square < best.chi_square):
            best = found
    if best is None or best.chi_square > stage.solution.chi_square:
        # Starting with the effect absent cannot make the fit worse.
        absent = neutral | stage.solution.values
        # A slightly rough face has peaks too narrow to be resolved, so it differs from the smooth one.
        if best is None or _is_same(stage, bench.predict(absent)):
            here = bench.fit(absent, free, max_jacobians=stage.setup.policy.refit_jacobians)
            best = here if best is None or here.chi_square < best.chi_square else best
    require_slope(best.search)
    done = Refit(effect, best, bench, stage.solution.chi_square - best.chi_square)
    _LOG.debug("%s: chi-square decreases by %.6g", effect.name, done.delta_chi_square)
    stage.refits[effect] = done
    return done


def _from_start(stage: Stage, effect: Effect, bench: CandidateObjective, start: _Start) -> Solution:
    neutral = {t.name: t.value for t in effect.terms}
    values = neutral | start.origin | start.setting | effect.start(start.setting, start.step)
    return bench.fit(values, _free_with(stage, effect), max_jacobians=stage.setup.policy.refit_jacobians)


def _has_slope(found: Solution) -> bool:
    return found.search.outcome not in (Outcome.NOT_FINITE, Outcome.NO_SLOPE)


def _starts(stage: Stage, effect: Effect, directions: list[Direction]) -> list[_Start]:
    """Starts at the solution; if that is far off, also at the declared sample; and at rival minima."""
    found = _promising(stage, effect, directions)
    chosen = found[: stage.setup.policy.refit_starts]
    if stage.is_far and found:
        base = stage.bench.base_free
        declared = {name: value for name, value in stage.bench.start.items() if name in base}
        chosen.insert(1, found[0]._replace(origin=stage.solution.values | declared))
    if effect.group == "volume" and found:
        # One size of particles imitates a distribution of sizes at quite another radius.
        chosen += [found[0]._replace(origin=stage.solution.values | there) for there in stage.setup.rivals]
    return chosen


def _promising(stage: Stage, effect: Effect, directions: list[Direction]) -> list[_Start]:
    """Settings of an effect at the solution, those that promise most first."""
    found = []
    for direction in (d for d in directions if d.effect == effect or not effect.is_screened):
        z, norm = stage.score(direction)
        if not norm > 0:
            continue
        step = float(np.clip(z / norm, -direction.largest, direction.largest))
        promise = direction.reachable_delta_chi_square(z, norm)
        found.append(_Start(promise, stage.solution.values, direction.setting, step))
    return sorted(found, key=lambda start: -start.promise)


def _is_same(stage: Stage, predicted) -> bool:
    rtol = stage.setup.policy.same_prediction
    return np.allclose(predicted, stage.solution.predicted_per_sr, rtol=rtol)


def limit_by_refits(stage: Stage, direction: Direction, limit: float, critical_z: float) -> float:
    """Smallest strength of which a refit without the effect leaves a detectable misfit, or the largest.

    The limit of a screen is linear and does not know how far the free parameters can mimic an effect.

    Parameters
    ----------
    stage
        The model without the effect.
    direction
        The effect.
    limit
        Detection limit of the screen, in units of the direction's column.
    critical_z
        Score at which the effect is detected.

    Returns
    -------
    float
        In units of the column; at least the given limit, unless the range of the effect ends earlier.
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
        decrement = stage.setup.policy.limit_decrement
        return stage.bench.fit_near(stage.linearised, measured=truth, decrement=decrement).chi_square

    multiples = stage.setup.policy.limit_multiples
    steps = sorted({min(factor * limit, direction.largest) for factor in multiples}, reverse=True)
    middle = steps[len(steps) // 2]
    # A linear limit leaves the square of the multiple; half of that is close enough.
    if left_at(middle) >= (critical_z * middle / limit) ** 2 / 2:
        return limit
    seen = direction.largest
    for step in steps:
        if not left_at(step) >= critical_z**2:
            break
        seen = step
    return seen
