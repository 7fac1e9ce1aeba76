"""BSDF files of LightTools.

Known from the open reader of libbsdf only; the vendor's description is not public. Angles are those from the
normal, and the light arrives from azimuth 90.
"""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from jaxink.measurement.formats.chosen import chosen_rotation, chosen_tristimulus
from jaxink.measurement.formats.content import Content, Words, shown
from jaxink.measurement.formats.exchange_options import ExchangeOptions, ask
from jaxink.measurement.formats.own_files import origin, refuse_other_media
from jaxink.measurement.formats.points import (
    FilePoints,
    divided_as_requested,
    joined,
    one_wavelength,
    totals_note,
)
from jaxink.measurement.formats.polar_tables import distinct, total

# Where the specular or undeviated direction is; the light arrives from the opposite azimuth.
_SPECULAR_AZIMUTH_DEG = 270.0
_BLOCK_HEADER = re.compile(r"^\s*(aoi|side)\s+\w", re.IGNORECASE | re.MULTILINE)
# In files of jaxink's export.
_OWN_COMPONENTS = {"front": {"R": "R_AA", "T": "T_AI"}, "back": {"R": "R_II", "T": "T_IA"}}


def recognises(head: str) -> bool:
    """Whether a file starts as one of LightTools: blocks with AOI and Side below common axes."""
    small = head.lower()
    if "scatterradial" not in small or "angleofincidence" in small.replace("# angleofincidence", ""):
        return False
    return _BLOCK_HEADER.search(small.partition("databegin")[2]) is not None


@dataclass(frozen=True)
class _Block:
    """One table of values, by radial angle and azimuth."""

    aoi: float
    poi: float
    face: str
    wavelength_nm: float
    is_transmission: bool
    channel: str
    tis: float
    values: Float[np.ndarray, "radial azimuth"]
    rows: Int[np.ndarray, "radial azimuth"]


