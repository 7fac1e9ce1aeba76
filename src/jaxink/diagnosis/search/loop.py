"""The search for effects: screen, refit, accept, and repeat with the enlarged model.

Before several effects are accepted, each candidate is tried alone, from every start.

Two unlike effects, one of them weak, may imitate a third one that was never fitted in full: because its
program is costly, because it is degenerate at the minimum of the declared model, or because its refit ended
in another minimum.
"""

import dataclasses
import logging
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.policy import SearchPolicy
from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Solution
from jaxink.diagnosis.search.candidate_refits import (
    best_refit,
    continued_refit,
    converged,
    refit_by_scan,
    refit_from,
)
from jaxink.diagnosis.search.checkpoint import Checkpoint
from jaxink.diagnosis.search.cross_validation import CrossValidation
from jaxink.diagnosis.search.deadline import Deadline, OptionalTask
from jaxink.diagnosis.search.forward_selection import ForwardSelection
from jaxink.diagnosis.search.refit import Refit, penalty
from jaxink.diagnosis.search.setup import MODEL, DiagnosisOptions, SearchProblem
from jaxink.diagnosis.search.stage import Stage
from jaxink.diagnosis.search.step import Addition, Screening, Step
from jaxink.diagnosis.statistics.candidate import Testability
from jaxink.diagnosis.statistics.points import Points
from jaxink.diagnosis.statistics.structure import StructureResult, find_structure
from jaxink.effects import Effect, Scene, invalidity, model_at
from jaxink.fitting import FitResult, UnitScale, require_slope
from jaxink.measurement import noise_of
from jaxink.numerics.failures import Failures
from jaxink.numerics.progress import Progress, StepOf
from jaxink.sample import Sample
from jaxink.solver import SolverConfig

_LOG = logging.getLogger("jaxink")
# Minima closer together than this fraction of the scanned range count as one.
_ANOTHER_MINIMUM = 0.02


@dataclasses.dataclass(frozen=True)
class SearchResult:
    """Result of a search.

    Parameters
    ----------
    options
        Options of the diagnosis.
    fit
        Fit of the declared model.
    setup, points, cross_validation
        The measurement, the settings of its points, and predictions of held-out points.
    first, last
        The declared model, and the model with all effects.
    steps
        Effects that were added and kept, in order.
    screenings
        All screens, that of the declared model first.
    structure_before, structure_after
        Tests for structure in the residuals of the first and of the last model.
    rivals
        Other minima of the last model, lowest first.
    """

    options: DiagnosisOptions
    fit: FitResult
    setup: SearchProblem
    points: Points
    cross_validation: CrossValidation
    first: Stage
    last: Stage
    steps: tuple[Step, ...]
    screenings: tuple[Screening, ...]
    structure_before: StructureResult
    structure_after: StructureResult
    rivals: tuple[Solution, ...]


class _Accepted(NamedTuple):
    """Effects, values of all parameters with them, and a workbench that has their program."""

    effects: tuple[Effect, ...]
    values: dict[str, float]
    bench: CandidateObjective


