"""The stack of an ink between its two media, and stacks and samples lit from their other side."""

import dataclasses
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp

from jaxink.ink.ink_layers import BACK, FRONT, InkLayers
from jaxink.model.forward import ForwardModel
from jaxink.sample import Layer, Parameter, Sample
from jaxink.sample.parameters import ParameterTable
from jaxink.solver.stack import Stack

_OPPOSITE_FACE = {"front_roughness": "back_roughness", "back_roughness": "front_roughness"}


def isolated_model(ink: InkLayers, wavelengths_nm: Sequence[float], accuracy: float) -> ForwardModel:
    """Forward model of the ink between its two media, lit as in the sample.

    Parameters
    ----------
    ink
        The ink.
    wavelengths_nm
        Wavelengths.
    accuracy
        Largest relative error of the BSDF that the discretisation may cause.

    Returns
    -------
    ForwardModel
        Has the discretisation, and builds the stacks of `ink_stacks`; its own points mean nothing.
    """
    sample = ink.sample
    whole = sample.layers
    layers = list(whole[ink.first : ink.last + 1])
    # An interface is declared once, by either of the layers that meet there: it stays with the ink.
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
    """Stacks of the ink alone at every wavelength of its model.

    Parameters
    ----------
    ink
        The ink.
    model
        Of `isolated_model`.
    free_values
        Values by name that replace those of the sample's table; differentiable in each, and traced ones
        are welcome.

    Returns
    -------
    Stack
        Its numbers have the wavelength as leading axis.
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
    """The same stack, lit from its other side."""
    return Stack(stack.layers[::-1], stack.index_back, stack.index_front, faces=stack.faces[::-1])


def reversed_sample(sample: Sample) -> Sample:
    """The same sample with fixed values, lit from its other side.

    Returns
    -------
    Sample
        Without free parameters, ties and instrument.
    """
    swapped = {FRONT: BACK, BACK: FRONT}

    def renamed(name):
        stem, at, wavelength = name.partition("@")
        return swapped.get(stem, stem) + at + wavelength

    layers = tuple(
        dataclasses.replace(
            layer,
            roughness=tuple(
                dataclasses.replace(face, face=_OPPOSITE_FACE[face.face]) for face in layer.roughness
            ),
        )
        for layer in reversed(sample.layers)
    )
    numbers = [dataclasses.replace(p, name=renamed(p.name), free=False) for p in _numbers(sample).values()]
    return dataclasses.replace(
        sample,
        layers=layers,
        parameters=ParameterTable(numbers),
        source_half_angle_deg=0.0,
        detector_half_angle_deg=0.0,
        backing=None,
        beam_diameter_mm=None,
        detector_diameter_mm=None,
    )


def _with_faces(layer: Layer, neighbour: Layer, face: str) -> Layer:
    """The layer with the face that it shares with a neighbour, where that one declares it."""
    if any(own.face == face for own in layer.roughness):
        return layer
    shared = [
        dataclasses.replace(other, face=face)
        for other in neighbour.roughness
        if other.face == _OPPOSITE_FACE[face]
    ]
    return dataclasses.replace(layer, roughness=(*layer.roughness, *shared))


def _without(numbers: dict[str, Parameter], *stems: str) -> dict[str, Parameter]:
    return {name: p for name, p in numbers.items() if name.split("@")[0] not in stems}


def _number(sample: Sample, name: str, value: float) -> Parameter:
    """A parameter with its value in place of its tie.

    Free where a fit can change an index, which decides on the channels; nothing else is fitted here.
    """
    parameter = sample.parameters[name]
    is_index = "index_" in name or name.split("@")[0].endswith("refractive_index")
    return Parameter(name, float(value), is_index and (parameter.free or parameter.tie is not None))


def _untabulated(parameter: Parameter) -> Parameter:
    """The parameter, an angle of roughness tied to its value.

    A model tabulates a face whose angle is known or free before it is used, which costs more than it saves
    here.
    """
    if not parameter.name.endswith(".sigma_deg"):
        return parameter
    return Parameter(parameter.name, parameter.value, tie=repr(parameter.value))


def _numbers(sample: Sample) -> dict[str, Parameter]:
    values = sample.parameters.values_with({})
    return {name: _number(sample, name, value) for name, value in values.items()}
