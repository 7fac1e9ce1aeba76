"""Copies of a sample with something added or replaced, for effects."""

import dataclasses

from jaxink.errors import InputRefusedError
from jaxink.sample import Layer, Parameter, ParameterTable, Roughness, Sample


def with_parameters(sample: Sample, *new: Parameter) -> Sample:
    """The sample with additional parameters, which replace those of the same name."""
    table = dict(sample.parameters) | {p.name: p for p in new}
    return dataclasses.replace(sample, parameters=ParameterTable(list(table.values())))


def with_constants(sample: Sample, terms: tuple[Parameter, ...]) -> Sample:
    """The sample with those terms of an effect that it lacks, fixed at their values."""
    missing = (t for t in terms if t.name not in sample.parameters)
    new = [dataclasses.replace(t, free=False, prior=None) for t in missing]
    return with_parameters(sample, *new) if new else sample


def ink_of(sample: Sample, effect: str, layer: str | None) -> Layer:
    """The layer that a declared effect names, or the first scattering one."""
    inks = {one.name: one for one in sample.layers if one.scatters}
    if layer is None:
        return next(iter(inks.values()))
    if layer not in inks:
        raise InputRefusedError(
            f"effects.{effect}.layer is '{layer}'; it must be a scattering layer: {', '.join(inks)}."
        )
    return inks[layer]


def with_changed_layer(sample: Sample, layer: str, **changes) -> Sample:
    """The sample with changed attributes of one layer."""
    layers = tuple(dataclasses.replace(x, **changes) if x.name == layer else x for x in sample.layers)
    return dataclasses.replace(sample, layers=layers)


def with_face(sample: Sample, layer: str, face: Roughness) -> Sample:
    """The sample with a rough face of a layer, which replaces the declared one."""
    (found,) = (one for one in sample.layers if one.name == layer)
    others = (r for r in found.roughness if r.face != face.face)
    return with_changed_layer(sample, layer, roughness=(*others, face))


def with_film(sample: Sample, position: int, name: str, refractive_index: float) -> Sample:
    """The sample with a film that neither scatters nor absorbs, inserted at a position."""
    numbers = {"refractive_index": refractive_index, "thickness_mm": 0.01, "absorption_per_mm": 0.0}
    new = (Parameter(f"{name}.{key}", value) for key, value in numbers.items())
    layers = (*sample.layers[:position], Layer(name, "clear"), *sample.layers[position:])
    return with_parameters(dataclasses.replace(sample, layers=layers), *new)


def freed(sample: Sample, name: str, minimum: float, maximum: float) -> Parameter:
    """A fixed parameter as the term of an effect, starting at its declared value."""
    return dataclasses.replace(
        sample.parameters[name],
        value=float(sample.parameters.values_with({})[name]),
        free=True,
        minimum=minimum,
        maximum=maximum,
        tie=None,
        prior=None,
        scale="linear",
    )
