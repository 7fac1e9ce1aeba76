"""The search for effects: screen, refit, accept, and repeat with the enlarged model."""

import dataclasses
from typing import NamedTuple

from jaxink.diagnosis.search.candidate_objective import Solution
from jaxink.diagnosis.search.cross_validation import CrossValidation
from jaxink.diagnosis.search.deadline import OptionalTask
from jaxink.diagnosis.search.forward_selection import ForwardSelection
from jaxink.diagnosis.search.model import FittedModel, fit_model
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.search.problem import MODEL, SearchProblem
from jaxink.diagnosis.search.revision import (
    refit_in,
    rival_minima,
    single_cause,
    with_class_beside_others,
    without_superfluous,
)
from jaxink.diagnosis.search.screen import Screen
from jaxink.diagnosis.search.step import Addition, Step
from jaxink.diagnosis.statistics.structure import StructureResult
from jaxink.fitting import FitResult


@dataclasses.dataclass(frozen=True)
class SearchResult:
    """Result of a search.

    Parameters
    ----------
    options
        Options of the diagnosis.
    fit
        Fit of the declared model.
    problem, cross_validation
        What was fitted, and predictions of held-out points.
    first, last
        The declared model, and the model with all effects.
    steps
        Effects that were added and kept, in order.
    screens
        All screens, that of the declared model first.
    structure_before, structure_after
        Tests for structure in the residuals of the first and of the last model.
    rivals
        Other minima of the last model, lowest first.
    """

    options: DiagnosisOptions
    fit: FitResult
    problem: SearchProblem
    cross_validation: CrossValidation
    first: FittedModel
    last: FittedModel
    steps: tuple[Step, ...]
    screens: tuple[Screen, ...]
    structure_before: StructureResult
    structure_after: StructureResult
    rivals: tuple[Solution, ...]


class _Explanation(NamedTuple):
    """A model, the steps that led to it, and the structure that it leaves in the residual."""

    model: FittedModel
    steps: tuple[Step, ...]
    structure: StructureResult

    def is_quiet(self, level: float) -> bool:
        """Whether its residual is consistent with noise, or with the known error of the model."""
        is_noise = min(self.structure.p_value, self.structure["chi_square"].p_value) >= level
        return is_noise or self.model.is_within_own_error


def search_effects(problem: SearchProblem, fit: FitResult, options: DiagnosisOptions) -> SearchResult:
    """Search for effects that a fitted model lacks; a part that fails is noted, and the search goes on.

    Parameters
    ----------
    problem
        The problem that the fit poses; see `problem_of`.
    fit
        Fit of the declared model.
    options
        Options of the diagnosis.
    """
    deadline, cross_validation = problem.deadline, CrossValidation(problem)
    names = (effect.name for effect in problem.listed(()).forms)
    has_time = deadline.permits(OptionalTask.SCREEN, names)
    first = fit_model(problem if has_time else problem.without_candidates(), (), fit.values)
    declared = found = _Explanation(first, (), first.structure())
    screens: list[Screen] = []
    additions: list[Addition] = []
    # Effects that make each other unnecessary must not alternate forever.
    for _ in range(2 * options.max_effects + 1):
        problem.follow("screen", len(found.steps) + 1, found.model.solution.chi_square)
        if found.steps and found.is_quiet(options.level):
            break
        if found.steps and not deadline.permits(OptionalTask.REPETITION):
            break
        screens.append(Screen.of(found.model))
        added = _added(found, screens[-1], options, cross_validation)
        if added is None:
            break
        enlarged = _enlarged(problem, found, added, options.level)
        if enlarged is None:
            break
        additions.append(added)
        found.model.objectives.release(kept=enlarged.model.objective)
        found = enlarged
    if len(found.steps) > 1 and not deadline.is_over:
        # The effect that was accepted first goes on from where it has converged.
        screens[0].refits.keep(additions[0].refit)
        found = _by_single_cause(problem, found, screens[0], cross_validation)
    rivals: tuple[Solution, ...] = ()
    if found.steps and not deadline.is_over:
        found, rivals = _at_lowest_minimum(problem, found, declared)
    steps = found.steps
    if len(steps) > 1:
        steps = tuple(with_class_beside_others(problem, found.model, step) for step in steps)
    return SearchResult(
        options=options,
        fit=fit,
        problem=problem,
        cross_validation=cross_validation,
        first=first,
        last=found.model,
        steps=steps,
        screens=tuple(screens),
        structure_before=declared.structure,
        structure_after=found.structure,
        rivals=rivals,
    )


def _added(
    found: _Explanation, screen: Screen, options: DiagnosisOptions, cross_validation: CrossValidation
) -> Addition | None:
    """The next effect, if there is room for one and one passes all tests."""
    room = options.max_effects - len(found.steps)
    if room <= 0:
        return None
    # If the residual passes as noise, only highly significant effects are accepted.
    is_noise = found.is_quiet(options.policy.noise_p)
    return ForwardSelection(screen, options, cross_validation).next_step(room > 1, is_noise)


def _enlarged(
    problem: SearchProblem, found: _Explanation, added: Addition, level: float
) -> _Explanation | None:
    """The model with one more effect; with candidates for the next screen, unless only noise is left.

    None if its fit fails.
    """
    accepted, name = without_superfluous(found.model, added), added.step.effect
    enlarged: _Explanation | None = None
    with problem.failures.sparing(MODEL, name):
        model = fit_model(problem, accepted.effects, accepted.values, accepted.objective)
        steps = tuple(step for step in (*found.steps, added.step) if step.form in accepted.effects)
        enlarged = _Explanation(model, steps, model.structure())
    if enlarged is None or enlarged.is_quiet(level) or problem.deadline.is_over:
        return enlarged
    with problem.failures.sparing("the search for an effect in addition to {}", name):
        model = fit_model(problem, accepted.effects, enlarged.model.solution.values)
        return _Explanation(model, enlarged.steps, model.structure())
    return enlarged


def _by_single_cause(
    problem: SearchProblem, found: _Explanation, screen: Screen, cross_validation: CrossValidation
) -> _Explanation:
    """The model with the one effect that explains as much as several, if there is one."""
    alone: Addition | None = None
    with problem.failures.sparing("the comparison of several effects with a single one", ""):
        alone = single_cause(screen, found.model, found.steps, cross_validation)
    if alone is None:
        return found
    model = fit_model(problem, (alone.step.form,), alone.refit.solution.values, alone.refit.objective)
    return _Explanation(model, (alone.step,), model.structure())


def _at_lowest_minimum(
    problem: SearchProblem, found: _Explanation, declared: _Explanation
) -> tuple[_Explanation, tuple[Solution, ...]]:
    """The model at the lowest of its minima, and the others."""
    left, rivals = found.model, tuple[Solution, ...]()
    with problem.failures.sparing("the search for other minima of the corrected model", ""):
        rivals = rival_minima(left)
    lower = left.solution.chi_square - problem.policy.lower_minimum
    if not (rivals and rivals[0].chi_square < lower):
        return found, rivals
    with problem.failures.sparing("the lower minimum of the corrected model", ""):
        model = fit_model(problem, left.accepted, rivals[0].values, left.objective)
        before = declared.model.solution.chi_square
        steps = tuple(step.with_numbers_of(refit_in(model, step, before)) for step in found.steps)
        return _Explanation(model, steps, model.structure()), (*rivals, left.solution)
    return found, rivals
