"""The joint fit of several measurements of one ink, and what would make one agree with the others."""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from jaxtyping import Float

from jaxink.effects import CATALOGUE, declare
from jaxink.errors import InputRefusedError
from jaxink.files.version import installed_version
from jaxink.fitting.agreement import AGREE, Agreement, Comparison, OwnCause, agreement
from jaxink.fitting.assembly import (
    PACKAGES,
    Found,
    assemble,
    fitted_parameter,
    notes_of,
    profile_curve,
    readings_result,
    search_summary,
)
from jaxink.fitting.endings import minima_of, noise_scale
from jaxink.fitting.fitted_parameters import FittedParameters
from jaxink.fitting.gradient import Descent
from jaxink.fitting.inputs import prepare_data
from jaxink.fitting.joint_objective import (
    CompiledJointObjective,
    JointObjective,
    Resolutions,
    with_settled_effects,
)
from jaxink.fitting.joint_result import JointResult
from jaxink.fitting.method import search
from jaxink.fitting.minima import COMPARABLE_RISE, Minima
from jaxink.fitting.multistart import minimise
from jaxink.fitting.objective_of_readings import noise_of_readings
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Search
from jaxink.fitting.readings_result import ReadingsResult
from jaxink.fitting.result import FitResult
from jaxink.fitting.uncertainty import Covariance, covariance
from jaxink.measurement import FitNoise, GonioData, Readings, noise_of
from jaxink.numerics.failures import Failures
from jaxink.numerics.progress import Progress
from jaxink.projects import OF, Measurement, Project
from jaxink.sample import Sample
from jaxink.solver import SolverConfig

# Of the lowest of the other minima it is said which measurement excludes them.
_MOST_DECISIONS = 3
# Of the instrument, and simple enough that a few readings show them.
_EFFECTS = ("gain", "side_gain", "stray_light", "angle_offset", "incidence_angle")
# An unknown thickness lies within this factor of the declared one.
_THICKNESS = 4.0


def fit_project(project: Project, options: FitOptions, progress: Progress) -> JointResult:
    """Fit the free parameters of a project to all of its measurements; see `jaxink.fit`.

    Parameters
    ----------
    project
        The measurements and their samples.
    options
        Of the fit.
    progress
        Called with the task, the step and the loss.

    Raises
    ------
    InputRefusedError
        A measurement cannot be fitted; the message names it.
    """
    project = _prepared(project)
    noises = noises_of(project, options)
    free = project.free
    scans_first = options.scans_first and any(p.multimodal for p in free)

    def objective_at(resolution: Resolutions | SolverConfig | None) -> JointObjective:
        if isinstance(resolution, SolverConfig):
            resolution = (resolution,) * len(project)
        how = options.accuracy, options.layer_method
        made = JointObjective.of(project, noises, options.objective, resolution, *how)
        return made.tabulated() if scans_first else made

    objective, found = minimise(objective_at, free, options, progress)
    assert isinstance(objective, JointObjective)
    return _assembled(project, options, noises, objective, found)


def _prepared(project: Project) -> Project:
    measurements = []
    for one in project.measurements:
        if not one.sample.parameters.free:
            raise InputRefusedError(
                f"measurement '{one.name}': no parameter of its sample is free, so it cannot take part "
                "in a fit; remove it, or use predict."
            )
        one.sample.parameters.require_ranges()
        try:
            if isinstance(one.data, Readings):
                data: GonioData | Readings = one.data.at_wavelengths(one.sample.wavelengths_nm)
            else:
                data = prepare_data(one.data, one.sample)
            measurements.append(with_settled_effects(dataclasses.replace(one, data=data)))
        except InputRefusedError as problem:
            raise InputRefusedError(f"measurement '{one.name}': {problem}") from None
    return dataclasses.replace(project, measurements=tuple(measurements))


def noises_of(project: Project, options: FitOptions) -> list[FitNoise]:
    """The noise of each measurement; chi-square needs that of all."""
    noises = []
    for one in project.measurements:
        if isinstance(one.data, Readings):
            try:
                noise = noise_of_readings(one.data, one.sample.noise)
            except InputRefusedError as problem:
                raise InputRefusedError(f"measurement '{one.name}': {problem}") from None
        else:
            noise = noise_of(one.data, one.sample.noise)
        if options.objective == "chi_square" and not noise.known:
            raise InputRefusedError(
                f"measurement '{one.name}': its noise is {noise.origin} Declare it in changes.noise of the "
                "measurement or in [noise] of the sample, or choose another objective."
            )
        noises.append(noise)
    return noises


