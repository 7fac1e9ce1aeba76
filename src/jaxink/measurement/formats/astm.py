"""Text files in the layout of ASTM E1392.

Known from the open reader of libbsdf and from the files that Cornell University publishes in this layout
(``KEY value`` lines, ``VARS`` with the names of the columns, then rows separated by commas). The standard's
own text is not public; its definitions are used as ASTM E2387 and the literature quote them.
"""

import csv
import re

import numpy as np

from jaxink.measurement.formats.content import Content
from jaxink.measurement.formats.exchange_options import ExchangeOptions, ask
from jaxink.measurement.formats.points import FilePoints, divided_as_requested, joined

_VARS = re.compile(r"^[ \t]*VARS[ \t]+\S", re.MULTILINE)
_ANGLES = ("theta_i", "phi_i", "theta_s", "phi_s")
_NANOMETRES = re.compile(r"(\d+(?:\.\d*)?)\s*nm", re.IGNORECASE)
# Longer lists of columns are spectra of a thousand wavelengths.
_MOST_COLUMNS = 2000


def recognises(head: str) -> bool:
    """Whether a file starts as one of ASTM E1392: the line ``VARS`` names the columns."""
    found = _VARS.search(head)
    return found is not None and "theta_i" in head[found.start() :].partition("\n")[0].lower()


def read(content: Content, choices: ExchangeOptions, notes: list[str]) -> FilePoints:
    """The points of all wavelengths, or of the channel that the caller names."""
    position = next((i for i, line in enumerate(content.lines) if _VARS.match(line)), None)
    if position is None:
        raise content.refusal("has no line VARS that names the columns")
    row = position + 1
    names = [name.strip() for name in content.lines[position].strip()[4:].split(",")]
    if len(names) > _MOST_COLUMNS:
        raise content.refusal(f"names {len(names)} columns; at most {_MOST_COLUMNS} are allowed", row)
    known = {name.lower(): index for index, name in enumerate(names) if name}
    for name in _ANGLES:
        if name not in known:
            text = f"VARS does not name {name}; it must name {', '.join(_ANGLES)} and the values"
            raise content.refusal(text, row)
    values, rows = _rows(content, position, len(names))
    _compare_count(content, position, len(rows))
    notes += content.unfinished_note()
    degrees = _in_degrees(content, np.stack([values[:, known[name]] for name in _ANGLES]), choices)
    columns = _value_columns(content, names, choices, row, notes)
    points = joined([_points(degrees, values[:, index], rows, nm) for index, nm in columns])
    if not (points.theta_o_deg > 90).any():
        points = _on_stated_side(content, points, choices)
    else:
        points = _beyond_horizon(points, notes)
    notes.append("ASTM: the azimuth is phi_s minus phi_i, the azimuth towards the source.")
    return divided_as_requested(points, notes) if choices.cosine_weighted else points