def read(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points of one face."""
    words = Words(content)
    radial, azimuth, symmetry = _header(content, words)
    specular = _specular_azimuth(content, symmetry, azimuth, choices)
    blocks = list(_blocks(content, words, (len(azimuth), len(radial))))
    if not blocks:
        raise content.refusal("contains no table of values")
    blocks = _of_one_face(content, blocks, choices, notes)
    blocks = _of_one_channel(content, blocks, choices, notes)
    blocks = _of_one_rotation(content, blocks, choices)
    own = origin(content.lines)
    parts, totals = [], []
    # Without the full circle there is no total.
    is_weighted = choices.cosine_weighted is True
    is_whole = azimuth[-1] - azimuth[0] > 360 - 1e-6
    for block in blocks:
        kind = "T" if block.is_transmission else "R"
        if choices.side not in (None, kind):
            continue
        refuse_other_media(content, own, _OWN_COMPONENTS[block.face][kind])
        parts.append(_points(block, radial, azimuth - specular + 180))
        if is_whole:
            totals.append(
                (block.aoi, total(radial, azimuth, block.values, is_weighted=is_weighted), block.tis)
            )
    if not parts:
        raise content.refusal(f"the face has no {choices.side}; leave out the side, or choose another face")
    notes += totals_note("AOI", totals)
    notes.append(
        "LightTools: azimuths were turned, because that of the specular or undeviated direction is "
        f"{specular:g} degrees there; polar angles are from the normal of the side on which the light leaves."
    )
    points = one_wavelength(joined(parts), content.source, choices.wavelength_nm, notes)
    return divided_as_requested(points, notes) if is_weighted else points


def _header(content: Content, words: Words) -> tuple[np.ndarray, np.ndarray, str]:
    """Radial angles, azimuths and symmetry."""
    axes: dict[str, np.ndarray] = {}
    held = {"symmetry": ""}
    while (key := (word := words.word("DataBegin")).lower()) != "databegin":
        row = words.row
        if key in ("scatterazimuth", "scatterradial"):
            axes[key], _ = words.numbers(words.count(f"the number of values of {word}"), word)
        elif key in ("symmetry", "spectralcontent", "source"):
            held[key] = words.word(f"the value of {word}").lower()
        else:
            raise content.refusal(f"the keyword {shown(word)} is unknown in a BSDF file of LightTools", row)
    for name, largest in (("scatterradial", 90.0), ("scatterazimuth", 360.0)):
        axis = axes.get(name)
        if axis is None:
            raise content.refusal(f"the keyword {name} is missing before the data")
        if axis.min() < 0 or axis.max() > largest + 1e-6 or (np.diff(axis) <= 0).any():
            raise content.refusal(f"{name} must ascend between 0 and {largest:g} degrees")
    return axes["scatterradial"], axes["scatterazimuth"], held["symmetry"]


def _specular_azimuth(
    content: Content, symmetry: str, azimuth: np.ndarray, choices: ExchangeOptions
) -> float:
    """Azimuth of the specular direction in the file; of a half circle, it must be at its end."""
    if choices.specular_phi_deg is not None:
        return choices.specular_phi_deg
    low, high = float(azimuth[0]), float(azimuth[-1])
    is_half = symmetry == "planesymmetrical" and high - low < 360 - 1e-6
    if is_half and not 90 - 1e-6 <= low < high <= _SPECULAR_AZIMUTH_DEG + 1e-6:
        why = (
            f"the half circle of azimuths {low:g} to {high:g} does not end at the plane of incidence, as "
            "far as is known of the format (light from azimuth 90, specular direction at 270)"
        )
        raise ask(content.source, "specular_phi_deg", why)
    return _SPECULAR_AZIMUTH_DEG


def _blocks(content: Content, words: Words, shape: tuple[int, int]):
    """The tables of values in the order of the file."""
    held: dict[str, float | str] = {}
    while (key := (word := words.word("DataEnd")).lower()) != "dataend":
        row = words.row
        if key in ("aoi", "poi", "wavelength"):
            held[key] = words.number(word)
        elif key in ("side", "scattertype", "tristimulusvalue"):
            held[key] = words.word(f"the value of {word}").lower()
        elif key == "tis":
            tis = words.number("TIS")
            values, rows = words.numbers(shape[0] * shape[1], "a table of scatter values")
            yield _block(content, held, tis, values.reshape(shape).T, rows.reshape(shape).T, row)
            held = {}
        else:
            text = (
                f"{shown(word)} stands where a keyword should; the header counts {shape[0]} azimuths "
                f"and {shape[1]} radial angles"
            )
            raise content.refusal(text, row)
    words.require_over("DataEnd")


def _block(content: Content, held, tis: float, values, rows, row: int) -> _Block:
    for name in ("aoi", "side", "wavelength", "scattertype"):
        if name not in held:
            raise content.refusal(f"the table of values has no {name}", row)
    for name, allowed in (("side", ("front", "back")), ("scattertype", ("brdf", "btdf"))):
        if held[name] not in allowed:
            text = f"{name} is {shown(held[name])}; it must be one of: {', '.join(allowed)}"
            raise content.refusal(text, row)
    return _Block(
        aoi=held["aoi"],
        poi=held.get("poi", 0.0),
        face=held["side"],
        wavelength_nm=held["wavelength"],
        is_transmission=held["scattertype"] == "btdf",
        channel=held.get("tristimulusvalue", "").removeprefix("tris").upper(),
        tis=tis,
        values=values,
        rows=rows,
    )


def _of_one_face(
    content: Content, blocks: list[_Block], choices: ExchangeOptions, notes: list[str]
) -> list[_Block]:
    faces = sorted({block.face for block in blocks})
    if choices.face is None:
        if len(faces) > 1:
            why = "the file has light on the front and on the back, of which a measurement has one"
            raise ask(content.source, "face", why)
        return blocks
    if choices.face not in faces:
        raise content.refusal(f"the file has no light on the {choices.face}; leave out the face")
    if len(faces) > 1:
        notes.append(f"Only light on the {choices.face} was read, as requested by the caller.")
    return [block for block in blocks if block.face == choices.face]


def _of_one_channel(content: Content, blocks: list[_Block], choices: ExchangeOptions, notes) -> list[_Block]:
    channels = sorted({block.channel for block in blocks})
    if choices.channel is None and len(channels) == 1:
        return blocks
    listed = ", ".join(channel or "one without a name" for channel in channels)
    words = f"the values are tristimuli ({listed})", f"the file has {listed}"
    wanted = chosen_tristimulus(content, choices, channels, words, notes)
    return [block for block in blocks if block.channel == wanted]


def _of_one_rotation(content: Content, blocks: list[_Block], choices: ExchangeOptions) -> list[_Block]:
    angles = sorted({block.poi for block in blocks})
    words = "the plane of incidence (POI) was at {} degrees"
    rotation = angles[chosen_rotation(content, choices, angles, words)]
    return [block for block in blocks if block.poi == rotation]


def _points(block: _Block, radial: np.ndarray, phi_deg: np.ndarray) -> FilePoints:
    values, keep = distinct(radial, phi_deg, block.values)
    theta, phi = np.broadcast_arrays(radial[:, None], phi_deg)
    n = int(keep.sum())
    return FilePoints(
        theta_i_deg=np.full(n, block.aoi),
        theta_o_deg=theta[keep],
        phi_deg=phi[keep],
        wavelength_nm=np.full(n, block.wavelength_nm),
        is_transmission=np.full(n, block.is_transmission),
        bsdf_per_sr=values[keep],
        row=block.rows[keep],
        extra={"lit_face": np.full(n, block.face)},
    )