def search_effects(
    fit: FitResult,
    sample: Sample,
    options: DiagnosisOptions,
    follow: Progress,
    deadline: Deadline,
    failures: Failures,
    checkpoint: Checkpoint,
) -> SearchResult:
    """Search for effects that a fitted model lacks; `follow` is called with task, step and chi-square.

    A part that fails is noted in `failures`, and the search goes on without it.
    """
    setup, points = _setup(fit, sample, options), Points.of(fit.data)
    setup = dataclasses.replace(
        setup, deadline=deadline, failures=failures, follow=follow, checkpoint=checkpoint
    )
    cross_validation = CrossValidation(setup, points)
    selection = ForwardSelection(options, len(points), cross_validation)
    is_in_time = deadline.permits(OptionalTask.SCREEN, (effect.name for effect in setup.listed(()).forms))
    stage = first = Stage(setup if is_in_time else setup.without_candidates(), (), fit.values)
    structure = structure_before = _structure(first, points)
    steps: list[Step] = []
    screenings: list[Screening] = []
    # Effects that make each other unnecessary must not alternate forever.
    for _ in range(2 * options.max_effects + 1):
        follow("screen", len(steps) + 1, stage.solution.chi_square)
        if steps and _is_quiet(stage, structure, options.level):
            break
        if steps and not deadline.permits(OptionalTask.REPETITION):
            break
        screenings.append(Screening.of(stage))
        room = options.max_effects - len(steps)
        # If the residual passes as noise, only highly significant effects are accepted.
        is_noise = _is_quiet(stage, structure, options.policy.noise_p)
        added = selection.next_step(screenings[-1], room > 1, is_noise) if room > 0 else None
        if added is None:
            break
        step, accepted = added.step, _without_superfluous(stage, added, len(points))
        left, ahead = stage, None
        with failures.sparing(MODEL, step.effect):
            ahead = Stage(setup, accepted.effects, accepted.values, accepted.bench)
            structure = _structure(ahead, points)
        if ahead is None:
            break
        stage, steps = ahead, [s for s in (*steps, step) if s.form in accepted.effects]
        if not (_is_quiet(stage, structure, options.level) or deadline.is_over):
            # Screen again, for all effects that are not yet in the model.
            with failures.sparing("the search for an effect in addition to {}", step.effect):
                stage = Stage(setup, accepted.effects, stage.solution.values)
                structure = _structure(stage, points)
        left.release(kept=stage.bench)
    if len(steps) > 1 and not deadline.is_over:
        alone: Addition | None = None
        with failures.sparing("the comparison of several effects with a single one", ""):
            alone = single_cause(screenings[0], stage, steps, cross_validation, len(points))
        if alone is not None:
            stage = Stage(setup, (alone.step.form,), alone.refit.solution.values, alone.refit.bench)
            structure, steps = _structure(stage, points), [alone.step]
    rivals: tuple[Solution, ...] = ()
    if steps and not deadline.is_over:
        with failures.sparing("the search for other minima of the corrected model", ""):
            rivals = rival_minima(stage)
        if rivals and rivals[0].chi_square < stage.solution.chi_square - options.policy.lower_minimum:
            left = stage
            with failures.sparing("the lower minimum of the corrected model", ""):
                stage = Stage(setup, left.accepted, rivals[0].values, left.bench)
                structure, rivals = _structure(stage, points), (*rivals, left.solution)
                steps = [_at(stage, step, first.solution.chi_square) for step in steps]
    if len(steps) > 1:
        steps = [with_class_beside_others(setup, stage, step, len(points)) for step in steps]
    return SearchResult(
        options=options,
        fit=fit,
        setup=setup,
        points=points,
        cross_validation=cross_validation,
        first=first,
        last=stage,
        steps=tuple(steps),
        screenings=tuple(screenings),
        structure_before=structure_before,
        structure_after=structure,
        rivals=rivals,
    )


def _at(stage: Stage, step: Step, chi_square_before: float) -> Step:
    """A step with the numbers that its effect has in a stage."""
    solution = stage.solution
    return step.with_numbers_of(
        Refit(step.form, solution, stage.bench, chi_square_before - solution.chi_square)
    )


def _setup(fit: FitResult, sample: Sample, options: DiagnosisOptions) -> SearchProblem:
    data = fit.data
    used, noise = data.used, noise_of(data, sample.noise)
    return SearchProblem(
        sample,
        data,
        noise,
        _sizes(fit, sample, options),
        Scene.of(*data.used_directions, row=data.reading_order[used]),
        options.catalogue,
        dataclasses.replace(options.screen, noise_freedom=noise.degrees_of_freedom),
        options.fit.accuracy,
        options.policy,
        rivals=_rivals(fit, sample, options.policy),
    )


def _rivals(fit: FitResult, sample: Sample, policy: SearchPolicy) -> tuple[dict[str, float], ...]:
    """Other minima of the fit along a parameter for which the misfit has several, lowest first."""
    free = {p.name: p for p in sample.parameters.free}
    rugged = next((p for p in free.values() if p.multimodal), None)
    if rugged is None:
        return ()
    scale = UnitScale.of((rugged,))

    def place(values):
        return float(scale.to_unit(np.array([values[rugged.name]]))[0])

    at, found = [place(fit.values)], list[dict[str, float]]()
    for search in sorted((s for s in fit.searches if s.is_single), key=lambda s: s.loss):
        there = place(search.values)
        if all(abs(there - other) > _ANOTHER_MINIMUM for other in at):
            at.append(there)
            found.append({name: search.values[name] for name in free})
    return tuple(found[: policy.rival_minima])


def _sizes(fit: FitResult, sample: Sample, options: DiagnosisOptions) -> SolverConfig:
    """Resolution of the fit, or of its start if the fit is far off: it may have run into a narrow peak."""
    reduced, far = fit.merit.reduced_chi_square, options.policy.far_reduced_chi_square
    if options.fit.config is not None or reduced is None or reduced < far:
        return fit.config
    data = fit.data
    at = data.used_directions, data.reading_order[data.used]
    method = options.fit.layer_method
    return model_at(sample, *at, accuracy=options.fit.accuracy, layer_method=method).config


def _structure(stage: Stage, points: Points) -> StructureResult:
    return find_structure(
        stage.residual,
        stage.jacobian,
        points,
        at_bound=stage.at_bound,
        options=stage.setup.options,
        policy=stage.setup.policy,
    )


def _is_quiet(stage: Stage, structure: StructureResult, level: float) -> bool:
    """Whether a residual is consistent with noise, or with the known error of the model."""
    is_noise = min(structure.p_value, structure["chi_square"].p_value) >= level
    return is_noise or stage.is_within_own_error


