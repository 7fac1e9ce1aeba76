"""Scattering files of Ansys Speos in text mode: ``.anisotropicbsdf`` and ``.brdf``.

Known from the vendor's pages "Structure of Anisotropic BSDF Files" and "Structure of BRDF files", and from
the vendor's open converter (ansys/optical-automation, ``BSDF_converter.py``) for what these leave open: the
order of the tables, and azimuth 0 as that of the specular or undeviated direction.
"""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from jaxink.measurement.formats.chosen import chosen_rotation
from jaxink.measurement.formats.content import Content, Words
from jaxink.measurement.formats.exchange_options import ExchangeOptions, ask
from jaxink.measurement.formats.own_files import origin, refuse_other_media
from jaxink.measurement.formats.points import (
    TOTAL_TOLERANCE,
    FilePoints,
    joined,
    one_wavelength,
    without_cosine,
)
from jaxink.measurement.formats.polar_tables import distinct, lone_values, total

_HEADER = re.compile(r"\s*OPTIS - (Anisotropic BSDF|brdf) surface file v(\d+)\.\d+", re.IGNORECASE)
_VERSIONS = (7, 8)
_DESCRIPTION_ROW = 5
# A spectrum within this band is one wavelength.
_BAND_NM = 2.0
# The totals of measured files are uncertain, but not by more.
_LARGEST_PERCENTAGE = 150.0
# A total below is none.
_SMALLEST = 1e-100
_OWN_SIDE = re.compile(r"^light from side ([IA])\b")


@dataclass(frozen=True)
class _Table:
    """Values of one incidence by polar angle and azimuth, as in the file."""

    theta_i_deg: float
    rotation_deg: float
    is_transmission: bool
    theta_deg: Float[np.ndarray, " theta"]
    phi_deg: Float[np.ndarray, " phi"]
    values: Float[np.ndarray, "theta phi"]
    rows: Int[np.ndarray, "theta phi"]
    columns: Int[np.ndarray, "theta phi"]

    def power(self, is_intensity: bool) -> float:
        """Integral of the values over the projected solid angle."""
        cosine = np.abs(np.cos(np.deg2rad(self.theta_deg)))[:, None]
        horizon = cosine < 1e-9
        bsdf = (
            np.where(horizon, 0, self.values / np.where(horizon, 1, cosine)) if is_intensity else self.values
        )
        polar = 180 - self.theta_deg[::-1] if self.is_transmission else self.theta_deg
        return total(polar, self.phi_deg, bsdf[::-1] if self.is_transmission else bsdf)


@dataclass(frozen=True)
class _Start:
    """What both kinds of files begin with."""

    kinds: tuple[bool, ...]
    is_intensity: bool


def recognises_anisotropic(head: str) -> bool:
    """Whether a file starts as an ``.anisotropicbsdf`` file."""
    found = _HEADER.match(head)
    return found is not None and found[1].lower() != "brdf"


def recognises_brdf(head: str) -> bool:
    """Whether a file starts as a ``.brdf`` file of Speos."""
    found = _HEADER.match(head)
    return found is not None and found[1].lower() == "brdf"


