"""The stack of an ink between its two media, and reversed stacks and samples."""

import dataclasses
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp

from jaxink.ink.ink_layers import BACK, FRONT, InkLayers
from jaxink.model import ForwardModel
from jaxink.sample import (
    OPPOSITE_FACE,
    Layer,
    Parameter,
    ParameterTable,
    Sample,
    opposite_medium,
    turned_layers,
)
from jaxink.solver import Stack


def isolated_model(ink: InkLayers, wavelengths_nm: Sequence[float], accuracy: float) -> ForwardModel:
    """Forward model of the ink between its two media, illuminated as in the sample.

    It provides the resolution for an ``accuracy`` and builds the stacks of `ink_stacks`; its points are
    placeholders.
    """
    sample = ink.sample
    whole = sample.layers
    layers = list(whole[ink.first : ink.last + 1])
    # An interface is declared once, by either of its layers; it belongs to the ink.
    if ink.first > 0:
        layers[0] = _with_faces(layers[0], whole[ink.first - 1], "front_roughness")
    if ink.last + 1 < len(whole):
        layers[-1] = _with_faces(layers[-1], whole[ink.last + 1], "back_roughness")
    numbers, media = {name: _untabulated(p) for name, p in _numbers(sample).items()}, {}
    start = sample.parameters.values_with({})
    for name, medium in ((FRONT, ink.index_front), (BACK, ink.index_back)):
        for wavelength in wavelengths_nm:
            if isinstance(medium, float):
                media[name] = Parameter(name, medium)
            elif medium in numbers:
                media[name] = dataclasses.replace(numbers[medium], name=name)
            else:
                value = float(sample.at_wavelength(start, wavelength)[medium])
                media[f"{name}@{wavelength:g}"] = Parameter(f"{name}@{wavelength:g}", value)
    alone = dataclasses.replace(
        sample,
        layers=tuple(layers),
        parameters=ParameterTable(list((_without(numbers, FRONT, BACK) | media).values())),
        source_half_angle_deg=0.0,
        detector_half_angle_deg=0.0,
        backing=None,
        beam_diameter_mm=None,
        detector_diameter_mm=None,
    )
    nowhere = [0.0] * len(wavelengths_nm)
    return ForwardModel(
        alone, nowhere, nowhere, nowhere, wavelengths_nm, [False] * len(wavelengths_nm), accuracy=accuracy
    )


def ink_stacks(ink: InkLayers, model: ForwardModel, free_values: Mapping) -> Stack:
    """Stacks of the ink alone; the leading axis of their numbers is the wavelength.

    Parameters
    ----------
    ink
        The ink.
    model
        From `isolated_model`.
    free_values
        Values by name that replace those of the sample; differentiable, may be traced.
    """
    values, wavelengths = ink.sample.parameters.values_with(free_values), model.wavelengths_nm
    each = [ink.sample.at_wavelength(values, wavelength) for wavelength in wavelengths]
    columns = {name: jnp.stack([jnp.asarray(here[name], float) for here in each]) for name in each[0]}
    media = {
        name: jnp.full(len(wavelengths), medium) if isinstance(medium, float) else columns[medium]
        for name, medium in ((FRONT, ink.index_front), (BACK, ink.index_back))
    }
    return jax.vmap(lambda w, v: model.builder.stack(v, w))(jnp.asarray(wavelengths), columns | media)


def reversed_stack(stack: Stack) -> Stack:
    """The same stack, illuminated from the other side."""
    return Stack(stack.layers[::-1], stack.index_back, stack.index_front, faces=stack.faces[::-1])


def reversed_sample(sample: Sample) -> Sample:
    """The same sample with fixed values, illuminated from the other side, without its instrument."""
    numbers = [
        dataclasses.replace(p, name=opposite_medium(p.name), free=False) for p in _numbers(sample).values()
    ]
    return dataclasses.replace(
        sample,
        layers=turned_layers(sample.layers),
        parameters=ParameterTable(numbers),
        source_half_angle_deg=0.0,
        detector_half_angle_deg=0.0,
        backing=None,
        beam_diameter_mm=None,
        detector_diameter_mm=None,
    )


def _with_faces(layer: Layer, neighbour: Layer, face: str) -> Layer:
    """The layer with the roughness of the face that it shares with a neighbour, if the latter declares it."""
    if any(own.face == face for own in layer.roughness):
        return layer
    shared = [
        dataclasses.replace(other, face=face)
        for other in neighbour.roughness
        if other.face == OPPOSITE_FACE[face]
    ]
    return dataclasses.replace(layer, roughness=(*layer.roughness, *shared))


def _without(numbers: dict[str, Parameter], *stems: str) -> dict[str, Parameter]:
    return {name: p for name, p in numbers.items() if name.split("@")[0] not in stems}


def _number(sample: Sample, name: str, value: float) -> Parameter:
    """A parameter with its value instead of its tie; free only if it is an index that a fit can change.

    Free indices determine the channels.
    """
    parameter = sample.parameters[name]
    is_index = "index_" in name or name.split("@")[0].endswith("refractive_index")
    return Parameter(name, float(value), is_index and (parameter.free or parameter.tie is not None))


def _untabulated(parameter: Parameter) -> Parameter:
    """The parameter; angles of roughness are tied to their values.

    Otherwise the model would tabulate the face in advance, which does not pay here.
    """
    if not parameter.name.endswith(".sigma_deg"):
        return parameter
    return Parameter(parameter.name, parameter.value, tie=repr(parameter.value))


def _numbers(sample: Sample) -> dict[str, Parameter]:
    values = sample.parameters.values_with({})
    return {name: _number(sample, name, value) for name, value in values.items()}
