"""An ink taken out of its sample: the layers that belong to it, between the plate and the other side."""

import dataclasses
import reprlib
from collections.abc import Iterable, Mapping, Sequence

import jax
import jax.numpy as jnp

from jaxink.errors import InputRefusedError
from jaxink.model.forward import ForwardModel
from jaxink.sample import Layer, Parameter, Sample
from jaxink.sample.parameters import ParameterTable
from jaxink.solver.stack import Stack

_OPPOSITE_FACE = {"front_roughness": "back_roughness", "back_roughness": "front_roughness"}
_FRONT, _BACK = "surroundings.index_front", "surroundings.index_back"


@dataclasses.dataclass(frozen=True)
class InkLayers:
    """Which layers of a sample are the ink, and what lies on either side.

    Parameters
    ----------
    sample
        The whole sample.
    first, last
        Positions of the ink's first and last layer, in the order in which light meets them.
    inside
        On which side of the ink the plate is: ``front`` (light meets the plate first) or ``back``.
    index_front, index_back
        Refractive indices of the media that the ink is put between, where given: numbers; else names of
        the parameters that hold them.
    """

    sample: Sample
    first: int
    last: int
    inside: str
    index_front: str | float
    index_back: str | float

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the ink's layers."""
        return tuple(layer.name for layer in self.sample.layers[self.first : self.last + 1])


def find_ink(
    sample: Sample,
    layers: Sequence[str] | str | None = None,
    inside: str | None = None,
    index_inside: float | None = None,
    index_outside: float | None = None,
) -> InkLayers:
    """Find the ink in a sample.

    Parameters
    ----------
    sample
        The sample.
    layers
        Names of neighbouring layers that make the ink; None: the only scattering one.
    inside
        Side of the plate, ``front`` or ``back``; None: that on which the ink has a neighbouring layer.
    index_inside, index_outside
        Refractive indices on the plate's and on the other side; None: of what the sample has there.

    Raises
    ------
    InputRefusedError
        If the layers are not names, do not exist or are not neighbours, or if the side of the plate is not
        clear.
    """
    known = [layer.name for layer in sample.layers]
    if layers is None:
        wanted = [layer.name for layer in sample.layers if layer.scatters]
        if len(wanted) != 1:
            raise InputRefusedError(
                f"the sample has {len(wanted)} scattering layers ({', '.join(wanted)}); name those that are "
                "the ink."
            )
    else:
        wanted = [layers] if isinstance(layers, str) else list(layers) if isinstance(layers, Iterable) else []
        if not wanted or not all(isinstance(name, str) for name in wanted):
            raise InputRefusedError(
                f"layers takes names of layers, of {', '.join(known)}; it was given {reprlib.repr(layers)}."
            )
    for name in wanted:
        if name not in known:
            raise InputRefusedError(f"the sample has no layer '{name}'; its layers are {', '.join(known)}.")
    positions = sorted(known.index(name) for name in set(wanted))
    first, last = positions[0], positions[-1]
    if positions != list(range(first, last + 1)):
        raise InputRefusedError(
            f"the layers {', '.join(wanted)} are not neighbours; name those between, too."
        )
    if not any(layer.scatters for layer in sample.layers[first : last + 1]):
        raise InputRefusedError(f"none of the layers {', '.join(wanted)} scatters; there is no ink in them.")
    if inside is None:
        neighbours = [
            side for side, there in (("front", first > 0), ("back", last + 1 < len(known))) if there
        ]
        if len(neighbours) != 1:
            raise InputRefusedError(
                f"the ink has {'layers on both sides' if neighbours else 'no layer beside it'}; say where "
                'the plate is: inside = "front" or inside = "back", in the order in which light meets them.'
            )
        (inside,) = neighbours
    if inside not in ("front", "back"):
        raise InputRefusedError(f'inside is {inside!r}; it must be "front" or "back".')
    front = _FRONT if first == 0 else f"{known[first - 1]}.refractive_index"
    back = _BACK if last + 1 == len(known) else f"{known[last + 1]}.refractive_index"
    given = (index_inside, index_outside) if inside == "front" else (index_outside, index_inside)
    return InkLayers(
        sample,
        first,
        last,
        inside,
        front if given[0] is None else float(given[0]),
        back if given[1] is None else float(given[1]),
    )


def ink_alone(ink: InkLayers, wavelengths_nm: Sequence[float], accuracy: float) -> ForwardModel:
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
    for name, medium in ((_FRONT, ink.index_front), (_BACK, ink.index_back)):
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
        parameters=ParameterTable(list((_without(numbers, _FRONT, _BACK) | media).values())),
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
        Of `ink_alone`.
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
        for name, medium in ((_FRONT, ink.index_front), (_BACK, ink.index_back))
    }
    return jax.vmap(lambda w, v: model.builder.stack(v, w))(jnp.asarray(wavelengths), columns | media)


def reversed_stack(stack: Stack) -> Stack:
    """The same stack, lit from its other side.

    Parameters
    ----------
    stack
        The stack.
    """
    return Stack(stack.layers[::-1], stack.index_back, stack.index_front, faces=stack.faces[::-1])


def reversed_sample(sample: Sample) -> Sample:
    """The same sample with fixed values, lit from its other side.

    Parameters
    ----------
    sample
        The sample.

    Returns
    -------
    Sample
        Without free parameters, ties and instrument.
    """
    swapped = {_FRONT: _BACK, _BACK: _FRONT}

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