def read_anisotropic(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points of an ``.anisotropicbsdf`` file at one wavelength."""
    words = _below_description(content)
    words.numbers(3, "the anisotropy vector")
    start = _start(content, words, choices)
    axes = [_incidences(words) for _ in start.kinds]
    spectra = [_spectrum(content, words) for _ in start.kinds]
    wavelength = _wavelength(content, spectra, choices, notes)
    parts = []
    for is_transmission, incidences, spectrum in zip(start.kinds, axes, spectra, strict=True):
        tables = [
            _table(content, words, theta_i, rotation, is_transmission)
            for rotation, angles in incidences
            for theta_i in angles
        ]
        factor = _factor(content, tables, spectrum, wavelength, start.is_intensity, notes)
        tables = _of_one_rotation(content, tables, choices)
        parts += [_points(table, wavelength, factor) for table in tables]
    _end(content, words)
    return _measured(content, parts, start, choices, notes)


def read_brdf(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points of a ``.brdf`` file at all of its wavelengths."""
    words = _below_description(content)
    start = _start(content, words, choices)
    n_angles = words.count("the number of incidences")
    n_wavelengths = words.count("the number of wavelengths")
    angles, _ = words.numbers(n_angles, "the incidences")
    wavelengths, _ = words.numbers(n_wavelengths, "the wavelengths")
    parts, factors = [], list[float]()
    for is_transmission in start.kinds:
        for theta_i in angles.tolist():
            for wavelength in wavelengths.tolist():
                row, percentage = words.row, words.number("the percentage of a table")
                _require_percentages(content, np.array([percentage]), np.array([row]))
                table = _table(content, words, theta_i, 0.0, is_transmission)
                factors.append(_needed_factor(content, table, start.is_intensity, percentage / 100))
                parts.append(_points(table, wavelength, factors[-1]))
    _end(content, words)
    if scaled := [factor for factor in factors if factor != 1]:
        notes.append(
            f"The values of {len(scaled)} tables were scaled, by {min(scaled):.4g} to {max(scaled):.4g}, to "
            "the percentages that the file states: Speos defines its values by these."
        )
    points = _measured(content, parts, start, choices, notes)
    return one_wavelength(points, content.source, choices.wavelength_nm, notes)


def _below_description(content: Content) -> Words:
    """The words below the description, after the checks of the first rows."""
    lines = content.lines
    found = _HEADER.match(lines[0])
    if found is None or int(found[2][:6]) not in _VERSIONS:
        versions = " and ".join(f"{version}.0" for version in _VERSIONS)
        raise content.refusal(f"only versions {versions} of the format are known; save it anew with Speos", 1)
    if len(lines) < _DESCRIPTION_ROW:
        raise content.refusal("the file ends within its header; it is incomplete", len(lines))
    if lines[1].strip() != "0":
        raise content.refusal("is not in text mode (0); save it as text with the viewer of Speos", 2)
    stated = lines[3].strip()
    if not (stated.isascii() and stated.isdigit() and len(stated) < 9):
        raise content.refusal("the length of the description must be a whole number", 4)
    # Windows counts two characters for the end of a line within the description.
    for end_of_line in (1, 2):
        row = _description_end(lines, int(stated), end_of_line)
        if row is not None:
            return Words(content, row + 1)
    raise content.refusal(f"the description does not have {int(stated)} characters, as row 4 states", 5)


def _description_end(lines: list[str], length: int, end_of_line: int) -> int | None:
    """Number of the last row of the description, if a row ends where it does."""
    row = _DESCRIPTION_ROW
    left = length - len(lines[row - 1])
    while left > 0 and row < len(lines):
        left -= end_of_line + len(lines[row])
        row += 1
    return row if left == 0 else None


def _start(content: Content, words: Words, choices: ExchangeOptions) -> _Start:
    present = [_flag(content, words, f"whether there is {what}") for what in ("reflection", "transmission")]
    kinds = tuple(kind for kind, here in zip((False, True), present, strict=True) if here)
    if not kinds:
        raise content.refusal("the file states that it has neither reflection nor transmission", words.row)
    row, is_bsdf = words.row, _flag(content, words, "the kind of values (1 BSDF, 0 intensity)")
    if choices.cosine_weighted is not None and choices.cosine_weighted == is_bsdf:
        kind = "BSDFs (1)" if is_bsdf else "intensities (0), with the cosine"
        text = (
            f"the file states that its values are {kind}, but the caller gives cosine_weighted="
            f"{choices.cosine_weighted}; leave it out, or correct the row if it is wrong"
        )
        raise content.refusal(text, row)
    return _Start(kinds, not is_bsdf)


def _flag(content: Content, words: Words, what: str) -> bool:
    row, word = words.row, words.word(what)
    if word not in ("0", "1"):
        raise content.refusal(f"{what} must be 0 or 1", row)
    return word == "1"


def _incidences(words: Words) -> list[tuple[float, list[float]]]:
    """Anisotropy angles with the incidences of each."""
    rotations, _ = words.numbers(words.count("the number of anisotropy angles"), "the anisotropy angles")
    return [
        (rotation, words.numbers(words.count("the number of incidences"), "the incidences")[0].tolist())
        for rotation in rotations.tolist()
    ]


@dataclass(frozen=True)
class _Spectrum:
    """Total over incident power at the wavelengths, for light at the reference incidence."""

    theta_i_deg: float
    wavelength_nm: Float[np.ndarray, " wavelengths"]
    total: Float[np.ndarray, " wavelengths"]


def _spectrum(content: Content, words: Words) -> _Spectrum:
    row = words.row
    angles, _ = words.numbers(2, "the reference incidence")
    # A comment, which may be empty, follows.
    words.go_to(row + 2)
    n = words.count("the number of wavelengths of the spectrum")
    cells, rows = words.numbers(2 * n, "the spectrum")
    cells, rows = cells.reshape(n, 2), rows.reshape(n, 2)
    if (np.diff(cells[:, 0]) <= 0).any():
        raise content.refusal("the wavelengths of the spectrum must ascend", row)
    _require_percentages(content, cells[:, 1], rows[:, 1])
    return _Spectrum(float(angles[0]), cells[:, 0], cells[:, 1] / 100)


def _require_percentages(content: Content, values: np.ndarray, rows: np.ndarray) -> None:
    bad = np.flatnonzero((values < 0) | (values > _LARGEST_PERCENTAGE))
    if bad.size:
        text = f"{values[bad[0]]:g} % of the incident light cannot leave the sample; correct the percentage"
        raise content.refusal(text, int(rows[bad[0]]))


def _wavelength(
    content: Content, spectra: list[_Spectrum], choices: ExchangeOptions, notes: list[str]
) -> float:
    low = max(float(spectrum.wavelength_nm[0]) for spectrum in spectra)
    high = min(float(spectrum.wavelength_nm[-1]) for spectrum in spectra)
    if high < low:
        raise content.refusal("the spectra of reflection and transmission have no wavelength in common")
    given = choices.wavelength_nm
    if given is None and high - low > _BAND_NM:
        why = (
            f"the values hold for the whole spectrum, {low:g} to {high:g} nm, of which one wavelength is read"
        )
        raise ask(content.source, "wavelength_nm", why)
    if given is None:
        notes.append(f"The wavelength is {(low + high) / 2:g} nm, the middle of the spectrum.")
        return (low + high) / 2
    if not low <= given <= high:
        raise content.refusal(
            f"wavelength_nm is {given:g}; the spectrum of the file is {low:g} to {high:g} nm"
        )
    return given


def _factor(
    content: Content, tables, spectrum: _Spectrum, wavelength_nm: float, is_intensity, notes
) -> float:
    """Factor that gives the table at the reference incidence the total of the spectrum."""
    stated = float(np.interp(wavelength_nm, spectrum.wavelength_nm, spectrum.total))
    reference = min(tables, key=lambda table: abs(table.theta_i_deg - spectrum.theta_i_deg))
    kind = "transmission" if reference.is_transmission else "reflection"
    factor = _needed_factor(content, reference, is_intensity, stated)
    if not reference.power(is_intensity) > _SMALLEST or stated <= 0:
        text = f"the {kind} at the reference incidence is zero, so its values have no scale"
        raise content.refusal(text, int(reference.rows[0, 0]))
    if factor == 1:
        return factor
    notes.append(
        f"The values of the {kind} were scaled by {factor:.4g} to the {100 * stated:.4g} % that the "
        f"file states for light at {reference.theta_i_deg:g} degrees: Speos defines its values by that."
    )
    return factor


def _needed_factor(content: Content, table: _Table, is_intensity: bool, stated: float) -> float:
    """Factor that gives values their stated total; 1 if they have it within the errors of integration."""
    found = table.power(is_intensity)
    if abs(found - stated) <= TOTAL_TOLERANCE * stated:
        return 1.0
    for place in lone_values(table.values)[:1]:
        text = (
            f"{table.values.flat[place]:g} is more than all other values of the table together, whose scale "
            "would depend on it alone; correct it, or give the table angles that resolve its peak"
        )
        raise content.refusal(text, int(table.rows.flat[place]), int(table.columns.flat[place]))
    return stated / found if found > _SMALLEST else 1.0


def _table(content: Content, words: Words, theta_i: float, rotation: float, is_transmission: bool) -> _Table:
    row = words.row
    n_theta = words.count("the number of polar angles of a table")
    n_phi = words.count("the number of azimuths of a table")
    phi, _ = words.numbers(n_phi, "the azimuths of a table")
    cells, rows = words.numbers(n_theta * (n_phi + 1), "a table of values")
    columns = words.last_columns(cells.size)
    cells, rows, columns = (each.reshape(n_theta, n_phi + 1) for each in (cells, rows, columns))
    theta = cells[:, 0]
    low, high = (90, 180) if is_transmission else (0, 90)
    ascend = (np.diff(theta) > 0).all() and (np.diff(phi) > 0).all()
    if theta.min() < low or theta.max() > high or not ascend or phi[-1] - phi[0] > 360 + 1e-6:
        kind = "transmission" if is_transmission else "reflection"
        text = (
            f"polar angles of {kind} must ascend between {low} and {high} degrees, and azimuths within a turn"
        )
        raise content.refusal(
            f"{text}; the table may not have the {n_theta} x {n_phi} values that it counts", row
        )
    below = cells[:, 1:], rows[:, 1:], columns[:, 1:]
    return _Table(theta_i, rotation, is_transmission, theta, phi, *below)


def _of_one_rotation(content: Content, tables: list[_Table], choices: ExchangeOptions) -> list[_Table]:
    angles = sorted({table.rotation_deg for table in tables})
    rotation = angles[chosen_rotation(content, choices, angles, "the anisotropy angles are {}")]
    return [table for table in tables if table.rotation_deg == rotation]


def _points(table: _Table, wavelength_nm: float, factor: float) -> FilePoints:
    theta = 180 - table.theta_deg if table.is_transmission else table.theta_deg
    values, keep = distinct(theta, table.phi_deg, table.values)
    polar, azimuth = np.broadcast_arrays(theta[:, None], table.phi_deg + 180)
    n = int(keep.sum())
    return FilePoints(
        theta_i_deg=np.full(n, table.theta_i_deg),
        theta_o_deg=polar[keep],
        phi_deg=azimuth[keep],
        wavelength_nm=np.full(n, wavelength_nm),
        is_transmission=np.full(n, table.is_transmission),
        bsdf_per_sr=factor * values[keep],
        row=table.rows[keep],
    )


def _end(content: Content, words: Words) -> None:
    if words.is_over():
        raise content.refusal(
            "the file ends without the line 'End of file'; it is incomplete", len(content.lines)
        )
    if words.word("End of file").lower() != "end":
        raise content.refusal(
            "values follow the last table; the numbers in the header do not agree", words.row
        )
    for _ in range(2):
        words.word("End of file")
    words.require_over("'End of file'")


def _measured(
    content: Content, parts: list[FilePoints], start: _Start, choices: ExchangeOptions, notes
) -> FilePoints:
    own, sides = origin(content.lines[:100]), (_OWN_SIDE.match(line.strip()) for line in content.lines[:100])
    side = next((found[1] for found in sides if found), None)
    for is_transmission in start.kinds if side else ():
        there = "A" if side == "I" else "I"
        if choices.side in (None, "RT"[is_transmission]):
            refuse_other_media(content, own, f"T_{side}{there}" if is_transmission else f"R_{side}{side}")
    points = joined(parts)
    notes.append(
        "Speos: azimuths were turned by 180 degrees, because azimuth 0 is that of the specular or undeviated "
        "direction there; polar angles of transmission, 90 to 180 degrees, were turned to the other normal."
    )
    if not start.is_intensity:
        return points
    notes.append("The file states that its values are intensities; they were divided by cos(theta_o).")
    return without_cosine(points, notes)