def _rows(content: Content, position: int, n_columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Values of the rows below the names, and their row numbers."""
    held, rows = [], []
    for number, line in enumerate(content.lines[position + 1 :], position + 2):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        cells = next(csv.reader([line]), [])
        if len(cells) > n_columns and not any(cell.strip() for cell in cells[n_columns:]):
            cells = cells[:n_columns]
        if len(cells) != n_columns:
            text = f"has {len(cells)} values, but VARS names {n_columns} columns"
            raise content.refusal(text, number)
        content.require_numbers(cells, "a row of values", [number] * len(cells))
        held.append([float(cell) for cell in cells])
        rows.append(number)
    if not held:
        raise content.refusal("has no row of values below VARS", position + 1)
    return np.array(held), np.array(rows)


def _compare_count(content: Content, position: int, found: int) -> None:
    for number, line in enumerate(content.lines[:position], 1):
        key, _, text = line.strip().partition(" ")
        if key != "NUM_POINTS":
            continue
        text = text.strip()
        if not (text.isascii() and text.isdigit() and len(text) < 12):
            raise content.refusal("NUM_POINTS must be a whole number", number)
        if int(text) != found:
            raise content.refusal(
                f"NUM_POINTS is {int(text)}, but {found} rows follow; the file is "
                f"{'incomplete' if found < int(text) else 'not the one that was counted'}",
                number,
            )


def _in_degrees(content: Content, angles: np.ndarray, choices: ExchangeOptions) -> np.ndarray:
    largest = float(np.abs(angles).max())
    if choices.angle_unit is None and largest <= 2 * np.pi + 1e-6:
        why = f"no angle exceeds {largest:.4g}, so the angles are in radians, or all are within a few degrees"
        raise ask(content.source, "angle_unit", why)
    if choices.angle_unit == "rad":
        if largest > 2 * np.pi + 1e-6:
            raise content.refusal(f"angle_unit is rad, but an angle is {largest:.4g}, beyond a full circle")
        return np.rad2deg(angles)
    return angles


def _value_columns(content: Content, names: list[str], choices: ExchangeOptions, row: int, notes: list[str]):
    """Index and wavelength of each column to read."""
    others = {name: i for i, name in enumerate(names) if name.lower() not in _ANGLES and name}
    if not others:
        raise content.refusal("VARS names no column of values", row)
    spectral = {name: float(found[1]) for name in others if (found := _NANOMETRES.fullmatch(name))}
    if len(spectral) == len(others):
        if choices.channel is not None:
            raise content.refusal("the columns are wavelengths, not channels; leave out the channel")
        if choices.wavelength_nm is None:
            return [(others[name], nm) for name, nm in spectral.items()]
        chosen = [
            (others[name], nm) for name, nm in spectral.items() if abs(nm - choices.wavelength_nm) < 1e-6
        ]
        if not chosen:
            listed = ", ".join(spectral)
            raise content.refusal(f"wavelength_nm is {choices.wavelength_nm:g}; the file has {listed}")
        return chosen
    listed = ", ".join(others)
    if choices.channel is None and len(others) > 1:
        raise ask(
            content.source, "channel", f"the values are the channels {listed}, of which one is read", row
        )
    name = next(iter(others)) if choices.channel is None else choices.channel
    if name not in others:
        raise content.refusal(f"channel is {name!r}; the file has {listed}")
    if choices.wavelength_nm is None:
        raise ask(content.source, "wavelength_nm", f"the column {name} states no wavelength", row)
    notes.append(
        f"Column {name} is read as the BSDF at {choices.wavelength_nm:g} nm, as stated by the caller."
    )
    return [(others[name], choices.wavelength_nm)]


def _points(degrees: np.ndarray, values: np.ndarray, rows: np.ndarray, wavelength_nm: float) -> FilePoints:
    theta_i, phi_i, theta_s, phi_s = degrees
    # A negative polar angle is the other half-plane.
    turned = theta_s < 0
    return FilePoints(
        theta_i_deg=theta_i,
        theta_o_deg=np.abs(theta_s),
        phi_deg=phi_s - phi_i + 180.0 * turned,
        wavelength_nm=np.full(values.size, wavelength_nm),
        is_transmission=np.zeros(values.size, bool),
        bsdf_per_sr=values,
        row=rows,
    )


def _beyond_horizon(points: FilePoints, notes: list[str]) -> FilePoints:
    """Reflection to 90 degrees, transmission beyond."""
    through = points.theta_o_deg > 90
    notes.append("Rows with theta_s beyond 90 degrees are transmission, measured from the other normal.")
    theta = np.where(through, 180 - points.theta_o_deg, points.theta_o_deg)
    arrays = vars(points) | {"theta_o_deg": theta, "is_transmission": through}
    return FilePoints(**arrays)


def _on_stated_side(content: Content, points: FilePoints, choices: ExchangeOptions) -> FilePoints:
    if choices.side is None:
        why = "no theta_s exceeds 90 degrees, so the rows can be reflection or transmission"
        raise ask(content.source, "side", why)
    return FilePoints(**(vars(points) | {"is_transmission": np.full(points.row.size, choices.side == "T")}))
