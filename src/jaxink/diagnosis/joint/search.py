"""Forward search for the effects that the model of several measurements lacks."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from jaxink.diagnosis.joint.joint_diagnosis import JointDiagnosis, JointStep
from jaxink.diagnosis.joint.readings_screen import readings_directions
from jaxink.diagnosis.search.candidate_objective import CandidateObjective, Place
from jaxink.diagnosis.search.direction import SCREEN, Direction, secants, tangents
from jaxink.diagnosis.search.model import by_program
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.diagnosis.search.refit import penalty
from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.display.brief import brief_repr
from jaxink.effects import AreaWithOtherValues, Effect, SampleEffect, Scene, declare, in_numbers, with_values
from jaxink.errors import InputRefusedError, NotConvergedError
from jaxink.fitting import (
    UNMOVED,
    CompiledJointObjective,
    Descent,
    FitOptions,
    JointObjective,
    JointResult,
    Point,
    Search,
    SearchLimits,
    fit_project,
    noises_of,
    search,
    with_settled_effects,
    without_priors,
)
from jaxink.measurement import FitNoise, GonioData
from jaxink.numerics.chi_square import probability_above
from jaxink.numerics.failures import Failures
from jaxink.numerics.precision import release_programs
from jaxink.numerics.progress import Progress, StepOf
from jaxink.projects import OF, Measurement, Project
from jaxink.solver import SolverConfig

INSTRUMENT = "instrument"
# So many of the most promising causes are fitted in each round.
_REFITS = 6
_REFIT_STEPS = 60
# A cause promises more than its penalty, or it is not fitted; the screen is linear, so half is enough.
_PROMISED = 0.5


@dataclasses.dataclass(frozen=True)
class Cause:
    """An effect, and the measurements that have it.

    Parameters
    ----------
    owner
        Measurement or instrument to which its parameters belong; empty if all measurements share them.
    forms
        The effect in each of the measurements that have it.
    """

    __repr__ = brief_repr

    owner: str
    forms: Mapping[str, Effect]

    @property
    def effect(self) -> Effect:
        """Its form in the first of them."""
        return next(iter(self.forms.values()))

    @property
    def where(self) -> str:
        """In words, after the name of the effect."""
        if not self.owner:
            return "in all measurements"
        if set(self.forms) == {self.owner}:
            return f"in '{self.owner}' alone"
        measured = ", ".join(self.forms)
        return f"of '{self.owner}': in {measured}"

    def named(self, parameter: str) -> str:
        """Name in the project of a parameter of the effect."""
        return f"{self.owner}{OF}{parameter}" if self.owner else parameter

    def added(self, project: Project, values: Mapping[str, float]) -> Project:
        """The project with the effect, its parameters free; their values by their names in a sample."""
        changed = (self._with_effect(one, values) for one in project.measurements)
        return dataclasses.replace(project, measurements=tuple(changed))

    def _with_effect(self, one: Measurement, values: Mapping[str, float]) -> Measurement:
        if one.name not in self.forms:
            return one
        sample, before = declare(one.sample, (self.forms[one.name],), values), one.sample.parameters
        names = dict(one.names)
        for name, parameter in sample.parameters.items():
            if name not in before or (parameter.free and not before[name].free):
                names[name] = self.named(name)
        return dataclasses.replace(one, sample=sample, names=names)


def owners(project: Project, names: Sequence[str], effect: Effect) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Who may own an effect that some measurements can have, and which of them then have it.

    What belongs to the sample is in all of them, what belongs to an instrument in all that it measured (if
    none has a name, all scans of a goniometer, or else all readings); either may be in one measurement alone.

    Parameters
    ----------
    project
        The measurements.
    names
        Those in which the effect can be.
    effect
        The effect.
    """
    of_instruments: dict[str, list[str]] = {}
    for one in project.measurements:
        if one.name in names:
            of_instruments.setdefault(one.instrument, []).append(one.name)
    if effect.group != INSTRUMENT or set(of_instruments) == {""}:
        together = tuple(names) if effect.group != INSTRUMENT else _of_one_instrument(project, names)
        if len(together) > 1:
            yield "", together
    else:
        for instrument, measured in of_instruments.items():
            if instrument and len(measured) > 1:
                yield instrument, tuple(measured)
    for name in names:
        yield name, (name,)


def _of_one_instrument(project: Project, names: Sequence[str]) -> tuple[str, ...]:
    """Measurements that one instrument without a name may have made: a goniometer reads no totals."""
    of_goniometer = tuple(name for name in names if isinstance(project[name].data, GonioData))
    return of_goniometer or tuple(names)


@dataclasses.dataclass(frozen=True)
class Promise:
    """What a cause promises in the linear approximation.

    Parameters
    ----------
    cause
        The cause.
    delta_chi_square
        Largest decrease in chi-square of all measurements.
    start
        Values of the effect's parameters from which to fit, by their names in a sample.
    """

    __repr__ = brief_repr

    cause: Cause
    delta_chi_square: float
    start: Mapping[str, float]


