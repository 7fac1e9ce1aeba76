"""Revision of the effects that a search has accepted.

Two unlike effects, one of them weak, may imitate a third one that was never fitted in full: because its
program is costly, because it is degenerate at the minimum of the declared model, or because its refit ended
in another minimum. Before several effects are accepted, each candidate is therefore tried alone, from every
start.
"""

import dataclasses
import logging
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.diagnosis.search.candidate_refits import (
    best_refit,
    converged,
    polished,
    refit_by_scan,
    refit_from,
)
from jaxink.diagnosis.search.cross_validation import CrossValidation
from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.model import FittedModel, fit_model
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.diagnosis.search.refit import Refit, penalty
from jaxink.diagnosis.search.screen import Screen
from jaxink.diagnosis.search.step import Addition, Step
from jaxink.diagnosis.statistics.candidate import Testability
from jaxink.effects import Effect, invalidity
from jaxink.fitting import require_slope
from jaxink.numerics.progress import StepOf

_LOG = logging.getLogger("jaxink")


class Accepted(NamedTuple):
    """Effects, values of all parameters with them, and an objective that has their program."""

    effects: tuple[Effect, ...]
    values: dict[str, float]
    objective: CandidateObjective


def without_superfluous(model: FittedModel, added: Addition) -> Accepted:
    """The effects of a model and the one added, but without one that this made unnecessary."""
    refit, problem = added.refit, model.problem
    effects = (*model.accepted, added.step.form)
    for effect in model.accepted:
        if not problem.deadline.permits(OptionalTask.COMPARISON, [effect.name]):
            break
        terms = {t.name for t in effect.terms}
        free = tuple(name for name in refit.solution.free if name not in terms)
        neutral = {effect.strength.name: effect.neutral}
        without: Solution | None = None
        with problem.failures.sparing("the fit without {}", effect.name):
            without = refit.objective.fit(refit.solution.values | neutral, free)
            require_slope(without.search)
        if without is None:
            continue
        if without.chi_square - refit.solution.chi_square < len(terms) * np.log(len(problem.points)):
            _LOG.debug("%s is no longer needed", effect.name)
            left = tuple(e for e in effects if e != effect)
            return Accepted(left, without.values, refit.objective)
    return Accepted(effects, refit.solution.values, refit.objective)


def single_cause(
    screen: Screen, last: FittedModel, steps: tuple[Step, ...], cross_validation: CrossValidation
) -> Addition | None:
    """The effect that explains the data alone as well as several do, or None.

    Parameters
    ----------
    screen
        Of the declared model; its refits are continued.
    last
        The model with several effects.
    steps
        These effects.
    cross_validation
        Predictions of held-out points.
    """
    model, problem = screen.model, screen.model.problem
    policy, n_points = problem.policy, len(problem.points)
    here = {name: last.solution.values[name] for name in model.objective.base_free}
    origins = (here, model.objective.declared, *problem.rivals)
    several = last.solution.chi_square + sum(penalty(step.form, n_points) for step in steps)
    found: list[Refit] = []
    names = [c.name for c in screen.result.candidates if c.status != Testability.NOT]
    for number, name in enumerate(names, start=1):
        if not problem.deadline.permits(OptionalTask.SINGLE, [name]):
            continue
        lowest = min([last.solution.chi_square, *(refit.solution.chi_square for refit in found)])
        problem.follow(f"{name} alone", StepOf(number, len(names)), lowest)
        refit_from(screen, name, origins)
        refit = refit_by_scan(screen, name)
        if refit is not None:
            found.append(refit)
    wavelengths = problem.scene.wavelength_nm
    leading = sorted(found, key=lambda refit: -refit.penalised(n_points))[: policy.most_polished]
    ends = [polished(model, refit) for refit in leading]
    close = [
        refit
        for refit in ends
        if refit.solution.chi_square + refit.penalty(n_points) <= several + policy.class_delta_chi_square
        and not invalidity(refit.effect, refit.solution.values, wavelengths)
    ]
    if not close:
        return None
    best = max(close, key=lambda refit: refit.penalised(n_points))
    alike = [refit for refit in close if refit.is_like(best, n_points, policy.class_delta_chi_square)]
    members = (best.effect.name, *(refit.effect.name for refit in alike if refit is not best))
    gain = cross_validation.gain(model, best)
    if gain is None or not gain.improves:
        return None
    end = converged(model, best)
    return Addition(Step.of(screen, end, members, gain), end)


def rival_minima(model: FittedModel) -> tuple[Solution, ...]:
    """Fits of a model from every other minimum that the fit of the declared sample has found, lowest first.

    Parameters
    ----------
    model
        With all effects.

    Returns
    -------
    tuple of Solution
        Those that have converged at physically valid values; empty if the declared misfit has one
        minimum.
    """
    problem, here = model.problem, model.solution
    most, wavelengths = problem.policy.converged_jacobians, problem.scene.wavelength_nm
    found = [
        model.objective.fit(here.values | there, here.free, max_jacobians=most) for there in problem.rivals
    ]
    sound = [
        one
        for one in found
        if one.search.outcome.converged
        and not any(invalidity(effect, one.values, wavelengths) for effect in model.accepted)
    ]
    return tuple(sorted(sound, key=lambda one: one.chi_square))


def with_class_beside_others(problem: SearchProblem, last: FittedModel, step: Step) -> Step:
    """A step with its class determined again in the presence of all other effects, if there is time.

    Parameters
    ----------
    problem
        With all candidates.
    last
        The model with all effects.
    step
        One of them.
    """
    policy, deadline, n_points = problem.policy, problem.deadline, len(problem.points)
    if not deadline.permits(OptionalTask.COMPARISON, [step.effect]):
        return step
    others = tuple(e for e in last.accepted if e != step.form)
    terms = tuple(term.name for term in step.form.terms)
    start = {name: value for name, value in last.solution.values.items() if name not in terms}
    without: FittedModel | None = None
    with problem.failures.sparing("the fit of all other effects without {}", step.effect):
        without = fit_model(problem, others, start)
    if without is None:
        return step
    screen = Screen.of(without, with_own=False)
    order = sorted(screen.directions, key=lambda name: -screen.promise(name))
    own = refit_in(last, step, without.solution.chi_square)
    rivals = []
    names = [name for name in order[: policy.most_rivals] if name != step.effect]
    for number, name in enumerate(names, start=1):
        if deadline.permits(OptionalTask.COMPARISON, [step.effect]):
            what = f"comparison with {step.effect}, {name}"
            problem.follow(what, StepOf(number, len(names)), last.solution.chi_square)
            with problem.failures.sparing(f"the comparison of {step.effect} with {{}}", name):
                begun = best_refit(screen, name)
                if begun is not None:
                    rivals.append(polished(without, begun))
    close = [
        r
        for r in rivals
        if r.is_like(own, n_points, policy.class_delta_chi_square)
        or r.penalised(n_points) > own.penalised(n_points)
    ]
    close.sort(key=lambda r: -r.penalised(n_points))
    members = (step.effect, *(r.effect.name for r in close))
    return dataclasses.replace(step.with_numbers_of(own), members=members)


def refit_in(model: FittedModel, step: Step, chi_square_before: float) -> Refit:
    """The fit of a model as the refit of one of its effects."""
    solution = model.solution
    return Refit(step.form, solution, model.objective, chi_square_before - solution.chi_square)
