"""Refits of candidates with all other parameters of a model, and detection limits verified by refits."""

import dataclasses
import itertools
import logging
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.diagnosis.search.direction import Direction
from jaxink.diagnosis.search.model import FittedModel, by_program
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.screen import Screen
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


def best_refit(screen: Screen, name: str) -> Refit | None:
    """Refit all forms of an effect that have not been refitted; return the one that fits best.

    Forms differ in their number of terms, for which they pay a penalty. Forms whose refit fails are noted;
    None if all of them do.
    """
    programs = by_program(_forms(screen, name))
    is_alone = sum(map(len, programs.values())) == 1

    def refit_forms(forms: list[Effect]) -> None:
        for form in forms:
            which = "" if is_alone else f" as {form}"
            with screen.model.problem.failures.sparing(f"the refit with {name}{which}", name):
                refit(screen, form)

    in_threads(refit_forms, programs.values())
    return screen.refits.best.get(name)


def refit_from(screen: Screen, name: str, origins: Sequence[dict[str, float]]) -> None:
    """Refit all forms of an effect, also from further values of the other parameters."""
    model = screen.model
    for form in _forms(screen, name):
        with model.problem.failures.sparing(f"the refit with {name} from another start", name):
            lowest = refit(screen, form)
            for begun, there in itertools.product(_promising(screen, form)[:1], origins):
                start = begun._replace(origin=model.solution.values | there)
                lowest = _lower(model, lowest, _from_start(model, form, lowest.objective, start))
                screen.refits.keep(lowest)


def refit_by_scan(screen: Screen, name: str) -> Refit | None:
    """As `best_refit`, for an effect of the particles also from the best of many sizes of particles.

    The other parameters are fitted at each size with the effect at a usual strength, roughly, as in the scan
    of the declared model: the size that is true with the effect need not be a minimum without it.
    """
    model, policy = screen.model, screen.model.problem.policy
    sizes = [p for p in model.problem.sample.parameters.free if p.multimodal]
    if not sizes or not screen.directions[name][0].effect.changes_particles:
        return best_refit(screen, name)
    size, scale = sizes[0].name, UnitScale.of((sizes[0],))
    for form in _forms(screen, name):
        with model.problem.failures.sparing(f"the refit with {name} at other sizes", name):
            lowest, found = refit(screen, form), list[Solution]()
            objective, free = lowest.objective, _free_with(model, form)
            rest = tuple(n for n in free if n != size)
            at = {t.name: t.value for t in form.terms} | model.solution.values | form.settings[-1]
            for unit in np.linspace(0, 1, policy.scanned_sizes):
                there = {size: float(scale.to_physical(np.array([unit]))[0])}
                found.append(objective.fit(at | there, rest, policy.scan_jacobians, policy.limit_decrement))
            found = sorted((one for one in found if _has_slope(one)), key=lambda one: one.chi_square)
            for one in found[: policy.scanned_kept]:
                lowest = _lower(model, lowest, objective.fit(one.values, free, policy.refit_jacobians))
                screen.refits.keep(lowest)
    return best_refit(screen, name)


def refit(screen: Screen, form: Effect) -> Refit:
    """Fit an effect with all other parameters, from its most promising settings, unless that is done.

    Raises
    ------
    NotFiniteError
        No search ends where the model and its derivatives are finite.
    """
    known = screen.refits.of(form)
    if known is not None:
        return known
    model = screen.model
    objective, free = model.objectives.of(form), _free_with(model, form)
    best: Solution | None = None
    for start in _starts(screen, form):
        found = _from_start(model, form, objective, start)
        if _has_slope(found) and (best is None or found.chi_square < best.chi_square):
            best = found
    if best is None or best.chi_square > model.solution.chi_square:
        # Starting with the effect absent cannot make the fit worse.
        absent = {t.name: t.value for t in form.terms} | model.solution.values
        # A slightly rough face has peaks too narrow to be resolved, so it differs from the smooth one.
        if best is None or _is_same(model, objective.predict(absent)):
            here = objective.fit(absent, free, max_jacobians=model.problem.policy.refit_jacobians)
            best = here if best is None or here.chi_square < best.chi_square else best
    require_slope(best.search)
    done = Refit(form, best, objective, model.solution.chi_square - best.chi_square)
    _LOG.debug("%s: chi-square decreases by %.6g", form.name, done.delta_chi_square)
    screen.refits.keep(done)
    return done


