"""Selection of the ink's layers in a sample, and the media on either side."""

import dataclasses
import reprlib
from collections.abc import Iterable, Iterator, Sequence

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.sample import Layer, Sample

FRONT, BACK = "surroundings.index_front", "surroundings.index_back"
SURROUNDINGS = "the surroundings"
GIVEN_MEDIUM = "a medium of the given index"
# A clear layer with this index, to within the tolerance, is a layer of air.
_AIR_INDEX, _AIR_TOLERANCE = 1.0, 1e-6


@dataclasses.dataclass(frozen=True)
class InkChoice:
    """Arguments of `find_ink` that leave nothing open.

    Parameters
    ----------
    layers
        Names of the layers that form the ink.
    inside
        The medium that it is seen from: ``front``, ``back``, or the name of an adjacent layer.
    """

    __repr__ = brief_repr

    layers: tuple[str, ...]
    inside: str


class UnclearInkError(InputRefusedError):
    """The ink, or the medium that it is seen from, is not clear.

    Parameters
    ----------
    sentence
        What is not clear.
    choices
        The choices that are possible.
    """

    def __init__(self, sentence: str, choices: Iterable[InkChoice] = ()):
        super().__init__(sentence)
        self.choices = tuple(choices)


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

    __repr__ = brief_repr

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

    @property
    def media(self) -> tuple[str, str]:
        """The media of side I, from which the ink is seen, and of side A: a layer's name, or in words."""
        front, back = _medium_in_words(self.index_front), _medium_in_words(self.index_back)
        return (front, back) if self.inside == "front" else (back, front)

    def indices(self, wavelength_nm: float) -> tuple[float, float]:
        """Refractive indices of side I and of side A at one wavelength."""
        front, back = (
            medium if isinstance(medium, float) else refractive_index(self.sample, medium, wavelength_nm)
            for medium in (self.index_front, self.index_back)
        )
        return (front, back) if self.inside == "front" else (back, front)


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
        The medium that the ink is seen from: ``front`` or ``back``, as seen from the illuminated side, or the
        name of an adjacent layer; None: the only adjacent layer, unless that is air.
    index_inside, index_outside
        Refractive indices on the plate's side and on the other side; None: those of the sample.

    Raises
    ------
    UnclearInkError
        If several choices are possible; names them.
    InputRefusedError
        If the layers do not exist or are not adjacent.
    """
    first, last = _positions(sample, layers)
    side = _only_side(sample, first, last) if inside is None else _side_named(sample, first, last, inside)
    known = [layer.name for layer in sample.layers]
    front = FRONT if first == 0 else f"{known[first - 1]}.refractive_index"
    back = BACK if last + 1 == len(known) else f"{known[last + 1]}.refractive_index"
    given = (index_inside, index_outside) if side == "front" else (index_outside, index_inside)
    return InkLayers(
        sample,
        first,
        last,
        side,
        front if given[0] is None else float(given[0]),
        back if given[1] is None else float(given[1]),
    )


def refractive_index(sample: Sample, name: str, wavelength_nm: float) -> float:
    """Value of a refractive index, given by its plain name, at one wavelength."""
    return float(sample.at_wavelength(sample.parameters.values_with({}), wavelength_nm)[name])


def is_air(sample: Sample, layer: Layer) -> bool:
    """Whether a layer is clear and has the refractive index of air at all wavelengths."""
    name = f"{layer.name}.refractive_index"
    indices = [v for n, v in sample.parameters.values_with({}).items() if n.split("@")[0] == name]
    is_one = bool(indices) and all(abs(n - _AIR_INDEX) <= _AIR_TOLERANCE for n in indices)
    return is_one and not layer.scatters


def adjacent_air(sample: Sample, layers: Sequence[str]) -> tuple[str, ...]:
    """Layers of air between the ink, given by its layers, and a further clear layer."""
    choices = _choices(sample, *_positions(sample, layers))
    return tuple(sorted({name for choice in choices for name in choice.layers if name not in layers}))


def _medium_in_words(index: str | float) -> str:
    if isinstance(index, float):
        return GIVEN_MEDIUM
    return SURROUNDINGS if index in (FRONT, BACK) else index.removesuffix(".refractive_index")


def _positions(sample: Sample, layers: Sequence[str] | str | None) -> tuple[int, int]:
    """Positions of the first and the last layer of the ink."""
    known = [layer.name for layer in sample.layers]
    if layers is None:
        wanted = [layer.name for layer in sample.layers if layer.scatters]
        if len(wanted) != 1:
            at = [known.index(name) for name in wanted]
            ends = [*((k, k) for k in at), (min(at), max(at))]
            raise UnclearInkError(
                f"the sample has {len(wanted)} scattering layers ({', '.join(wanted)}); name those that form "
                "the ink (layers, --layer).",
                (choice for first, last in ends for choice in _choices(sample, first, last)),
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
    if not any(layer.scatters for layer in sample.layers[first : last + 1]):
        inks = ", ".join(layer.name for layer in sample.layers if layer.scatters)
        raise InputRefusedError(
            f"none of the layers {', '.join(wanted)} scatters; name one that does, out of {inks}."
        )
    if positions != list(range(first, last + 1)):
        raise UnclearInkError(
            f"the layers {', '.join(wanted)} are not adjacent; also name those between them.",
            _choices(sample, first, last),
        )
    return first, last


def _only_side(sample: Sample, first: int, last: int) -> str:
    """The only side on which the ink has an adjacent layer, unless that is air."""
    beside = _beside(sample, first, last)
    choices = tuple(_choices(sample, first, last))
    if len(beside) != 1:
        between = " and ".join(f"'{layer.name}' ({side})" for side, layer in beside.items())
        what = f"lies between {between}" if beside else "has no adjacent layer"
        raise UnclearInkError(
            f"the ink {what}; name the medium that it is seen from (inside, --from): an adjacent layer, or "
            "front or back, as seen from the illuminated side.",
            choices,
        )
    ((side, layer),) = beside.items()
    if is_air(sample, layer):
        raise UnclearInkError(
            f"the layer '{layer.name}' next to the ink is air, not the plate; choose whether the ink is seen "
            f"from '{layer.name}' (inside, --from), or name '{layer.name}' as a part of the ink (layers, "
            "--layer) and the plate as the medium that it is seen from.",
            choices,
        )
    return side


def _side_named(sample: Sample, first: int, last: int, inside: str) -> str:
    """Side of the medium with this name."""
    beside = _beside(sample, first, last)
    sides = {layer.name: side for side, layer in beside.items()}
    if inside in sides:
        return sides[inside]
    known = [layer.name for layer in sample.layers]
    if inside in ("front", "back") and inside not in known:
        return inside
    adjacent = ", ".join(f"'{name}'" for name in sides) or "none"
    sentence = (
        f"the ink cannot be seen from {inside!r} (inside, --from); it must be an adjacent layer "
        f'({adjacent}), "front" or "back".'
    )
    if inside not in known or first <= known.index(inside) <= last:
        raise UnclearInkError(sentence, _choices(sample, first, last))
    there = known.index(inside)
    ends = (there + 1, last) if there < first else (first, there - 1)
    raise UnclearInkError(
        f"the layer '{inside}' is not next to the ink; to see it from there, the layers between them "
        "must be parts of the ink (layers, --layer).",
        [InkChoice(_names(sample, *ends), inside)],
    )


def _beside(sample: Sample, first: int, last: int) -> dict[str, Layer]:
    """Layers next to the ink, by side."""
    layers = sample.layers
    front = {"front": layers[first - 1]} if first > 0 else {}
    return front | ({"back": layers[last + 1]} if last + 1 < len(layers) else {})


def _choices(sample: Sample, first: int, last: int) -> Iterator[InkChoice]:
    """Every clear medium from which the ink can be seen; a layer of air is one, or a part of the ink."""
    beside = _beside(sample, first, last)
    if not beside:
        yield from (InkChoice(_names(sample, first, last), side) for side in ("front", "back"))
    for side, layer in beside.items():
        if layer.scatters:
            continue
        yield InkChoice(_names(sample, first, last), layer.name)
        if is_air(sample, layer):
            wider = (first - 1, last) if side == "front" else (first, last + 1)
            beyond = _beside(sample, *wider).get(side)
            if beyond is not None and not beyond.scatters:
                yield InkChoice(_names(sample, *wider), beyond.name)


def _names(sample: Sample, first: int, last: int) -> tuple[str, ...]:
    return tuple(layer.name for layer in sample.layers[first : last + 1])
