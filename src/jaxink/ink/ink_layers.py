"""Selection of the ink's layers in a sample, and the media on either side."""

import dataclasses
import reprlib
from collections.abc import Iterable, Sequence

from jaxink.errors import InputRefusedError
from jaxink.sample import Sample

FRONT, BACK = "surroundings.index_front", "surroundings.index_back"


@dataclasses.dataclass(frozen=True)
class InkLayers:
    """The ink's layers in a sample, and the media on either side.

    Parameters
    ----------
    sample
        The whole sample.
    first, last
        Positions of the ink's first and last layer, from the illuminated side.
    inside
        Side of the ink on which the plate is: ``front`` (light meets the plate first) or ``back``.
    index_front, index_back
        Refractive indices of the adjacent media: numbers if given, otherwise names of parameters.
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
        Names of the adjacent layers that form the ink; None: the only scattering one.
    inside
        Side of the plate, ``front`` or ``back``; None: the side on which the ink has an adjacent layer.
    index_inside, index_outside
        Refractive indices on the plate's side and on the other side; None: those of the sample.

    Raises
    ------
    InputRefusedError
        If the layers do not exist or are not adjacent, or if the side of the plate is ambiguous.
    """
    first, last = _positions(sample, layers)
    known = [layer.name for layer in sample.layers]
    inside = _side_of_plate(inside, has_front=first > 0, has_back=last + 1 < len(known))
    front = FRONT if first == 0 else f"{known[first - 1]}.refractive_index"
    back = BACK if last + 1 == len(known) else f"{known[last + 1]}.refractive_index"
    given = (index_inside, index_outside) if inside == "front" else (index_outside, index_inside)
    return InkLayers(
        sample,
        first,
        last,
        inside,
        front if given[0] is None else float(given[0]),
        back if given[1] is None else float(given[1]),
    )


def _positions(sample: Sample, layers: Sequence[str] | str | None) -> tuple[int, int]:
    """Positions of the first and the last layer of the ink."""
    known = [layer.name for layer in sample.layers]
    if layers is None:
        wanted = [layer.name for layer in sample.layers if layer.scatters]
        if len(wanted) != 1:
            raise InputRefusedError(
                f"the sample has {len(wanted)} scattering layers ({', '.join(wanted)}); name those that form "
                "the ink."
            )
    else:
        wanted = [layers] if isinstance(layers, str) else list(layers) if isinstance(layers, Iterable) else []
        if not wanted or not all(isinstance(name, str) for name in wanted):
            raise InputRefusedError(
                f"layers is {reprlib.repr(layers)}; it must be names from {', '.join(known)}."
            )
    for name in wanted:
        if name not in known:
            raise InputRefusedError(f"the sample has no layer '{name}'; its layers are {', '.join(known)}.")
    positions = sorted(known.index(name) for name in set(wanted))
    first, last = positions[0], positions[-1]
    if positions != list(range(first, last + 1)):
        raise InputRefusedError(
            f"the layers {', '.join(wanted)} are not adjacent; also name those between them."
        )
    if not any(layer.scatters for layer in sample.layers[first : last + 1]):
        inks = ", ".join(layer.name for layer in sample.layers if layer.scatters)
        raise InputRefusedError(
            f"none of the layers {', '.join(wanted)} scatters; name one that does, out of {inks}."
        )
    return first, last


def _side_of_plate(inside: str | None, has_front: bool, has_back: bool) -> str:
    """The given side, or the only one on which the ink has an adjacent layer."""
    if inside is None:
        neighbours = [side for side, there in (("front", has_front), ("back", has_back)) if there]
        if len(neighbours) != 1:
            raise InputRefusedError(
                f"the ink has {'layers on both sides' if neighbours else 'no adjacent layer'}; state where "
                'the plate is, as seen from the illuminated side: inside = "front" or inside = "back".'
            )
        (inside,) = neighbours
    if inside not in ("front", "back"):
        raise InputRefusedError(f'inside is {inside!r}; it must be "front" or "back".')
    return inside