def polished(model: FittedModel, begun: Refit) -> Refit:
    """A refit, continued until chi-square is known well enough to compare it with others."""
    policy, done = model.problem.policy, begun
    if begun.is_polished:
        return begun
    for _ in range(policy.polish_rounds):
        if done.solution.search.outcome.converged:
            break
        before = done
        done = _continued(model, before, policy.polish_decrement, policy.polish_jacobians)
        if done.delta_chi_square - before.delta_chi_square < policy.polish_gain:
            break
    return done


def converged(model: FittedModel, begun: Refit) -> Refit:
    """A refit, continued to convergence."""
    return _continued(model, begun, DECREMENT, model.problem.policy.converged_jacobians)


def _continued(model: FittedModel, begun: Refit, decrement: float, most: int) -> Refit:
    values, free = begun.solution.values, begun.solution.free
    found = begun.objective.fit(values, free, max_jacobians=most, decrement=decrement)
    require_slope(found.search)
    lower = model.solution.chi_square - found.chi_square
    return dataclasses.replace(begun, solution=found, delta_chi_square=lower, is_polished=True)


def _forms(screen: Screen, name: str) -> list[Effect]:
    return [form for form in screen.model.listed.forms if form.name == name]


def _free_with(model: FittedModel, effect: Effect) -> tuple[str, ...]:
    return model.free + tuple(t.name for t in effect.terms)


def _lower(model: FittedModel, known: Refit, found: Solution) -> Refit:
    """Whichever is lower in chi-square: a refit, or one with another solution."""
    if _has_slope(found) and found.chi_square < known.solution.chi_square:
        return Refit(known.effect, found, known.objective, model.solution.chi_square - found.chi_square)
    return known


def _from_start(model: FittedModel, effect: Effect, objective: CandidateObjective, start: _Start) -> Solution:
    neutral = {t.name: t.value for t in effect.terms}
    values = neutral | start.origin | start.setting | effect.start(start.setting, start.step)
    return objective.fit(
        values, _free_with(model, effect), max_jacobians=model.problem.policy.refit_jacobians
    )


def _has_slope(found: Solution) -> bool:
    return found.search.outcome not in (Outcome.NOT_FINITE, Outcome.NO_SLOPE)


def _starts(screen: Screen, effect: Effect) -> list[_Start]:
    """Starts at the solution; if that is far off, also at the declared sample; and at rival minima."""
    model, problem = screen.model, screen.model.problem
    found = _promising(screen, effect)
    chosen = found[: problem.policy.refit_starts]
    if model.is_far and found:
        declared = model.objective.declared
        chosen.insert(1, found[0]._replace(origin=model.solution.values | declared))
    if effect.group == "volume" and found:
        # One size of particles imitates a distribution of sizes at quite another radius.
        chosen += [found[0]._replace(origin=model.solution.values | there) for there in problem.rivals]
    return chosen


def _promising(screen: Screen, effect: Effect) -> list[_Start]:
    """Settings of an effect at the solution, those that promise most first."""
    model, found = screen.model, []
    directions = screen.directions[effect.name]
    for direction in (d for d in directions if d.effect == effect or not effect.is_screened):
        z, norm = model.score(direction)
        if not norm > 0:
            continue
        step = float(np.clip(z / norm, -direction.largest, direction.largest))
        promise = direction.reachable_delta_chi_square(z, norm)
        found.append(_Start(promise, model.solution.values, direction.setting, step))
    return sorted(found, key=lambda start: -start.promise)


def _is_same(model: FittedModel, predicted) -> bool:
    rtol = model.problem.policy.same_prediction
    return np.allclose(predicted, model.solution.predicted_per_sr, rtol=rtol)


def limit_by_refits(model: FittedModel, direction: Direction, limit: float, critical_z: float) -> float:
    """Smallest strength of which a refit without the effect leaves a detectable misfit, or the largest.

    The limit of a screen is linear and does not know how far the free parameters can mimic an effect.

    Parameters
    ----------
    model
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
    objective, policy = model.objectives.of(effect), model.problem.policy
    unit = direction.setting[name] - effect.neutral if name in direction.setting else 1.0
    terms = {t.name: t.value for t in effect.terms}

    def left_at(step):
        there = terms | model.solution.values | direction.setting | {name: effect.neutral + step * unit}
        truth = objective.predict(there)
        decrement = policy.limit_decrement
        return model.objective.fit_near(model.linearised, measured=truth, decrement=decrement).chi_square

    steps = sorted(
        {min(factor * limit, direction.largest) for factor in policy.limit_multiples}, reverse=True
    )
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
