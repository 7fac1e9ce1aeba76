"""Forward search for the effects that a joint model lacks."""

import dataclasses
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.joint.cause import Cause
from jaxink.diagnosis.joint.joint_diagnosis import JointDiagnosis, JointStep
from jaxink.diagnosis.joint.screening import Promise, screened
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.search.refit import penalty
from jaxink.effects import with_values
from jaxink.effects.telling import in_numbers
from jaxink.errors import InputRefusedError
from jaxink.fitting.gradient import Descent
from jaxink.fitting.joint_fit import fit_project, noises_of
from jaxink.fitting.joint_objective import CompiledJointObjective, JointObjective, with_settled_effects
from jaxink.fitting.joint_result import JointResult
from jaxink.fitting.limits import Limits
from jaxink.fitting.method import search
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Search
from jaxink.measurement import FitNoise
from jaxink.numerics.chi_square import probability_above
from jaxink.numerics.failures import Failures
from jaxink.numerics.precision import release_programs
from jaxink.numerics.progress import Progress, StepOf
from jaxink.projects import Measurement, Project
from jaxink.solver.config import SolverConfig

# So many of the most promising causes are fitted in each round.
_REFITS = 6
_REFIT_STEPS = 60
# A cause promises more than its penalty, or it is not fitted; the screen is linear, so half is enough.
_PROMISED = 0.5


class _Model(NamedTuple):
    """A project with the values of its joint minimum, and what belongs to it."""

    project: Project
    noises: list[FitNoise]
    objective: JointObjective
    loss: float
    unit: np.ndarray


class _Refit(NamedTuple):
    """A cause fitted with all other parameters."""

    cause: Cause
    model: _Model
    delta_chi_square: float
    probability: float
    penalised: float


def diagnose_project(project: Project, options: DiagnosisOptions, follow: Progress) -> JointDiagnosis:
    """Find what the model of several measurements lacks; see `jaxink.diagnose`.

    Parameters
    ----------
    project
        The measurements and their samples.
    options
        Of the diagnosis.
    follow
        Called with the task, the step and the loss.
    """
    declared = fit_project(project, options.fit, follow)
    if not declared.outcome.converged:
        raise InputRefusedError(
            f"the joint fit of the declared model {declared.outcome.value}, so that there is no minimum to "
            "diagnose; start elsewhere (--starts N), or fit fewer parameters."
        )
    failures, rounds = Failures(), list[tuple[_Refit, tuple[_Refit, ...], float]]()
    model = _of_result(declared, options.fit)
    n_candidates = 0
    while len(rounds) < options.max_effects:
        promises = _screen(model, options, failures, follow)
        n_candidates = max(n_candidates, len(promises))
        refits = _refits(model, promises, declared.noise_freedom, options, failures, follow)
        if not refits:
            break
        best, *others = refits
        close = options.policy.class_delta_chi_square
        alike = tuple(other for other in others if best.penalised - other.penalised < close)
        rounds.append((best, alike, model.loss))
        model = best.model
        release_programs()
    corrected = declared
    if rounds:
        # From the end of the last refit: other minima were ruled out before.
        how = dataclasses.replace(options.fit, starts=1, scan=False, profile="none")
        corrected = fit_project(model.project, how, follow)
    steps = tuple(_step(best, alike, before, corrected) for best, alike, before in rounds)
    return JointDiagnosis(declared, corrected, steps, n_candidates, failures.found)


def _of_result(result: JointResult, options: FitOptions) -> _Model:
    measurements = tuple(
        Measurement(name, one.data, one.sample, result.names[name], result.instruments[name])
        for name, one in result.measurements.items()
    )
    project = Project(measurements, result.title)
    return _model(project, noises_of(project, options), [one.config for one in result.measurements.values()])


