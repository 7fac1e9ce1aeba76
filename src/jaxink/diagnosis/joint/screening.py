"""Screen of the effects that the model of several measurements may lack."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from jaxink.diagnosis.joint.cause import Cause, owners
from jaxink.diagnosis.search.direction import SCREEN, Direction, secants, tangents
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.search.setup import Setup
from jaxink.diagnosis.search.stage import by_program
from jaxink.diagnosis.search.workbench import Place
from jaxink.diagnosis.statistics.projection import Projection, orthonormal_range
from jaxink.display.brief import brief_repr
from jaxink.effects import AreaWithOtherValues, Effect, SampleEffect, Scene
from jaxink.fitting.compiled import Point
from jaxink.fitting.joint_objective import JointObjective, without_priors
from jaxink.measurement import FitNoise, GonioData
from jaxink.numerics.failures import Failures
from jaxink.numerics.progress import Progress, StepOf
from jaxink.projects import Measurement, Project


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
        if not isinstance(one.data, GonioData):
            continue
        follow(f"screen of '{one.name}'", StepOf(i + 1, len(project)), loss)
        rows = slice(first_rows[i], first_rows[i + 1])
        for direction in _directions(one, one.data, noise, objective.parts[i].resolution, options, failures):
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
    effect, readings = some.effect, [m.name for m in project.measurements if m.name not in found]
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
            # All look at the same sample, whether their own directions can be screened or not.
            forms |= {name: effect for name in readings}
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
    used = data.used
    setup = Setup(
        without_priors(one.sample),
        data,
        noise,
        resolution,
        Scene.of(*data.used_directions, row=data.reading_order[used]),
        options.catalogue,
        options.screen,
        options.fit.accuracy,
        options.policy,
        failures=failures,
    )
    listed = setup.listed(())
    bench = setup.shared_bench((), listed)
    here = Place(dict(bench.start), bench.predict(bench.start))
    shared = [effect for effect in listed.forms if not effect.own_program]
    found = tangents(bench, here, bench.base_free, shared, failures)
    own = [effect for effect in listed.forms if effect.own_program and effect.is_screened]
    for effects in by_program(own).values():
        found += _own_directions(setup, bench, here, effects, failures)
    for direction in found:
        if np.all(np.isfinite(direction.column)):
            yield direction.without_rounding()


def _own_directions(setup: Setup, bench, here: Place, effects: Sequence[Effect], failures: Failures):
    """Directions of effects that share a program of their own, which is dropped afterwards."""
    found: list[Direction] = []
    n_slots = len(bench.base_free) + max(len(effect.terms) for effect in effects)
    own = bench if isinstance(effects[0], AreaWithOtherValues) else setup.bench(tuple(effects), n_slots)
    for effect in effects:
        with failures.sparing(SCREEN, effect.name):
            found += secants(bench, own, here, effect)
    if own is not bench:
        own.release()
    return found
