"""Tabular BSDF files of Zemax OpticStudio.

Known from the format's specification by its author (Rykowski, "BSDF Data Interchange File Format
Specification", 2008, and its later edition "Zemax Tabular BSDF data file format", which says that the angle
of incidence is that of the specular or transmitted direction) and from the open reader of libbsdf.
"""

import re
from dataclasses import dataclass

import numpy as np

from jaxink.measurement.formats.chosen import chosen_rotation, chosen_tristimulus
from jaxink.measurement.formats.content import Content, Words, shown
from jaxink.measurement.formats.exchange_options import ExchangeOptions, ask
from jaxink.measurement.formats.own_files import ExportedMedia, origin, refuse_other_media
from jaxink.measurement.formats.points import FilePoints, divided_as_requested, joined, totals_note
from jaxink.measurement.formats.polar_tables import points_about_specular, total

_WORDS = ("source", "symmetry", "spectralcontent", "scattertype")
_AXES = ("samplerotation", "angleofincidence", "scatterazimuth", "scatterradial")
_CHANNELS = {"monochrome": "Y", "tristimulusx": "X", "tristimulusy": "Y", "tristimulusz": "Z"}
_HEADER = re.compile(r"^\s*angleofincidence\s+\d", re.IGNORECASE | re.MULTILINE)
_COMPONENT = re.compile(r"# component ([RT]_[IA][IA])\b")


def recognises(head: str) -> bool:
    """Whether a file starts as one of Zemax; the axis ``AngleOfIncidence`` is in no other format."""
    return _HEADER.search(head) is not None and "scatterradial" in head.lower()


@dataclass(frozen=True)
class _Header:
    """Words and axes of the header, by their names in small letters."""

    words: dict[str, str]
    axes: dict[str, np.ndarray]

    @property
    def is_mirrored(self) -> bool:
        return self.words["symmetry"] == "planesymmetrical"


