"""What would make a measurement agree with the others: causes that belong to it alone."""

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from jaxink.effects.catalogue import CATALOGUE
from jaxink.effects.declared import declare
from jaxink.fitting.agreement import AGREE, Agreement, Comparison, OwnCause
from jaxink.fitting.gradient import Descent
from jaxink.fitting.joint_objective import CompiledJointObjective, JointObjective
from jaxink.fitting.method import search
from jaxink.fitting.outcome import Search
from jaxink.fitting.uncertainty import covariance
from jaxink.measurement import FitNoise, GonioData
from jaxink.numerics.failures import Failures
from jaxink.projects import Measurement, Project
from jaxink.projects.project import OF
from jaxink.sample import Sample

# Of the instrument, and simple enough that a few readings show them.
_EFFECTS = ("gain", "side_gain", "stray_light", "angle_offset", "incidence_angle")
# An unknown thickness lies within this factor of the declared one.
_THICKNESS = 4.0


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
            start = _start(made, objective, best, sample.parameters[parameter].value)
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


def _start(
    made: JointObjective, objective: JointObjective, best: Search, new: float
) -> Float[np.ndarray, " parameters"]:
    """The joint minimum, with the new parameter at the value that it had before."""
    values = objective.numbers(best.unit)
    return np.clip(made.scale.to_unit(np.array([values.get(name, new) for name in made.free])), 0.0, 1.0)
