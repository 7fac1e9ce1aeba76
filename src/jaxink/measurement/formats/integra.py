"""Scattered light in BSDF files of Integra's programs (Lumicept): DDR of reflection, DDT of transmission.

Known from the open reader and writer of libbsdf (DdrReader, DdrWriter).
"""

import numpy as np
from jaxtyping import Float, Int

from jaxink.measurement.formats.chosen import chosen_rotation
from jaxink.measurement.formats.content import Content, Words
from jaxink.measurement.formats.exchange_options import ExchangeOptions, ask
from jaxink.measurement.formats.integra_text import (
    COMMENT,
    Header,
    channels,
    expect,
    is_integra,
    is_scattered,
    is_transmission,
    own_origin,
    read_header,
    wanted_channel,
)
from jaxink.measurement.formats.own_files import refuse_other_media
from jaxink.measurement.formats.points import FilePoints, joined, one_wavelength, without_cosine
from jaxink.measurement.formats.polar_tables import (
    lone_values,
    points_about_specular,
    total,
)

_REQUIRED = ("TypeSym", "TypeColorModel", "TypeData", "sigma", "phi", "theta")
# A total below is none.
_SMALLEST = 1e-100
# Largest total of a relative table, which measurements exceed 1 by.
_LARGEST_TOTAL = 1.5
_AROUND_DEG = np.linspace(0, 360, 73)


def recognises(head: str) -> bool:
    """Whether a file starts as a DDR or DDT file."""
    return is_integra(head) and is_scattered(head)