def _assembled(
    project: Project,
    options: FitOptions,
    noises: Sequence[FitNoise],
    objective: JointObjective,
    found: Found,
) -> JointResult:
    # Of estimates that are independent, the least certain one is decisive.
    noise_freedom = min(noise.degrees_of_freedom for noise in noises)
    found = found.for_noise_of(noise_freedom)
    best, free, is_chi_square = found.best, project.free, options.objective == "chi_square"
    minima: Minima | None = None
    if found.endings:
        with found.failures.sparing("the list of minima", ""):
            scale = noise_scale(best.loss, max(objective.n_rows - len(free), 1), is_chi_square)
            minima = minima_of(found.endings, best, scale, objective.numbers)
    said: tuple[str, ...] = ()
    if minima is not None and is_chi_square:
        with found.failures.sparing("the share of the measurements in the choice of the minimum", ""):
            said = tuple(decisions(objective, [one.name for one in project.measurements], minima))
    compared: Agreement | None = None
    if is_chi_square and best.triangle is not None and best.outcome.converged and len(project) > 1:
        with found.failures.sparing("the comparison of the measurements", ""):
            compared = agreement(
                objective,
                [one.name for one in project.measurements],
                best,
                options.make_method().near_solution,
                noise_freedom,
                [np.asarray(part.measured) for part in objective.parts],
            )
    if compared is not None and compared.outlier is not None:
        causes = own_causes(project, noises, objective, best, compared, noise_freedom, found.failures)
        compared = dataclasses.replace(compared, outlier=dataclasses.replace(compared.outlier, causes=causes))
    values = objective.numbers(best.unit)
    parts = _parts(project, options, noises, objective, found)
    fitted = {
        one.names[name]: part.parameters[name].value
        for one, part in zip(project.measurements, parts, strict=True)
        for name in part.parameters
    }
    rows = tuple(
        fitted_parameter(
            p, values.get(name, fitted[name]), _start(p.value, fitted[name]), objective, found, minima
        )
        for name, p in project.parameters.items()
    )
    errors = found.errors
    return JointResult(
        title=project.title,
        measurements=dict(zip((one.name for one in project.measurements), parts, strict=True)),
        names={one.name: dict(one.names) for one in project.measurements},
        instruments={one.name: one.instrument for one in project.measurements},
        method=options.method,
        objective=options.objective,
        outcome=best.outcome,
        loss=float(best.loss),
        parameters=FittedParameters.of(rows),
        correlation_names=() if errors is None else tuple(p.name for p in free),
        correlations=np.zeros((0, 0)) if errors is None else errors.correlation,
        noise_freedom=float(noise_freedom) if np.isfinite(noise_freedom) else None,
        agreement=compared,
        minima=minima,
        searches=tuple(search_summary(s, objective) for s in (*found.searches, *found.series)),
        profiles=tuple(profile_curve(p, objective, best) for p in found.profiles),
        versions={name: installed_version(name) for name in PACKAGES},
        seed=options.seed,
        notes=(
            *notes_of(free, objective, options, found),
            *(minima.rivals(is_chi_square) if minima is not None else ()),
            *said,
            *(
                f"{one.name}: {note}"
                for one in project.measurements
                if isinstance(one.data, Readings)
                for note in one.data.notes
            ),
            *(failure.sentence for failure in found.failures.found),
        ),
    )


def decisions(objective: JointObjective, names: Sequence[str], minima: Minima) -> Iterator[str]:
    """Which measurement excludes a minimum that the others would leave in question.

    Parameters
    ----------
    objective
        Of the joint fit.
    names
        Of the measurements.
    minima
        Of the joint fit.
    """
    programs = CompiledJointObjective(objective)

    def of_measurements(values: Mapping[str, float]) -> Float[np.ndarray, " measurements"]:
        unit = objective.scale.to_unit(np.array([values[name] for name in objective.free]))
        rows = objective.of_parts(programs.residual(np.clip(unit, 0.0, 1.0)).residual)
        return np.array([float(own @ own) for own in rows])

    best = of_measurements(minima.found[0].values)
    for other in [one for one in minima.found[1:] if one.rise >= COMPARABLE_RISE][:_MOST_DECISIONS]:
        rises = (of_measurements(other.values) - best) / minima.noise_scale
        decisive = int(np.argmax(rises))
        if float(np.sum(rises) - rises[decisive]) < COMPARABLE_RISE:
            at = ", ".join(f"{name} = {value:.5g}" for name, value in other.values.items())
            yield (
                f"The measurement '{names[decisive]}' decides against the minimum at {at}: it contributes "
                f"{rises[decisive]:.3g} of the {np.sum(rises):.3g} by which chi-square is higher there."
            )


def _start(value: float, fitted: float) -> float:
    """Start of a parameter; a tied one has none of its own."""
    return value if np.isfinite(value) else fitted