def _model(project: Project, noises: list[FitNoise], resolutions: Sequence[SolverConfig]) -> _Model:
    """A project at the values of its samples."""
    objective = JointObjective.of(project, noises, resolutions=tuple(resolutions))
    unit = np.clip(objective.scale.to_unit(np.array([p.value for p in project.free])), 0.0, 1.0)
    residual = CompiledJointObjective(objective).residual(unit).residual
    return _Model(project, noises, objective, float(residual @ residual), unit)


def _screen(model: _Model, options: DiagnosisOptions, failures: Failures, follow: Progress) -> list[Promise]:
    end = CompiledJointObjective(model.objective).linearised(model.unit)
    return screened(model.project, model.noises, model.objective, end, options, failures, follow)


def _refits(
    model: _Model,
    promises: Sequence[Promise],
    noise_freedom: float | None,
    options: DiagnosisOptions,
    failures: Failures,
    follow: Progress,
) -> list[_Refit]:
    """Causes that lower chi-square by more than noise would for any that was looked at; the best first."""
    n_points, found = model.objective.n_points, list[_Refit]()
    worth = [p for p in promises if p.delta_chi_square > _PROMISED * penalty(p.cause.effect, n_points)]
    for number, promise in enumerate(worth[:_REFITS], 1):
        cause = promise.cause
        follow(f"{cause.effect.name} {cause.where}", StepOf(number, min(len(worth), _REFITS)), model.loss)
        with failures.sparing("the refit with {} " + cause.where, cause.effect.name):
            fitted = _fitted(model, promise)
            lower, terms = model.loss - fitted.loss, len(cause.effect.terms)
            chance = probability_above(max(lower, 0.0), terms, noise_freedom or np.inf)
            chance = min(float(chance) * len(promises), 1.0)
            paid = lower - penalty(cause.effect, n_points)
            if paid > 0 and chance <= options.policy.quiet_level:
                found.append(_Refit(cause, fitted, lower, chance, paid))
    return sorted(found, key=lambda one: -one.penalised)


def _fitted(model: _Model, promise: Promise) -> _Model:
    """The model with a cause, fitted from where the screen points."""
    extended = promise.cause.added(model.project, promise.start)
    extended = dataclasses.replace(
        extended, measurements=tuple(with_settled_effects(one) for one in extended.measurements)
    )
    begun = _model(extended, model.noises, model.objective.resolution)
    end: Search = search(
        Descent(), CompiledJointObjective(begun.objective), begun.unit, own=Limits(steps=_REFIT_STEPS)
    )
    values = begun.objective.numbers(end.unit)
    ended = (_with_values(one, values) for one in extended.measurements)
    project = dataclasses.replace(extended, measurements=tuple(ended))
    return _Model(project, begun.noises, begun.objective, end.loss, end.unit)


def _with_values(one: Measurement, values: dict[str, float]) -> Measurement:
    own = {name: values[there] for name, there in one.names.items() if there in values}
    sample = dataclasses.replace(one.sample, parameters=with_values(one.sample.parameters, own))
    return dataclasses.replace(one, sample=sample)


def _step(best: _Refit, alike: Sequence[_Refit], before: float, corrected: JointResult) -> JointStep:
    cause = best.cause
    names = {term.name: _in_project(cause, term.name, corrected) for term in cause.effect.terms}
    known = {own: there for own, there in names.items() if there in corrected.parameters}
    values = {own: corrected[there].value for own, there in known.items()}
    errors = {own: corrected[there].standard_error for own, there in known.items()}
    return JointStep(
        effect=cause.effect.name,
        statement=in_numbers(cause.effect, values, errors),
        where=cause.where,
        measurements=tuple(cause.forms),
        parameters=tuple(known.values()),
        chi_square_before=before,
        delta_chi_square=best.delta_chi_square,
        probability=best.probability,
        alike=tuple(f"{other.cause.effect.name} {other.cause.where}" for other in alike),
    )


def _in_project(cause: Cause, name: str, corrected: JointResult) -> str:
    first = next(iter(cause.forms))
    return corrected.names[first].get(name, cause.named(name))
