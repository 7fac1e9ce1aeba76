"""Readings from a file of the inverse adding-doubling program, `iad` (.rxt)."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from jaxink.files.reading import read_bounded
from jaxink.measurement.readings import IDEAL_SPHERE, Readings, Spheres
from jaxink.measurement.table import refusal
from jaxink.measurement.text_file import lines_of

MAGIC = "IAD1"
_MOST_BYTES = 50_000_000
_SPHERE = ("diameter", "sample port", "third port", "detector port", "wall reflectance")
# The numbers of the header, in its order.
_HEADER = (
    "index of the sample",
    "index of the slides",
    "thickness of the sample",
    "thickness of the slides",
    "diameter of the beam",
    "reflectance of the standard",
    "number of spheres",
    *(f"{name} of the {side} sphere" for side in ("reflection", "transmission") for name in _SPHERE),
)
# Columns of a file that states their number only; a wavelength may precede them.
_UNLABELLED = "rtuwWRT"
_READ = {"r": "R_total", "t": "T_total", "u": "T_collimated"}
_USED = "LiwWRT"
# Of these, jaxink's sample file and options say what they say.
_IGNORED = "aAbBdDeEFgnNq"


class _Number(NamedTuple):
    """A word of the file and its row."""

    text: str
    row: int


def read_adding_doubling(path: Path, wavelength_nm: float | None = None) -> Readings:
    """Read M_R, M_T and M_U of a file that begins with ``IAD1``.

    Parameters
    ----------
    path
        The file.
    wavelength_nm
        Wavelength of all readings, if the file does not state it.

    Returns
    -------
    Readings
        ``R_total``, ``T_total`` and ``T_collimated``, at normal incidence unless the file states another
        angle, with the single-beam spheres that its header describes.

    Raises
    ------
    InputRefusedError
        If the file is invalid, or two spheres were used at the same time; the message names file and row.

    References
    ----------
    Prahl, inverse adding-doubling, github.com/scottprahl/iad, src/iad_io.w (the header and the columns) and
    src/iad_calc.w (the gain of a sphere).
    """
    lines = lines_of(path, read_bounded(path, _MOST_BYTES, "file of readings"), [])
    words = _words([lines[0].removeprefix(MAGIC), *lines[1:]])
    header = [_number(path, next(words, None), name) for name in _HEADER]
    n_spheres = header[6]
    if n_spheres not in (0, 1):
        text = f"states {n_spheres:g} spheres; jaxink knows readings of one sphere at a time, 0 or 1"
        raise refusal(path, f"{text} (0: ideal)")
    labels, rest = _labels(path, list(words))
    rows = list(_rows(path, labels, rest))
    if not rows:
        raise refusal(path, "has a header but no rows of values")
    columns = {
        label: np.array([values.get(label, np.nan) for _, values in rows]) for label in (*_READ, *_USED)
    }
    wavelength = columns["L"]
    if np.isnan(wavelength).any():
        if wavelength_nm is None:
            row = rows[int(np.argmax(np.isnan(wavelength)))][0]
            text = "states no wavelength; state that of all readings as wavelength_nm"
            raise refusal(path, f"{text} (in a project: reading = {{ wavelength_nm = <nm> }})", row)
        wavelength = np.full(len(rows), float(wavelength_nm))
    elif wavelength_nm is not None:
        raise refusal(path, "states its wavelengths (column L); do not state another one as wavelength_nm")
    spheres = _spheres_of_rows(header, columns) if n_spheres == 1 else None
    # Row by row, as in the file.
    order = [(k, label) for k in range(len(rows)) for label in _READ if not np.isnan(columns[label][k])]
    of_row, quantity = np.array([k for k, _ in order]), np.array([_READ[label] for _, label in order])
    angle = np.where(np.isnan(columns["i"]), 0.0, columns["i"])[of_row]
    nowhere = np.full(len(order), np.nan)
    return Readings(
        quantity,
        angle,
        nowhere,
        nowhere,
        wavelength[of_row],
        np.array([columns[label][k] for k, label in order]),
        None,
        np.array([rows[k][0] for k, _ in order]),
        None if spheres is None else _of_readings(spheres, of_row, quantity),
        str(path),
        _notes(header, labels, spheres is None),
    )


def _words(lines: list[str]) -> Iterator[_Number]:
    for row, line in enumerate(lines, 1):
        for text in line.partition("#")[0].split():
            yield _Number(text, row)


def _number(path: Path, word: _Number | None, what: str) -> float:
    if word is None:
        raise refusal(path, f"ends before the {what}; the header has {len(_HEADER)} numbers")
    try:
        value = float(word.text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise refusal(path, f"'{word.text}' stands for the {what}; it must be a number", word.row)
    return value


def _labels(path: Path, words: list[_Number]) -> tuple[str, list[_Number]]:
    """Letters of the columns, and the words below them; with none, as ``?`` and the letters by number."""
    if not words:
        raise refusal(
            path, "ends after the header; a line with the letters of the columns follows, such as L r t"
        )
    first = words[0]
    if first.text in [*"1234567"]:
        return "?" + _UNLABELLED[: int(first.text)], words[1:]
    here = [word for word in words if word.row == first.row]
    labels = "".join(word.text for word in here)
    for label in labels:
        if label not in (*_READ, *_USED, *_IGNORED):
            text = f"has a column {label}, which jaxink does not read; remove it, or write the values as CSV"
            raise refusal(path, f"{text} (docs/manual/readings.md)", first.row)
    if not set(labels) & {*_READ}:
        raise refusal(path, f"has columns '{labels}'; at least one must be r, t or u", first.row)
    return labels, words[len(here) :]


def _rows(path: Path, labels: str, words: list[_Number]) -> Iterator[tuple[int, dict[str, float]]]:
    """Row of the file and values by letter."""
    each = iter(words)
    for word in each:
        value = _number(path, word, "value of a column")
        names = labels
        if labels[0] == "?":
            # What exceeds all light is a wavelength.
            names = ("L" if value > 1 else "") + labels[1:]
        values = {names[0]: value}
        for name in names[1:]:
            following = next(each, None)
            if following is None:
                text = f"has {len(values)} values; it must have {len(names)}, one for each column"
                raise refusal(path, text, word.row)
            values[name] = _number(path, following, f"value of column {name}")
        yield word.row, values


def _spheres_of_rows(header: list[float], columns: dict[str, np.ndarray]) -> dict[str, Spheres]:
    """Sphere of each row for reflectance and transmittance."""
    standard, (reflection, transmission) = header[5], (header[7:12], header[12:17])

    def column(label: str, otherwise) -> np.ndarray:
        return np.where(np.isnan(columns[label]), otherwise, columns[label])

    def sphere(numbers, wall, third, reference) -> Spheres:
        diameter, *ports = numbers[:4]
        sample, other, detector = ((port / (2 * diameter)) ** 2 for port in ports)
        # Ports beside that of the sample count as parts of the wall; that of the detector is black.
        mean = ((1 - sample - other - detector) * wall + other * third) / (1 - sample)
        return Spheres(mean, np.full(len(mean), sample), np.broadcast_to(reference, mean.shape).astype(float))

    wall = column("w", reflection[4])
    # Of the transmission sphere, the third port is closed by a standard, which is ideal unless stated.
    behind = column("W", column("w", transmission[4]))
    return {
        "R_total": sphere(reflection, wall, 0.0, column("R", standard)),
        "T_total": sphere(transmission, behind, column("T", 1.0), 0.0),
    }


def _of_readings(spheres: dict[str, Spheres], of_row: np.ndarray, quantity: np.ndarray) -> Spheres:
    names = spheres["R_total"].columns
    columns = {name: np.full(len(of_row), np.nan) for name in names}
    for kind, sphere in spheres.items():
        here = quantity == kind
        for name, values in sphere.columns.items():
            columns[name][here] = values[of_row[here]]
    return Spheres(**columns)


def _notes(header: list[float], labels: str, is_ideal: bool) -> tuple[str, ...]:
    sample, slides, thickness, of_slides = header[:4]
    notes = [
        f"The file has a sample of index {sample:g}, {thickness:g} mm thick, with slides of index "
        f"{slides:g}, {of_slides:g} mm thick; state them in the sample file."
    ]
    notes.append(
        IDEAL_SPHERE
        if is_ideal
        else "Readings are taken as those of a single beam, normalised to the standard in reflection."
    )
    if ignored := [label for label in labels if label in _IGNORED]:
        notes.append(f"Columns {', '.join(ignored)} are not used.")
    return tuple(notes)
