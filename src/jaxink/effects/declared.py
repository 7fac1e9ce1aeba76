"""Effects that a sample declares, and effects that are found turned into declarations."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from jaxink.effects.catalogue import CATALOGUE
from jaxink.effects.kinds import Effect, SampleEffect
from jaxink.effects.sample_edits import with_constants, with_parameters
from jaxink.effects.scene import Scene
from jaxink.errors import InputRefusedError
from jaxink.measurement import GonioData
from jaxink.sample import EFFECTS, DeclaredEffect, Parameter, ParameterTable, Sample, defaults_of

_POSITION = {effect.name: i for i, effect in enumerate(CATALOGUE)}
_OF_CATALOGUE = {effect.name: effect for effect in CATALOGUE}


def in_order(effects: tuple[Effect, ...]) -> tuple[Effect, ...]:
    """Effects in the order in which they act: that of the catalogue, those of a user's own last."""
    return tuple(sorted(effects, key=lambda e: (_POSITION.get(e.name, len(_POSITION)), str(e))))


def is_of_catalogue(effect: Effect) -> bool:
    """Whether an effect is one of the catalogue, not of a user's own."""
    return type(effect) is _OF_CATALOGUE.get(effect.name)


def declared_effects(sample: Sample) -> tuple[Effect, ...]:
    """The effects that a sample declares in tables of their own.

    Raises
    ------
    InputRefusedError
        The sample lacks what an effect needs, or the class of an effect of a user's own was not passed.
    """
    found = []
    for declared in sample.effects:
        kind = declared.kind or _OF_CATALOGUE.get(declared.name)
        if kind is None:
            raise InputRefusedError(
                f"the sample declares the effect '{declared.name}', which is not in the catalogue; pass its "
                "class when you load the file, for example load_result(path, effects=[MyEffect])."
            )
        found.append(kind.of_sample(sample, **dict(declared.form)))
    return in_order(tuple(found))


def settled(sample: Sample, data: GonioData) -> Sample:
    """The sample with its declared effects fixed by the used points of a fit, see `Effect.settled`."""
    if not sample.effects:
        return sample
    scene, measured = Scene.of_used(data), data.bsdf_per_sr[data.used]
    kinds = {effect.name: effect.kind for effect in sample.effects}
    effects = (effect.settled(scene, measured) for effect in declared_effects(sample))
    return dataclasses.replace(sample, effects=tuple(_declaration(e, kinds[e.name]) for e in effects))


def declare(sample: Sample, effects: tuple[Effect, ...], values: Mapping[str, float]) -> Sample:
    """A sample that declares effects which were found, with free parameters and given values.

    Parameters
    ----------
    sample
        The sample without them.
    effects
        Effects that are properties of a layer, of the surroundings or of the instrument's field become part
        of the sample, all others tables of their own.
    values
        Of the parameters, by name.
    """
    for effect in in_order(effects):
        if isinstance(effect, SampleEffect) and effect.name in _OF_CATALOGUE and effect.name not in EFFECTS:
            sample = effect.extend(sample)
        else:
            kind = None if effect.name in _OF_CATALOGUE else type(effect)
            declared = (*sample.effects, _declaration(effect, kind))
            # What a form fixes remains fixed.
            terms = {t.name: t for t in (*effect.carrier.terms, *effect.terms)}
            sample = with_parameters(dataclasses.replace(sample, effects=declared), *terms.values())
            sample = sample if kind else with_constants(sample, defaults_of(effect.name))
    return dataclasses.replace(sample, parameters=with_values(sample.parameters, values))


def with_values(table: ParameterTable, values: Mapping[str, float]) -> ParameterTable:
    """A table with other values of parameters that are not tied."""

    def changed(p: Parameter) -> Parameter:
        if p.tie is not None or p.name not in values:
            return p
        return dataclasses.replace(p, value=float(np.clip(values[p.name], p.minimum, p.maximum)))

    return ParameterTable([changed(p) for p in table.values()])


def _declaration(effect: Effect, kind: type[Effect] | None) -> DeclaredEffect:
    form = tuple((key, value) for key, value in effect.carrier.form.items() if value is not None)
    return DeclaredEffect(effect.name, form, kind)
