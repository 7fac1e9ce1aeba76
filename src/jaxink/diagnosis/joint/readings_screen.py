"""How each effect changes readings of other instruments than a goniometer: columns of the screen."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from jaxink.diagnosis.search.direction import SCREEN, Direction
from jaxink.diagnosis.search.options import DiagnosisOptions
from jaxink.diagnosis.search.problem import listed_in
from jaxink.effects import (
    Case,
    Effect,
    SampleEffect,
    ScalingEffect,
    Scene,
    declared_effects,
    extend,
    readings_model,
)
from jaxink.fitting import CompiledObjective, Objective, Point, UnitScale
from jaxink.measurement import Readings
from jaxink.numerics.failures import Failures
from jaxink.numerics.precision import computing
from jaxink.sample import Parameter, Sample


def readings_directions(
    sample: Sample, readings: Readings, part: Objective, options: DiagnosisOptions, failures: Failures
) -> Iterator[Direction]:
    """Changes of readings by the effects that they can show, in units of their noise.

    These are what the sample may lack, and factors of the instrument: angles, stray light and the like belong
    to a goniometer.

    Parameters
    ----------
    sample
        With the values of the minimum, without priors.
    readings
        What was read.
    part
        Its objective there.
    options
        Of the diagnosis.
    failures
        Takes note of effects that cannot be screened.
    """
    forms = _forms(sample, readings, part, options, failures)
    inside = tuple(form for form in forms if not form.own_program)
    with computing():
        found = _at_zero(_Changed(sample, readings, part, inside)) if inside else []
        for form in forms:
            if form.own_program and form.is_screened:
                with failures.sparing(SCREEN, form.name):
                    found += _differences(_Changed(sample, readings, part, (form,)))
    for direction in found:
        if np.all(np.isfinite(direction.column)):
            yield direction.without_rounding()


class _Changed:
    """Readings of a sample with effects, as a function of their parameters alone."""

    def __init__(self, sample: Sample, readings: Readings, part: Objective, effects: tuple[Effect, ...]):
        model = readings_model(sample, readings, part.resolution, effects=effects)
        terms: dict[str, Parameter] = {term.name: term for effect in effects for term in effect.terms}
        table = model.sample.parameters
        values = table.values_with({})
        constants = {n: float(values[n]) for n, p in table.items() if p.tie is None and n not in terms}
        no_priors = np.zeros(0)
        self.effects = effects
        self.objective = dataclasses.replace(
            part,
            model=model,
            scale=UnitScale.of(tuple(terms.values())),
            free=tuple(terms),
            constants=np.array(list(constants.values())),
            names=tuple(constants),
            prior_weights=np.zeros((0, len(terms))),
            prior_mean=no_priors,
            prior_deviation=no_priors,
        )
        self._neutral = {name: term.value for name, term in terms.items()}
        self._compiled = CompiledObjective(self.objective)

    def residual(self, setting: dict[str, float]) -> Point:
        """With the effects at a setting."""
        return self._compiled.residual(self._unit(setting))

    def slopes(self, setting: dict[str, float]) -> dict[str, np.ndarray]:
        """Derivatives of the prediction in units of the noise by the effects' parameters."""
        end = self._compiled.linearised(self._unit(setting))
        assert end.jacobian is not None
        # The residual is the measured value less the predicted one.
        columns = -end.jacobian / self.objective.scale.slope(end.unit)
        return dict(zip(self.objective.free, columns.T, strict=True))

    def _unit(self, setting: dict[str, float]) -> np.ndarray:
        values = self._neutral | setting
        return self.objective.scale.to_unit(np.array([values[name] for name in self.objective.free]))


def _forms(
    sample: Sample, readings: Readings, part: Objective, options: DiagnosisOptions, failures: Failures
) -> tuple[Effect, ...]:
    """Forms of the effects that readings can show, without those that the sample declares."""
    # What an effect of the sample asks of the scene are the wavelengths.
    normal = np.zeros(len(readings))
    angles = np.nan_to_num(readings.theta_i_deg), normal, normal
    scene = Scene.of(
        *angles, readings.wavelength_nm, readings.is_transmission, row=np.arange(len(readings), dtype=float)
    )
    declared = declared_effects(sample)
    names = {effect.name for effect in declared}
    noise = float(np.min(part.sigma / np.abs(readings.value)))
    case = Case(extend(sample, declared), scene, noise, options.fit.accuracy)
    kinds = [
        k for k in options.catalogue if issubclass(k, SampleEffect | ScalingEffect) and k.name not in names
    ]
    return listed_in(case, kinds, failures).forms


def _at_zero(changed: _Changed) -> list[Direction]:
    """Derivatives at strength zero, where effects do not interact: one setting of each at a time."""
    found = list[Direction]()
    for rank in range(max((len(effect.settings) for effect in changed.effects), default=0)):
        here = [effect for effect in changed.effects if rank < len(effect.settings)]
        slopes = changed.slopes({name: v for effect in here for name, v in effect.settings[rank].items()})
        for effect in here:
            setting = effect.settings[rank]
            found.append(
                Direction(effect, setting, slopes[effect.strength.name], effect.largest_share(setting))
            )
    return found


def _differences(changed: _Changed) -> list[Direction]:
    """Differences that the settings of an effect with a program of its own make."""
    (effect,) = changed.effects
    before = changed.residual({}).residual
    return [
        Direction(effect, setting, before - changed.residual(setting).residual, effect.largest_share(setting))
        for setting in effect.settings
    ]