def screened(
    project: Project,
    noises: Sequence[FitNoise],
    objective: JointObjective,
    end: Point,
    options: DiagnosisOptions,
    failures: Failures,
    follow: Progress,
) -> list[Promise]:
    """All causes that the project may have, the most promising first.

    Each effect changes the prediction of each measurement; a cause is one strength for some of them. Its
    score is that of a single measurement's screen, with the residuals and the free parameters of all.

    Parameters
    ----------
    project, noises
        The measurements, their samples with the values of the joint minimum.
    objective, end
        The joint objective, and its linearisation at the minimum.
    options
        Of the diagnosis.
    failures
        Takes note of effects that cannot be screened.
    follow
        Called with the task, the step and the loss.
    """
    assert end.jacobian is not None
    inside = (end.unit > 0) & (end.unit < 1)
    projection = Projection(orthonormal_range(end.jacobian[:, inside]))
    counts = [part.n_points for part in objective.parts]
    first_rows = np.concatenate([[0], np.cumsum(counts)]).tolist()
    ways: dict[tuple, dict[str, tuple[slice, Direction]]] = {}
    loss = float(end.residual @ end.residual)
    for i, (one, noise) in enumerate(zip(project.measurements, noises, strict=True)):
        follow(f"screen of '{one.name}'", StepOf(i + 1, len(project)), loss)
        rows, part = slice(first_rows[i], first_rows[i + 1]), objective.parts[i]
        if isinstance(one.data, GonioData):
            directions = _directions(one, one.data, noise, part.resolution, options, failures)
        else:
            directions = readings_directions(without_priors(one.sample), one.data, part, options, failures)
        for direction in directions:
            key = direction.effect.name, str(direction.effect), tuple(sorted(direction.setting.items()))
            ways.setdefault(key, {})[one.name] = rows, direction
    best: dict[tuple, Promise] = {}
    for (name, form, _), found in ways.items():
        for promise in _promises(project, found, projection, end):
            kind = name, form, promise.cause.owner
            if kind not in best or promise.delta_chi_square > best[kind].delta_chi_square:
                best[kind] = promise
    return sorted(best.values(), key=lambda promise: -promise.delta_chi_square)


def _promises(
    project: Project,
    found: Mapping[str, tuple[slice, Direction]],
    projection: Projection,
    end: Point,
) -> Iterator[Promise]:
    """What one way of an effect promises, for each of its possible owners."""
    some = next(iter(found.values()))[1]
    effect, others = some.effect, [m.name for m in project.measurements if m.name not in found]
    for owner, measured in owners(project, tuple(found), effect):
        column = np.zeros(len(end.residual))
        for name in measured:
            rows, direction = found[name]
            column[rows] = direction.column[: rows.stop - rows.start]
        rest = projection.remove(column)
        norm = float(np.linalg.norm(rest))
        if not norm > 1e-6 * max(float(np.linalg.norm(column)), 1e-300):
            continue
        z = float(rest @ end.residual) / norm
        step = float(np.clip(z / norm, -some.largest, some.largest))
        forms = {name: found[name][1].effect for name in measured}
        if not owner and isinstance(effect, SampleEffect):
            # All look at the same sample, whether it shows there or not.
            forms |= {name: effect for name in others}
        start = some.setting | effect.start(some.setting, step)
        yield Promise(Cause(owner, forms), some.reachable_delta_chi_square(z, norm), start)


def _directions(
    one: Measurement,
    data: GonioData,
    noise: FitNoise,
    resolution,
    options: DiagnosisOptions,
    failures: Failures,
) -> Iterator[Direction]:
    """How each effect changes the prediction of one measurement, in units of its noise."""
    problem = SearchProblem(
        without_priors(one.sample),
        data,
        noise,
        resolution,
        Scene.of_used(data),
        options.catalogue,
        options.screen,
        options.fit.accuracy,
        options.policy,
        failures=failures,
    )
    listed = problem.listed(())
    objective = problem.shared_objective((), listed)
    here = Place(dict(objective.start), objective.predict(objective.start))
    shared = [effect for effect in listed.forms if not effect.own_program]
    found = tangents(objective, here, objective.base_free, shared, failures)
    own = [effect for effect in listed.forms if effect.own_program and effect.is_screened]
    for effects in by_program(own).values():
        found += _own_directions(problem, objective, here, effects)
    for direction in found:
        if np.all(np.isfinite(direction.column)):
            yield direction.without_rounding()


def _own_directions(
    problem: SearchProblem, objective: CandidateObjective, here: Place, effects: Sequence[Effect]
) -> list[Direction]:
    """Directions of effects that share a program of their own, which is dropped afterwards."""
    found: list[Direction] = []
    n_slots = len(objective.base_free) + max(len(effect.terms) for effect in effects)
    is_mixture = isinstance(effects[0], AreaWithOtherValues)
    own = objective if is_mixture else problem.objective(tuple(effects), n_slots)
    for effect in effects:
        with problem.failures.sparing(SCREEN, effect.name):
            found += secants(objective, own, here, effect)
    if own is not objective:
        own.release()
    return found


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


def _refuse_options_of_one(options: DiagnosisOptions) -> None:
    """Reject what only the diagnosis of one measurement heeds."""
    usual = DiagnosisOptions()
    for name in ("max_parameters", "level", "n_bootstrap", "seed", "time_limit_s"):
        if getattr(options, name) != getattr(usual, name):
            raise InputRefusedError(f"{name} is for the diagnosis of one measurement; leave it out.")


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
    _refuse_options_of_one(options)
    declared = fit_project(project, options.fit, follow)
    if not declared.outcome.converged:
        raise NotConvergedError(
            f"the joint fit of the declared model {declared.outcome.value}, so that there is no minimum to "
            "diagnose; give other start values in the sample file, or fit fewer parameters."
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
        # It starts where the last refit ended, so that it says nothing if no parameter moves.
        notes = tuple(note for note in corrected.notes if note != UNMOVED)
        corrected = dataclasses.replace(corrected, notes=notes)
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
        Descent(), CompiledJointObjective(begun.objective), begun.unit, own=SearchLimits(steps=_REFIT_STEPS)
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