def read(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points above the horizon."""
    words = Words(content, comment=COMMENT)
    header = read_header(content, words, _REQUIRED)
    own, component = own_origin(content)
    if component is not None:
        refuse_other_media(content, own, component)
    through = is_transmission(content, choices.side, component, "dd")
    channel = wanted_channel(content, header, choices, notes)
    rotations = header.axes.get("psi", np.zeros(1)).tolist()
    rotation = chosen_rotation(content, choices, rotations, "the sample was rotated to {} degrees (psi)")
    parts = []
    for name, wavelength_nm in channels(content, words, header):
        tables = _tables(content, words, header)
        if channel in (None, name):
            nm = _wavelength(content, choices, wavelength_nm)
            parts += [
                points_about_specular(
                    _axis_deg(header, sigma),
                    header.axes["sigma"][sigma],
                    header.axes["theta"],
                    header.axes["phi"],
                    values,
                    rows,
                    nm,
                    through,
                )
                for psi, sigma, values, rows in tables
                if psi == rotation
            ]
    if np.isnan(wavelength_nm):
        notes.append(f"The wavelength, {choices.wavelength_nm:g} nm, was given by the caller.")
    notes += _notes(header)
    points = joined(parts)
    if not np.isnan(wavelength_nm):
        points = one_wavelength(points, content.source, choices.wavelength_nm, notes)
    below = points.theta_o_deg > 90
    if below.any():
        notes.append(f"{int(below.sum())} values below the horizon were left out.")
    points = points.at(~below)
    return without_cosine(points, notes) if _is_intensity(header) else points


def _notes(header: Header) -> list[str]:
    notes = [
        "Integra: scatter angles about the specular or undeviated direction were turned into angles from the "
        "normal."
    ]
    if _is_intensity(header):
        notes.append("The values are intensities, with the cosine, and were divided by cos(theta_o).")
    else:
        notes.append("The values are luminance factors and were divided by pi.")
    if _is_relative(header):
        notes.append("The values are relative and were scaled to the total kbdf of each incidence.")
    return notes


def _is_intensity(header: Header) -> bool:
    return header.words["typedata"].startswith("intensity")


def _is_relative(header: Header) -> bool:
    return header.words["typedata"].endswith("relative")


def _wavelength(content: Content, choices: ExchangeOptions, stated_nm: float) -> float:
    if not np.isnan(stated_nm):
        return stated_nm
    if choices.wavelength_nm is None:
        why = "the file has no wavelength, as its values are those of one channel or of colours"
        raise ask(content.source, "wavelength_nm", why)
    return choices.wavelength_nm


def _tables(content: Content, words: Words, header: Header):
    """Indices of rotation and incidence, BSDFs by theta and phi, with the cosine of intensities, and rows."""
    n_psi, n_sigma = header.axes.get("psi", np.zeros(1)).size, header.axes["sigma"].size
    shape = header.axes["phi"].size, header.axes["theta"].size
    stated = _stated_totals(content, words, header, n_psi * n_sigma)
    expect(content, words, "def")
    held = []
    for position, factor in enumerate(stated):
        values, rows = words.numbers(shape[0] * shape[1], "a table of values")
        values, rows = values.reshape(shape).T, rows.reshape(shape).T
        psi, sigma = divmod(position, n_sigma)
        held.append((psi, sigma, _bsdf(content, header, sigma, values, rows, factor), rows))
    expect(content, words, "enddef")
    return held


def _stated_totals(
    content: Content, words: Words, header: Header, n: int
) -> Float[np.ndarray, " incidences"]:
    """The numbers after kbdf, one for each rotation and incidence; 1 if there are none."""
    row = words.row
    if words.next == "kbdf":
        expect(content, words, "kbdf")
        stated, rows = words.numbers(n, "kbdf")
        if _is_relative(header):
            for wrong in np.flatnonzero((stated < 0) | (stated > _LARGEST_TOTAL))[:1]:
                text = f"kbdf is {stated[wrong]:g}; of relative values it is the scattered over the incident"
                raise content.refusal(f"{text} power, 0 to {_LARGEST_TOTAL:g}", int(rows[wrong]))
        return stated
    if _is_relative(header):
        raise content.refusal("kbdf is missing, without which relative values have no scale", row)
    return np.ones(n)


def _bsdf(
    content: Content,
    header: Header,
    sigma: int,
    values: Float[np.ndarray, "theta phi"],
    rows: Int[np.ndarray, "theta phi"],
    factor: float,
) -> Float[np.ndarray, "theta phi"]:
    """BSDF, times the cosine of intensities, of the values as they are in the file."""
    if not _is_relative(header):
        return values * factor / (1.0 if _is_intensity(header) else np.pi)
    found = _total(content, header, sigma, values)
    if found <= _SMALLEST:
        return values
    for place in lone_values(values)[:1]:
        text = (
            f"{values.flat[place]:g} is more than all other values of the table together, whose scale would "
            "depend on it alone; correct it, or give the table angles that resolve its peak"
        )
        raise content.refusal(text, int(rows.flat[place]))
    return values * factor / found


def _total(content: Content, header: Header, sigma: int, values: Float[np.ndarray, "theta phi"]) -> float:
    """Integral of the values over the side, of the whole circle around the specular direction."""
    phi, theta = header.axes["phi"], header.axes["theta"]
    span, is_mirrored = float(np.ptp(phi)), header.words["typesym"] == "planesymmetrical"
    if phi.size == 1 and header.words["typesym"] == "axisymmetrical":
        phi, values, span = _AROUND_DEG, np.repeat(values, _AROUND_DEG.size, axis=1), 360.0
    if abs(span - (180 if is_mirrored else 360)) > 1e-6:
        text = (
            f"phi spans {span:g} degrees, over which relative values have no total; it must span "
            f"{180 if is_mirrored else 360}"
        )
        raise content.refusal(text)
    found = total(theta, phi, values, _axis_deg(header, sigma), _is_intensity(header))
    return 2 * found if is_mirrored else found


def _axis_deg(header: Header, sigma: int) -> float:
    """Polar angle of the direction from which scatter angles are measured."""
    return float(header.axes.get("sigmat", header.axes["sigma"])[sigma])