def _parts(
    project: Project,
    options: FitOptions,
    noises: Sequence[FitNoise],
    objective: JointObjective,
    found: Found,
) -> list[FitResult | ReadingsResult]:
    """The result of each measurement, with the values and the covariance of the joint fit."""
    best, parts = found.best, list[FitResult | ReadingsResult]()
    columns = objective.of_parts(best.predicted)
    for one, noise, part, at, predicted in zip(
        project.measurements, noises, objective.parts, objective.positions, columns, strict=True
    ):
        errors: Covariance | None = None
        if found.errors is not None:
            errors = Covariance(found.errors.matrix[np.ix_(at, at)], found.errors.held[at])
        residual = np.asarray(part.rows(predicted))
        own: Search = dataclasses.replace(
            best,
            start=best.start[at],
            unit=best.unit[at],
            loss=float(residual @ residual),
            triangle=None,
            gradient=None,
            predicted=predicted,
        )
        alone = Found(own, errors, searches=(), is_from_search=True)
        if isinstance(one.data, Readings):
            parts.append(readings_result(one.data, one.sample, options, noise, part, alone))
        else:
            parts.append(assemble(one.data, one.sample, options, noise, part, alone))
    return parts


def own_causes(
    project: Project,
    noises: Sequence[FitNoise],
    objective: JointObjective,
    best: Search,
    found: Agreement,
    noise_freedom: float,
    failures: Failures,
) -> tuple[OwnCause, ...]:
    """Causes of one parameter, of the outlier alone, with which all measurements agree; the best fit first.

    Each is fitted with all other parameters of all measurements.

    Parameters
    ----------
    project, noises
        The measurements.
    objective, best
        Of the joint fit.
    found
        Whether they agree; it names the outlier.
    noise_freedom
        Degrees of freedom of the noise, if it is an estimate.
    failures
        Takes note of causes that cannot be fitted.
    """
    assert found.outlier is not None
    odd, causes = project[found.outlier.name], list[tuple[float, OwnCause]]()
    comparison = Comparison(found.parts, len(objective.prior_mean), noise_freedom)
    for parameter, sample in _samples(odd):
        with failures.sparing("the fit with {} of one measurement alone", parameter):
            own = _own(project, odd, sample)
            name = own[parameter]
            changed = dataclasses.replace(odd, sample=sample, names={**odd.names, **own})
            others = (changed if one is odd else one for one in project.measurements)
            extended = dataclasses.replace(project, measurements=tuple(others))
            made = JointObjective.of(extended, noises, resolutions=objective.resolution)
            start = _own_start(made, objective, best, sample.parameters[parameter].value)
            end = search(Descent(), CompiledJointObjective(made), start)
            if not end.outcome.converged or end.triangle is None or end.gradient is None:
                continue
            agreed = comparison.with_parameters(end.loss, found.degrees_of_freedom - 1)
            if agreed is None or agreed < AGREE:
                continue
            position = made.free.index(name)
            slope = abs(float(made.scale.slope(end.unit)[position]))
            deviation = covariance(end.triangle, end.unit, end.gradient).deviation[position]
            value, unit = made.numbers(end.unit)[name], sample.parameters[parameter].unit
            error = float(deviation * slope) if np.isfinite(deviation) else None
            causes.append((end.loss, OwnCause(name, value, error, unit, agreed)))
    return tuple(cause for _, cause in sorted(causes, key=lambda pair: pair[0]))


def _samples(odd: Measurement) -> Iterator[tuple[str, Sample]]:
    """The sample of a measurement with one more free parameter, and the name of that."""
    sample = odd.sample
    if isinstance(odd.data, GonioData):
        known = {effect.name for effect in sample.effects}
        for effect in CATALOGUE:
            if effect.name in _EFFECTS and effect.name not in known:
                made = effect.of_sample(sample)
                if effect.name == "side_gain" and np.unique(odd.data.is_transmission).size < 2:
                    continue
                strength = made.strength.name
                extended = declare(sample, (made,), {strength: 0.0})
                yield strength, extended
    for layer in sample.layers:
        name = f"{layer.name}.thickness_um"
        if layer.scatters and name in sample.parameters and sample.parameters[name].is_fixed:
            value = sample.parameters[name].value
            ends = {"minimum": value / _THICKNESS, "maximum": value * _THICKNESS}
            table = sample.parameters.replace(name, free=True, **ends)
            yield name, dataclasses.replace(sample, parameters=table)


def _own(project: Project, odd: Measurement, sample: Sample) -> dict[str, str]:
    """Names in the project of the parameters that the measurement now has for itself."""
    new = [
        name
        for name, p in sample.parameters.items()
        if name not in odd.sample.parameters or (p.free and not odd.sample.parameters[name].free)
    ]
    # A specimen may have the name of the measurement.
    taken = {name for one in project.measurements if one is not odd for name in one.names.values()}
    owner = f"{odd.name}_alone" if any(f"{odd.name}{OF}{name}" in taken for name in new) else odd.name
    return {name: f"{owner}{OF}{name}" for name in new}


def _own_start(
    made: JointObjective, objective: JointObjective, best: Search, new: float
) -> Float[np.ndarray, " parameters"]:
    """The joint minimum, with the new parameter at the value that it had before."""
    values = objective.numbers(best.unit)
    return np.clip(made.scale.to_unit(np.array([values.get(name, new) for name in made.free])), 0.0, 1.0)
