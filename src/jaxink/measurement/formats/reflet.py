"""Text files of Light Tec's goniometer REFLET.

Known only from a converter that the makers of Speos publish (ansys/optical-automation,
``example_convert_REFLET_data.py``): a line with the step of the azimuth, a line ``Theta Lighting``, then rows
of a signed polar angle with the values at azimuths from -90 to 90 degrees. What the converter takes from
elsewhere, or rescales, has to be stated: incidence, side, wavelength, azimuth of the specular direction,
scale, and whether the values hold the cosine.
"""

import re

import numpy as np

from jaxink.measurement.formats.content import Content
from jaxink.measurement.formats.exchange_options import ExchangeOptions, required
from jaxink.measurement.formats.points import FilePoints, divided_as_requested

_STEP = re.compile(r"Phi measure step\s*:\s*(\S+)")
_LIGHTING = re.compile(r"Theta Lighting(?:\s*:\s*([-+0-9.eE]+)\s*$)?")
_SMALLEST_STEP_DEG = 0.01
_ASKED = {
    "side": "the file does not state whether it is reflection or transmission",
    "wavelength_nm": "the file states no wavelength",
    "specular_phi_deg": "the file does not state at which azimuth, at positive polar angles, the specular or "
    "undeviated direction is",
    "scale": "the file does not state the factor that makes its values BSDFs in 1/sr, or intensities",
    "cosine_weighted": "the file does not state whether its values are the BSDF or that times cos(theta_o)",
}


def recognises(head: str) -> bool:
    """Whether a file starts as one of REFLET."""
    return "Phi measure step" in head and "Theta Lighting" in head


def read(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points of one incidence."""
    step, theta_i, first = _header(content, choices)
    stated = {name: required(content.source, choices, name, why) for name, why in _ASKED.items()}
    phi = np.arange(round(180 / step) + 1) * step - 90
    theta, values, rows = _rows(content, first, phi.size)
    notes += content.unfinished_note()
    polar, azimuth = np.broadcast_arrays(theta[:, None], phi)
    # A negative polar angle is the other half-plane; the specular direction is at azimuth 180.
    turned = azimuth - stated["specular_phi_deg"] + np.where(polar < 0, 0.0, 180.0)
    n = values.size
    notes.append(
        "REFLET: signed polar angles were made directions; incidence, side, wavelength, specular azimuth, "
        f"scale ({stated['scale']:g}) and cosine are as stated by the caller."
    )
    points = FilePoints(
        theta_i_deg=np.full(n, theta_i),
        theta_o_deg=np.abs(polar).ravel(),
        phi_deg=turned.ravel(),
        wavelength_nm=np.full(n, stated["wavelength_nm"]),
        is_transmission=np.full(n, stated["side"] == "T"),
        bsdf_per_sr=stated["scale"] * values.ravel(),
        row=np.repeat(rows, phi.size),
    )
    return divided_as_requested(points, notes) if stated["cosine_weighted"] else points


def _header(content: Content, choices: ExchangeOptions) -> tuple[float, float, int]:
    """Step of the azimuth, angle of incidence, and position of the first line of values."""
    step = theta_i = None
    first = len(content.lines)
    for number, line in enumerate(content.lines):
        if (found := _STEP.search(line)) is not None:
            step = _number(content, found[1], "the header", number + 1)
        elif (found := _LIGHTING.search(line)) is not None:
            theta_i = None if found[1] is None else _number(content, found[1], "the header", number + 1)
            first = number + 1
            break
    if step is None or first == len(content.lines):
        raise content.refusal("has no values below its header, or no step of the azimuth; it is incomplete")
    if not _SMALLEST_STEP_DEG <= step <= 180 or abs(180 / step - round(180 / step)) > 1e-6:
        raise content.refusal(f"the step of the azimuth is {step:g} degrees, which does not divide 180")
    given = choices.theta_i_deg
    if theta_i is None:
        why = "the file states no angle of incidence"
        return step, required(content.source, choices, "theta_i_deg", why), first
    if given is not None and abs(theta_i - given) > 1e-6:
        text = f"the file states an incidence of {theta_i:g} degrees, but the caller {given:g}; remove one"
        raise content.refusal(text, first)
    return step, theta_i, first


def _rows(content: Content, first: int, n_values: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    theta, values, rows = [], [], []
    for row, line in enumerate(content.lines[first:], first + 1):
        words = line.split()
        if not words:
            continue
        if len(words) != n_values + 1:
            text = f"has {len(words)} numbers; a polar angle and {n_values} values are expected"
            raise content.refusal(text, row)
        content.require_numbers(words, "a row of values", [row] * len(words))
        cells = [float(word) for word in words]
        theta.append(cells[0])
        values.append(cells[1:])
        rows.append(row)
    if not rows:
        raise content.refusal("has a header but no row of values")
    return np.array(theta), np.array(values), np.array(rows)


def _number(content: Content, word: str, what: str, row: int) -> float:
    content.require_numbers([word], what, [row])
    return float(word)