def _without_superfluous(stage: Stage, added: Addition, n_points: int) -> _Accepted:
    """Effects found so far, without one that the last step made unnecessary."""
    refit = added.refit
    effects = (*stage.accepted, added.step.form)
    for effect in stage.accepted:
        if not stage.setup.deadline.permits(OptionalTask.COMPARISON, [effect.name]):
            break
        terms = {t.name for t in effect.terms}
        free = tuple(name for name in refit.solution.free if name not in terms)
        neutral = {effect.strength.name: effect.neutral}
        without: Solution | None = None
        with stage.setup.failures.sparing("the fit without {}", effect.name):
            without = refit.bench.fit(refit.solution.values | neutral, free)
            require_slope(without.search)
        if without is None:
            continue
        if without.chi_square - refit.solution.chi_square < len(terms) * np.log(n_points):
            _LOG.debug("%s is no longer needed", effect.name)
            left = tuple(e for e in effects if e != effect)
            return _Accepted(left, without.values, refit.bench)
    return _Accepted(effects, refit.solution.values, refit.bench)


def rival_minima(stage: Stage) -> tuple[Solution, ...]:
    """Fits of the model from every other minimum that the fit of the declared sample has found, lowest first.

    Parameters
    ----------
    stage
        The model with all effects.

    Returns
    -------
    tuple of Solution
        Those that have converged at physically valid values; empty if the declared misfit has one
        minimum.
    """
    setup, here = stage.setup, stage.solution
    most = setup.policy.converged_jacobians
    found = [stage.bench.fit(here.values | there, here.free, max_jacobians=most) for there in setup.rivals]
    wavelengths = setup.scene.wavelength_nm
    sound = [
        one
        for one in found
        if one.search.outcome.converged
        and not any(invalidity(effect, one.values, wavelengths) for effect in stage.accepted)
    ]
    return tuple(sorted(sound, key=lambda one: one.chi_square))


def with_class_beside_others(setup: SearchProblem, last: Stage, step: Step, n_points: int) -> Step:
    """A step with its class determined again in the presence of all other effects, if there is time."""
    policy, deadline = setup.policy, setup.deadline
    if not deadline.permits(OptionalTask.COMPARISON, [step.effect]):
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
        if deadline.permits(OptionalTask.COMPARISON, [step.effect]):
            what = f"comparison with {step.effect}, {name}"
            setup.follow(what, StepOf(number, len(names)), last.solution.chi_square)
            with setup.failures.sparing(f"the comparison of {step.effect} with {{}}", name):
                begun = best_refit(without, directions[name])
                if begun is not None:
                    rivals.append(continued_refit(without, begun))
    close = [
        r
        for r in rivals
        if r.is_like(own, n_points, policy.class_delta_chi_square)
        or r.penalised(n_points) > own.penalised(n_points)
    ]
    close.sort(key=lambda r: -r.penalised(n_points))
    members = (step.effect, *(r.effect.name for r in close))
    return dataclasses.replace(step.with_numbers_of(own), members=members)


def single_cause(
    screening: Screening, last: Stage, steps: list[Step], cross_validation: CrossValidation, n_points: int
) -> Addition | None:
    """The effect that explains the data alone as well as several do, or None.

    Parameters
    ----------
    screening
        Of the declared model.
    last
        The model with several effects.
    steps
        These effects.
    cross_validation
        Predictions of held-out points.
    n_points
        Number of points.
    """
    stage = screening.stage
    policy, deadline = stage.setup.policy, stage.setup.deadline
    base = stage.bench.base_free
    here = {name: last.solution.values[name] for name in base}
    declared = {name: stage.bench.start[name] for name in base}
    origins = (here, declared, *stage.setup.rivals)
    several = last.solution.chi_square + sum(penalty(step.form, n_points) for step in steps)
    found: list[Refit] = []
    names = [c.name for c in screening.result.candidates if c.status != Testability.NOT]
    for number, name in enumerate(names, start=1):
        if not deadline.permits(OptionalTask.SINGLE, [name]):
            continue
        lowest = min([last.solution.chi_square, *(refit.solution.chi_square for refit in found)])
        stage.setup.follow(f"{name} alone", StepOf(number, len(names)), lowest)
        refit_from(stage, screening.directions[name], origins)
        refit = refit_by_scan(stage, screening.directions[name])
        if refit is not None:
            found.append(refit)
            screening.refits[name] = refit
    wavelengths = stage.setup.scene.wavelength_nm
    leading = sorted(found, key=lambda refit: -refit.penalised(n_points))[: policy.most_polished]
    ends = [continued_refit(stage, refit) for refit in leading]
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
    gain = cross_validation.gain(stage, best)
    if gain is None or not gain.improves:
        return None
    end = converged(stage, best)
    return Addition(Step.of(screening, end, members, gain), end)
