"""Files of measured surface heights."""

import csv
import io
import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Real

from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded, utf8_text
from jaxink.sample.entries import bounded
from jaxink.sample.schema import PITCH_UM

# A map of some 11 000 heights squared.
_MOST_BYTES = 1_000_000_000


def read_heights(given: Any, where: str, folder: Path) -> Real[np.ndarray, "..."]:
    """Heights of a file: two axes, or one for a profile.

    Parameters
    ----------
    given
        Name of the file, as written.
    where
        Key, for messages.
    folder
        Where it is looked for.

    Returns
    -------
    Real[np.ndarray, "..."]
        In um; not a number where a cell is empty.
    """
    if not isinstance(given, str):
        raise InputRefusedError(f"{where} is {given!r}; it must name a file of heights in um, {_either()}.")
    path = folder / given
    reader = _READERS.get(path.suffix)
    if reader is None:
        raise InputRefusedError(
            f"{where} names {path}; its suffix must be {_either()}, which name the format."
        )
    try:
        values = reader(read_bounded(path, _MOST_BYTES, "file of heights"), str(path))
    except InputRefusedError as problem:
        raise InputRefusedError(f"{where} names {problem}") from None
    return values.ravel() if values.ndim == 2 and 1 in values.shape else values


def read_pitch(pitch: Any, where: str, n_axes: int) -> float | tuple[float, float]:
    """Distance of neighbouring heights in um: one, or one along y and one along x.

    Parameters
    ----------
    pitch
        As written.
    where
        Key, for messages.
    n_axes
        Of the heights.
    """
    each = pitch if isinstance(pitch, list) else [pitch]
    if len(each) not in (1, n_axes):
        raise InputRefusedError(
            f"{where} is {pitch}; give one number, or one along y and one along x for a map."
        )
    first, *second = (bounded(p, PITCH_UM, where) for p in each)
    return (first, second[0]) if second else first


def _either() -> str:
    return " or ".join(_READERS)


def _npy_heights(content: bytes, path: str) -> Real[np.ndarray, "..."]:
    file = io.BytesIO(content)
    try:
        # NumPy warns of what Python 2 wrote, and of types that it will give up.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            version = np.lib.format.read_magic(file)
            readers = np.lib.format.read_array_header_1_0, np.lib.format.read_array_header_2_0
            shape, by_columns, dtype = readers[version[0] - 1](file)
    # The head is a piece of Python, which fails in all the ways that Python's parser does.
    except Exception as problem:
        raise InputRefusedError(f"{path}: is not a readable .npy file ({problem}).") from None
    if dtype.kind not in "fiu" or len(shape) > 2 or min(shape, default=0) < 0:
        raise InputRefusedError(f"{path}: must hold one array of real numbers, of one or two axes.")
    claimed, held = math.prod(shape) * dtype.itemsize, len(content) - file.tell()
    if claimed != held:
        raise InputRefusedError(
            f"{path}: an array of the shape {shape} takes {claimed} bytes, but {held} follow its head; write "
            "the file anew."
        )
    values = np.frombuffer(content, dtype, offset=file.tell())
    return values.reshape(shape, order="F" if by_columns else "C")


def _csv_heights(content: bytes, path: str) -> Float[np.ndarray, "rows columns"]:
    """Comma-separated heights without a head; an empty cell is a height that is not known."""
    rows: list[list[float]] = []
    reader = csv.reader(io.StringIO(utf8_text(content, path), newline=""))
    try:
        for number, cells in enumerate(reader, start=1):
            if not cells:
                continue
            if rows and len(cells) != len(rows[0]):
                raise InputRefusedError(
                    f"{path}, row {number} has {len(cells)} cells, but those before have {len(rows[0])}; "
                    "every row needs as many."
                )
            rows.append([_cell(cell, f"{path}, row {number}", k + 1) for k, cell in enumerate(cells)])
    except csv.Error as problem:
        raise InputRefusedError(f"{path}, row {reader.line_num}: is not CSV text ({problem}).") from None
    if not rows:
        raise InputRefusedError(f"{path}: is empty.")
    return np.array(rows)


def _cell(cell: str, where: str, column: int) -> float:
    try:
        return float(cell) if cell.strip() else math.nan
    except ValueError:
        raise InputRefusedError(
            f"{where}, column {column}: {cell!r} is no number; the file holds heights in um only, separated "
            "by commas, without a head."
        ) from None


_READERS = {".csv": _csv_heights, ".npy": _npy_heights}
