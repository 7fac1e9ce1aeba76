"""Header and channels that the BSDF files of Integra's programs (Lumicept) share.

Known from the open readers and writers of libbsdf (DdrReader, SdrReader, DdrWriter, SdrWriter); Integra's own
description of the format is not public.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import PurePath

import numpy as np
from jaxtyping import Float

from jaxink.measurement.formats.content import Content, Words, shown
from jaxink.measurement.formats.exchange_options import ExchangeOptions, ask
from jaxink.measurement.formats.own_files import ExportedMedia, origin

COMMENT = ";;"
_LINE = r"^[ \t]*{}\b"
_COLOUR_MODEL = re.compile(_LINE.format("TypeColorModel"), re.IGNORECASE | re.MULTILINE)
_SCATTERED = re.compile(_LINE.format("(TypeSym|TypeData)"), re.IGNORECASE | re.MULTILINE)
_COMPONENT = re.compile(r"component ([RT]_[IA][IA])\b")
# The words that may follow each keyword, by their small letters.
_WORDS = {
    "source": ("measured", "generated", "edited", "morphed"),
    "typesym": ("axisymmetrical", "dirsymmetrical", "planesymmetrical", "asymmetrical"),
    "typecolormodel": ("bw", "rgb", "spectral"),
    "typedata": ("luminance", "intensity"),
}
# Largest angle of each axis; the refracted axis has one value for each incidence.
_AXES = {"psi": 360.0, "sigma": 90.0, "sigmat": 90.0, "phi": 360.0, "theta": 180.0}
# Keyword of each channel; the long forms are written by libbsdf.
_CHANNELS = {"bw": "bw", "wl": "wl", "red": "red", "gre": "green", "green": "green", "blu": "blue"}
_CHANNELS |= {"blue": "blue"}
_COLOURS = ("red", "green", "blue")


@dataclass
class Header:
    """Words and axes above the values, by their keywords in small letters."""

    words: dict[str, str] = field(default_factory=dict)
    axes: dict[str, Float[np.ndarray, " angles"]] = field(default_factory=dict)
    n_wavelengths: int = 1


def is_integra(head: str) -> bool:
    """Whether a file starts as one of Integra: the keyword ``TypeColorModel`` is in no other format."""
    return _COLOUR_MODEL.search(head) is not None


def is_scattered(head: str) -> bool:
    """Whether such a file holds scattered light (DDR, DDT); one of regular light (SDR, SDT) if not."""
    return _SCATTERED.search(head) is not None


def read_header(content: Content, words: Words, required: tuple[str, ...]) -> Header:
    """The header, up to the keyword of the first channel, which is the next word then.

    Raises
    ------
    InputRefusedError
        If a keyword is unknown or one of those required is missing, or an axis does not ascend in its range.
    """
    header = Header()
    while words.next not in _CHANNELS:
        row, word = words.row, words.word("the keyword of the values (bw, red or wl)")
        key = word.lower()
        if key in header.words or key in header.axes:
            raise content.refusal(f"the keyword {word} stands twice; keep one of them", row)
        if key in _WORDS:
            _read_word(content, words, header, key, word)
        elif key in _AXES:
            _read_axis(content, words, header, key, word)
        else:
            raise content.refusal(f"the keyword {shown(word)} is unknown in a BSDF file of Integra", row)
    for name in required:
        if name.lower() not in header.words and name.lower() not in header.axes:
            raise content.refusal(f"the keyword {name} is missing above the values", words.row)
    return header


def _read_word(content: Content, words: Words, header: Header, key: str, shown_key: str) -> None:
    row, word = words.row, words.word(f"the value of {shown_key}").lower()
    if word not in _WORDS[key]:
        text = f"{shown_key} is {shown(word)}; it must be one of: {', '.join(_WORDS[key])}"
        raise content.refusal(text, row)
    if word == "spectral":
        header.n_wavelengths = words.count("the number of wavelengths of TypeColorModel")
    rest = words.rest_of_row(row)
    if key == "typedata":
        if rest[:1] not in (["absolute"], ["relative"]):
            raise content.refusal(f"{shown_key} {word} must be followed by Absolute or Relative", row)
        word = f"{word} {rest[0]}"
    header.words[key] = word


def _read_axis(content: Content, words: Words, header: Header, key: str, shown_key: str) -> None:
    row = words.row
    if key == "sigmat":
        if "sigma" not in header.axes:
            raise content.refusal("sigmat stands above sigma, whose number of values it has", row)
        n = header.axes["sigma"].size
    else:
        n = words.count(f"the number of values of {shown_key}")
    axis, _ = words.numbers(n, shown_key)
    # Light beyond the critical angle has the horizon as its refracted axis, at several incidences.
    does_ascend = (np.diff(axis) >= 0).all() if key == "sigmat" else (np.diff(axis) > 0).all()
    if axis.min() < 0 or axis.max() > _AXES[key] + 1e-6 or not does_ascend:
        text = f"{shown_key} must ascend between 0 and {_AXES[key]:g} degrees"
        raise content.refusal(text, row)
    header.axes[key] = axis


def channels(content: Content, words: Words, header: Header) -> Iterator[tuple[str, float]]:
    """Name and wavelength, nan for a colour, of each channel; its words are to be read in between."""
    model = header.words["typecolormodel"]
    expected = {"bw": ("bw",), "rgb": _COLOURS}.get(model, ("wl",) * header.n_wavelengths)
    for name in expected:
        row, word = words.row, words.word(f"the values of {name}")
        if _CHANNELS.get(word.lower()) != name:
            text = f"{shown(word)} stands where {name} should; the header has other numbers of values"
            raise content.refusal(text, row)
        yield name, words.number("the wavelength of wl") if name == "wl" else np.nan
    words.require_over("the last channel")


def expect(content: Content, words: Words, key: str) -> None:
    """Read a keyword that must stand here."""
    row, word = words.row, words.word(key)
    if word.lower() != key:
        text = f"{shown(word)} stands where {key} should; the header has other numbers of values"
        raise content.refusal(text, row)


def own_origin(content: Content) -> tuple[ExportedMedia | None, str | None]:
    """Of a file that jaxink has exported, what its comments say, and its component."""
    comments = [line for line in content.lines if line.lstrip().startswith(COMMENT)]
    component = next((found[1] for line in comments if (found := _COMPONENT.search(line))), None)
    return origin(comments), component


def is_transmission(content: Content, stated: str | None, component: str | None, kind: str) -> bool:
    """Whether light is transmitted: by the suffix of the file, or as the caller states.

    ``kind`` is the beginning of the suffixes, ``"dd"`` or ``"sd"``.
    """
    if component is not None:
        return component[0] == "T"
    suffix = PurePath(content.source).suffix.lower()
    if suffix in (f".{kind}r", f".{kind}t"):
        return suffix.endswith("t")
    if stated is None:
        why = f"only the suffix .{kind}r or .{kind}t tells reflection from transmission, and the file has "
        raise ask(content.source, "side", f"{why}another one")
    return stated == "T"


def wanted_channel(
    content: Content, header: Header, choices: ExchangeOptions, notes: list[str]
) -> str | None:
    """The colour to read; None if the values are of wavelengths, or of one channel."""
    if header.words["typecolormodel"] != "rgb":
        if choices.channel is not None:
            raise content.refusal("the values are not colours; leave out the channel")
        return None
    if choices.channel is None:
        why = "the values are those of red, green and blue, of which one is read"
        raise ask(content.source, "channel", why)
    if choices.channel.lower() not in _COLOURS:
        raise content.refusal(f"channel is {choices.channel!r}; it must be red, green or blue")
    notes.append(f"The values are those of {choices.channel.lower()}.")
    return choices.channel.lower()
