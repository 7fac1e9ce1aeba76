"""What the files that jaxink exports say in their comments: wavelength and media."""

import re
from collections.abc import Iterable
from typing import NamedTuple

from jaxink.measurement.formats.content import Content

_ORIGIN = re.compile(r"BSDF by jaxink, (\S+) nm; I: .*, index (\S+); A: .*, index (\S+)$")
_SAME_INDEX = 1e-9


class ExportedMedia(NamedTuple):
    """Wavelength of an exported file, and refractive indices of its sides I and A."""

    wavelength_nm: float
    index_of_side: dict[str, float]


def origin(lines: Iterable[str]) -> ExportedMedia | None:
    """What the comments of an exported file say; None if jaxink did not write it."""
    for line in lines:
        found = _ORIGIN.search(line.strip())
        if found:
            try:
                wavelength, inside, outside = (float(text) for text in found.groups())
            except ValueError:
                return None
            return ExportedMedia(wavelength, {"I": inside, "A": outside})
    return None


def refuse_other_media(content: Content, known: ExportedMedia | None, component: str) -> None:
    """Reject a component that does not begin and end in air, as every measurement does.

    ``component`` is R or T, the side that the light comes from, and that to which it leaves: ``T_AI``.
    """
    if known is None:
        return
    for side in component[2:]:
        index = known.index_of_side[side]
        if abs(index - 1) > _SAME_INDEX:
            raise content.refusal(
                f"{component} holds directions in a medium of index {index:g}; a measurement has air on both "
                "sides, so read one of the sample in air, or another component"
            )
