"""A sample with its layers in the opposite order, as if lit from the other side."""

import dataclasses

from jaxink.sample.description import Layer, Sample
from jaxink.sample.parameters import ParameterTable
from jaxink.sample.ties import names_in

FRONT, BACK = "surroundings.index_front", "surroundings.index_back"
_SWAPPED = {FRONT: BACK, BACK: FRONT}
OPPOSITE_FACE = {"front_roughness": "back_roughness", "back_roughness": "front_roughness"}


def turned_layers(layers: tuple[Layer, ...]) -> tuple[Layer, ...]:
    """The layers in the opposite order, each with its two faces exchanged."""
    return tuple(
        dataclasses.replace(
            layer,
            roughness=tuple(
                dataclasses.replace(face, face=OPPOSITE_FACE[face.face]) for face in layer.roughness
            ),
        )
        for layer in reversed(layers)
    )


def opposite_medium(name: str) -> str:
    """Name of a parameter after the two surroundings have changed places."""
    stem, at, wavelength = name.partition("@")
    return _SWAPPED.get(stem, stem) + at + wavelength


def turned_over(sample: Sample) -> Sample | None:
    """The same sample and instrument with the light on the other side; None if a tie names a surrounding."""
    table = list(sample.parameters.values())
    tied = {name.split("@")[0] for p in table if p.tie is not None for name in names_in(p.tie)}
    if tied & _SWAPPED.keys():
        return None
    return dataclasses.replace(
        sample,
        layers=turned_layers(sample.layers),
        parameters=ParameterTable([dataclasses.replace(p, name=opposite_medium(p.name)) for p in table]),
    )
