"""Which effects the data cannot distinguish from one that was found, in the presence of all others."""

import dataclasses

from jaxink.diagnosis.search.allowance import Task
from jaxink.diagnosis.search.candidate_refits import best_refit, polished
from jaxink.diagnosis.search.refit import Refit
from jaxink.diagnosis.search.setup import Setup
from jaxink.diagnosis.search.stage import Stage
from jaxink.diagnosis.search.step import Step
from jaxink.numerics.progress import StepOf


def with_class_beside_others(setup: Setup, last: Stage, step: Step, n_points: int) -> Step:
    """A step with its class determined again in the presence of all other effects, if there is time."""
    policy, allowance = setup.policy, setup.allowance
    if not allowance.permits(Task.COMPARISON, [step.effect]):
        return step
    others = tuple(e for e in last.accepted if e != step.form)
    terms = tuple(term.name for term in step.form.terms)
    without: Stage | None = None
    with setup.failures.sparing("the fit of all other effects without {}", step.effect):
        without = Stage(setup, others, {k: v for k, v in last.solution.values.items() if k not in terms})
    if without is None:
        return step
    directions = without.directions(with_own=False)
    order = sorted(directions, key=lambda name: -without.promise(directions[name]))
    delta_chi_square = without.solution.chi_square - last.solution.chi_square
    own = Refit(step.form, last.solution, last.bench, delta_chi_square)
    rivals = []
    names = [name for name in order[: policy.most_rivals] if name != step.effect]
    for number, name in enumerate(names, start=1):
        if allowance.permits(Task.COMPARISON, [step.effect]):
            what = f"comparison with {step.effect}, {name}"
            setup.follow(what, StepOf(number, len(names)), last.solution.chi_square)
            with setup.failures.sparing(f"the comparison of {step.effect} with {{}}", name):
                begun = best_refit(without, directions[name])
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