def read(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points above the horizon."""
    words = Words(content)
    header, section = _header(content, words)
    channel = _channel(content, header, choices, notes)
    is_transmission = header.words["scattertype"] == "btdf"
    own = origin(content.lines)
    _refuse_other_media(content, own)
    wavelength = _wavelength(content, own, choices, notes)
    rotations = header.axes["samplerotation"].tolist()
    rotation = chosen_rotation(content, choices, rotations, "the sample was rotated to {} degrees")
    parts, totals = [], []
    for name, k, angle, stated, values, rows in _blocks(content, words, header, section):
        if name != channel or k != rotation:
            continue
        axes = header.axes["scatterradial"], header.axes["scatterazimuth"]
        parts.append(points_about_specular(angle, angle, *axes, values, rows, wavelength, is_transmission))
        totals.append((angle, _total(header, angle, values, choices.cosine_weighted is True), stated))
    notes += totals_note("AngleOfIncidence", totals)
    notes.append(
        "Zemax: scatter angles about the specular or undeviated direction were turned into angles from the "
        "normal. AngleOfIncidence was read as the angle of incidence, which it is if both sides are air."
    )
    points = joined(parts)
    below = points.theta_o_deg > 90
    if below.any():
        notes.append(f"{int(below.sum())} values below the horizon were left out.")
    points = points.at(~below)
    return divided_as_requested(points, notes) if choices.cosine_weighted else points


def _header(content: Content, words: Words) -> tuple[_Header, str]:
    """The header, and the name of the first section of data."""
    held: dict[str, str] = {}
    axes: dict[str, np.ndarray] = {}
    while True:
        row, word = words.row, words.word("the keyword of the data (Monochrome or TristimulusX)")
        key = word.lower()
        if key in _WORDS:
            held[key] = words.word(f"the value of {word}").lower()
        elif key in _AXES:
            axes[key], _ = words.numbers(words.count(f"the number of values of {word}"), word)
        elif key in _CHANNELS:
            break
        else:
            raise content.refusal(f"the keyword {shown(word)} is unknown in a BSDF file of Zemax", row)
    for name in (*_WORDS[1:], *_AXES[1:]):
        if name not in held and name not in axes:
            raise content.refusal(f"the keyword {name} is missing before the data", row)
    allowed = {
        "symmetry": ("planesymmetrical", "asymmetrical", "asymmetrical4d"),
        "spectralcontent": ("monochrome", "xyz"),
        "scattertype": ("brdf", "btdf"),
    }
    for name, values in allowed.items():
        if held[name] not in values:
            text = f"{name} is {shown(held[name])}; it must be one of: {', '.join(values)}"
            raise content.refusal(text)
    axes.setdefault("samplerotation", np.zeros(1))
    _refuse_axes(content, axes)
    return _Header(held, axes), key


def _refuse_axes(content: Content, axes: dict[str, np.ndarray]) -> None:
    most = {"angleofincidence": 90.0, "scatterazimuth": 360.0, "scatterradial": 180.0}
    for name, largest in most.items():
        axis = axes[name]
        if axis.min() < 0 or axis.max() > largest + 1e-6 or (np.diff(axis) <= 0).any():
            raise content.refusal(f"{name} must ascend between 0 and {largest:g} degrees")


def _channel(content: Content, header: _Header, choices: ExchangeOptions, notes: list[str]) -> str:
    if header.words["spectralcontent"] == "monochrome":
        if choices.channel is not None:
            raise content.refusal("the file has one channel only; leave out the channel")
        return "Y"
    words = "the values are the tristimuli X, Y and Z", "it must be X, Y or Z"
    return chosen_tristimulus(content, choices, ("X", "Y", "Z"), words, notes)


def _refuse_other_media(content: Content, own: ExportedMedia | None) -> None:
    component = next((found[1] for line in content.lines if (found := _COMPONENT.match(line))), None)
    if component is not None:
        refuse_other_media(content, own, component)


def _wavelength(
    content: Content, own: ExportedMedia | None, choices: ExchangeOptions, notes: list[str]
) -> float:
    if own is None and choices.wavelength_nm is None:
        raise ask(content.source, "wavelength_nm", "a BSDF file of Zemax has no wavelength")
    if own is None or choices.wavelength_nm is not None:
        notes.append(f"The wavelength, {choices.wavelength_nm:g} nm, was given by the caller.")
        return float(choices.wavelength_nm or 0)
    notes.append(f"The wavelength, {own.wavelength_nm:g} nm, is from jaxink's comment in the file.")
    return own.wavelength_nm


def _blocks(content: Content, words: Words, header: _Header, section: str):
    """Channel, rotation, specular angle, total, values by radial angle and azimuth, and rows, by block."""
    angles = header.axes["angleofincidence"]
    shape = len(header.axes["scatterazimuth"]), len(header.axes["scatterradial"])
    sections = ("monochrome",) if header.words["spectralcontent"] == "monochrome" else tuple(_CHANNELS)[1:]
    for position, name in enumerate(sections):
        row, key = words.row, section if position == 0 else words.word(name).lower()
        if key != name:
            raise content.refusal(f"the data begin with {shown(key)}; it must be {name}", row)
        _expect(content, words, "databegin", shape)
        for k in range(len(header.axes["samplerotation"])):
            for angle in angles:
                _expect(content, words, "tis", shape)
                stated = words.number("TIS")
                values, rows = words.numbers(shape[0] * shape[1], "a table of scatter values")
                yield _CHANNELS[name], k, float(angle), stated, values.reshape(shape).T, rows.reshape(shape).T
        _expect(content, words, "dataend", shape)
    words.require_over("DataEnd")


def _expect(content: Content, words: Words, key: str, shape: tuple[int, int]) -> None:
    row, word = words.row, words.word(key)
    if word.lower() != key:
        text = (
            f"{shown(word)} stands where {key} should; the header counts {shape[0]} azimuths and "
            f"{shape[1]} radial angles"
        )
        raise content.refusal(text, row)


def _total(header: _Header, angle: float, values, is_weighted: bool) -> float:
    """Scattered over incident power, of values that hold the cosine or not."""
    found = total(header.axes["scatterradial"], header.axes["scatterazimuth"], values, angle, is_weighted)
    return 2 * found if header.is_mirrored else found
