"""Text files of pab-opto's goniophotometer pgII, as its program Mountain reads and writes them.

Known from the manual page of Radiance's ``pabopto2bsdf`` and from the vendor's pages on coordinates and data.
A file holds one direction of incidence; directions of incidence and of view share one system of coordinates.
"""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from jaxink.measurement.formats.content import Content, shown
from jaxink.measurement.formats.exchange_options import ExchangeOptions, required
from jaxink.measurement.formats.points import FilePoints, without_cosine

_FORMAT = re.compile(
    r"^#[ \t]*format[ \t]*:?[ \t]*theta[ \t]+phi[ \t]+(DSF|BSDF|BRDF|BTDF)\b", re.IGNORECASE | re.MULTILINE
)
_HEADER = re.compile(r"#\s*(\w+)\s*:?\s*(.*)")
_CHANNELS = ("X", "Y", "Z")


def recognises(head: str) -> bool:
    """Whether a file starts as one of Mountain: the line ``#format`` says what the columns are."""
    return _FORMAT.search(head) is not None


@dataclass(frozen=True)
class _Incidence:
    """Direction of the source, polar angle from the front normal."""

    theta_deg: float
    phi_deg: float

    @property
    def face(self) -> str:
        return "front" if self.theta_deg <= 90 else "back"


def read(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points of both sides."""
    held, rows_of = _header(content)
    kind = next((found[1].upper() for line in content.lines if (found := _FORMAT.match(line))), None)
    if kind is None:
        raise content.refusal("the header has no line #format: theta phi DSF (or BSDF)")
    incidence = _incidence(content, held, rows_of)
    if choices.face not in (None, incidence.face):
        text = f"the light is on the {incidence.face} (theta {incidence.theta_deg:g}); leave out the face"
        raise content.refusal(f"{text}, or choose the other one")
    colorimetry = held.get("colorimetry", "CIE-Y").strip().upper()
    if colorimetry not in ("CIE-Y", "CIE-XYZ"):
        text = f"the colorimetry is {shown(colorimetry)}; it must be CIE-Y or CIE-XYZ"
        raise content.refusal(text, rows_of["colorimetry"])
    cells, rows = _rows(content, 5 if colorimetry == "CIE-XYZ" else 3)
    notes += content.unfinished_note()
    _refuse_other_kind(content, kind, choices)
    values = _values(content, cells, choices, notes)
    why = "the values are photometric and state no wavelength"
    wavelength = required(content.source, choices, "wavelength_nm", why)
    points = _points(incidence, cells, values, rows, wavelength)
    notes.append(
        "pab-opto: polar angles beyond 90 degrees were turned to the other normal, and the azimuth of the "
        f"source, {incidence.phi_deg:g} degrees, was subtracted. The light is on the {incidence.face}."
    )
    notes.append(f"The wavelength, {wavelength:g} nm, was given by the caller.")
    if kind != "DSF":
        return points
    notes.append("The file states that its values are DSF; they were divided by cos(theta_o).")
    return without_cosine(points, notes)


def _refuse_other_kind(content: Content, kind: str, choices: ExchangeOptions) -> None:
    """Reject a caller who says of the cosine what the file does not."""
    if choices.cosine_weighted is None or choices.cosine_weighted == (kind == "DSF"):
        return
    row = next(row for row, line in enumerate(content.lines, 1) if _FORMAT.match(line))
    held = "with" if kind == "DSF" else "without"
    text = (
        f"the file states that its values are {kind}, {held} the cosine, but the caller gives "
        f"cosine_weighted={choices.cosine_weighted}; leave it out, or correct the row if it is wrong"
    )
    raise content.refusal(text, row)


def _header(content: Content) -> tuple[dict[str, str], dict[str, int]]:
    """Text and row of each entry, by its name in small letters."""
    held: dict[str, str] = {}
    rows: dict[str, int] = {}
    for row, line in enumerate(content.lines, 1):
        if (found := _HEADER.match(line.strip())) is not None:
            held[found[1].lower()], rows[found[1].lower()] = found[2], row
    return held, rows


def _incidence(content: Content, held: dict[str, str], rows: dict[str, int]) -> _Incidence:
    if "incident_angle" in held:
        theta, phi = _numbers(content, held["incident_angle"].split()[:2], 2, rows["incident_angle"])
    elif "intheta" in held and "inphi" in held:
        pairs = [_numbers(content, held[name].split()[:1], 1, rows[name]) for name in ("intheta", "inphi")]
        theta, phi = pairs[0][0], pairs[1][0]
    else:
        raise content.refusal("the header states no direction of incidence (#incident_angle THETA PHI)")
    if not (0 <= theta <= 180 and abs(phi) <= 720):
        text = f"the direction of incidence is {theta:g} {phi:g}; the polar angle is 0 to 180 degrees"
        raise content.refusal(text, rows.get("incident_angle", rows.get("intheta")))
    return _Incidence(theta, phi)


def _numbers(content: Content, words: list[str], n: int, row: int) -> list[float]:
    if len(words) != n:
        raise content.refusal(f"{shown(' '.join(words))} is not {n} number{'s' * (n > 1)}", row)
    content.require_numbers(words, "this row", [row] * n)
    return [float(word) for word in words]


def _rows(content: Content, n: int) -> tuple[Float[np.ndarray, "rows cells"], Int[np.ndarray, " rows"]]:
    cells, rows = [], []
    for row, line in enumerate(content.lines, 1):
        if line.strip() and not line.lstrip().startswith("#"):
            cells.append(_numbers(content, line.split(), n, row))
            rows.append(row)
    if not cells:
        raise content.refusal("has a header but no row of values")
    return np.array(cells), np.array(rows)


def _values(content: Content, cells: np.ndarray, choices: ExchangeOptions, notes: list[str]) -> np.ndarray:
    if cells.shape[1] == 3:
        if choices.channel is not None:
            raise content.refusal("the file has one channel only; leave out the channel")
        return cells[:, 2]
    why = "the values are the tristimuli X, Y and Z, of which one is read"
    channel = required(content.source, choices, "channel", why).upper()
    if channel not in _CHANNELS:
        raise content.refusal(f"channel is {choices.channel!r}; it must be X, Y or Z")
    notes.append(f"The values are those of the tristimulus {channel}.")
    return cells[:, 2 + _CHANNELS.index(channel)]


def _points(incidence: _Incidence, cells, values, rows, wavelength_nm: float) -> FilePoints:
    theta, phi = cells[:, 0], cells[:, 1] - incidence.phi_deg
    theta_i = incidence.theta_deg
    behind = theta > 90
    if incidence.face == "back":
        # Seen from the back, azimuths run the other way round.
        theta_i, phi = 180 - theta_i, -phi
    n = values.size
    return FilePoints(
        theta_i_deg=np.full(n, theta_i),
        theta_o_deg=np.where(behind, 180 - theta, theta),
        phi_deg=phi,
        wavelength_nm=np.full(n, wavelength_nm),
        is_transmission=behind if incidence.face == "front" else ~behind,
        bsdf_per_sr=values,
        row=rows,
        extra={"lit_face": np.full(n, incidence.face)},
    )
