"""Files of measured surface heights, those of profilometers (x3p, sur) by the package surfalize."""

import csv
import io
import math
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Real

from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded, utf8_text
from jaxink.sample.entries import bounded
from jaxink.sample.schema import PITCH_UM

SUFFIXES = (".x3p", ".sur")
# A map of about 11 000 by 11 000 heights.
_MOST_BYTES = 1_000_000_000
# Files state distances with the digits of 32-bit numbers.
_SAME_PITCH = 1e-5


class MeasuredMap(NamedTuple):
    """Heights in um, nan where none was measured, and their distances in um along y (rows) and along x."""

    heights_um: Float[np.ndarray, "rows columns"]
    pitch_um: tuple[float, float]


def read_profilometer(content: bytes, path: str, suffix: str) -> MeasuredMap:
    """The surface in a file of a profilometer; it is not levelled here.

    Parameters
    ----------
    content
        Content of the file.
    path
        Its name, for messages.
    suffix
        One of `SUFFIXES`.

    Raises
    ------
    InputRefusedError
        If surfalize is not installed, or cannot read the file.
    """
    try:
        # Its import changes the filters of warnings; those are for the user to choose.
        with warnings.catch_warnings():
            from surfalize import Surface
    except ImportError:
        raise InputRefusedError(
            f"{path}: {suffix} files need the package surfalize, which is not installed; run "
            "`pip install 'jaxink[profilometer]'`."
        ) from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            surface = Surface.load(io.BytesIO(content), format=suffix)
            heights = np.array(surface.data, float)
            pitch = float(surface.step_y), float(surface.step_x)
    # A damaged file fails in any of the ways of zip, XML, struct and NumPy.
    except Exception as problem:
        why = " ".join(str(problem).split()).rstrip(".") or type(problem).__name__
        raise InputRefusedError(
            f"{path}: is not a {suffix} file of one surface that surfalize can read ({why})."
        ) from None
    if heights.ndim != 2 or not all(np.isfinite(p) and p > 0 for p in pitch):
        raise InputRefusedError(
            f"{path}: states the distances {pitch[0]:g} um along y and {pitch[1]:g} um along x; both must be "
            "above 0."
        )
    return MeasuredMap(heights, pitch)


def read_map(given: Any, pitch: Any, where: str, folder: Path) -> tuple[Real[np.ndarray, "..."], Any]:
    """Heights in um and the distances between them, of the entries ``heights_um`` and ``pitch_um``.

    Parameters
    ----------
    given, pitch
        The entries; the pitch may be None for a file of a profilometer, which states its own.
    where
        Key of the table that they are in, for messages.
    folder
        Folder of the file.

    Returns
    -------
    tuple
        See `read_heights` and `read_pitch`.

    Raises
    ------
    InputRefusedError
        If the file cannot be read, or states another pitch than the entry.
    """
    found = _read(given, f"{where}.heights_um", folder)
    where = f"{where}.pitch_um"
    if not isinstance(found, MeasuredMap):
        return found, read_pitch(pitch, where, found.ndim)
    if pitch is not None:
        stated = np.broadcast_to(read_pitch(pitch, where, 2), 2)
        if not np.allclose(stated, found.pitch_um, rtol=_SAME_PITCH, atol=0):
            own = ", ".join(f"{each:g}" for each in found.pitch_um)
            raise InputRefusedError(f"{where} is {pitch}, but {given} states [{own}]; leave it out.")
    return found.heights_um, found.pitch_um


def read_heights(given: Any, where: str, folder: Path) -> Real[np.ndarray, "..."]:
    """Heights in um of a file in the folder: two axes, or one for a profile; NaN for empty cells.

    ``given`` is the file name as in the sample file, ``where`` the key for messages.
    """
    found = _read(given, where, folder)
    return found.heights_um if isinstance(found, MeasuredMap) else found


def _read(given: Any, where: str, folder: Path) -> MeasuredMap | Real[np.ndarray, "..."]:
    if not isinstance(given, str):
        raise InputRefusedError(f"{where} is {given!r}; it must name a file of heights in um, {_either()}.")
    path = folder / given
    suffix, reader = path.suffix.lower(), _READERS.get(path.suffix)
    if reader is None and suffix not in SUFFIXES:
        raise InputRefusedError(f"{where} names {path}; its suffix must be {_either()}.")
    try:
        content = read_bounded(path, _MOST_BYTES, "file of heights")
        if reader is None:
            return read_profilometer(content, str(path), suffix)
        values = reader(content, str(path))
    except InputRefusedError as problem:
        raise InputRefusedError(f"{where} names {problem}") from None
    return values.ravel() if values.ndim == 2 and 1 in values.shape else values


def read_pitch(pitch: Any, where: str, n_axes: int) -> float | tuple[float, float]:
    """Distance between neighbouring heights in um: one number, or one along y and one along x."""
    each = pitch if isinstance(pitch, list) else [pitch]
    if len(each) not in (1, n_axes):
        raise InputRefusedError(
            f"{where} is {pitch}; give one number or, for a map, one along y and one along x."
        )
    first, *second = (bounded(p, PITCH_UM, where) for p in each)
    return (first, second[0]) if second else first


def _either() -> str:
    *first, last = *_READERS, *SUFFIXES
    return f"{', '.join(first)} or {last}"


def _npy_heights(content: bytes, path: str) -> Real[np.ndarray, "..."]:
    file = io.BytesIO(content)
    try:
        # NumPy warns about files written by Python 2 and about deprecated types.
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            version = np.lib.format.read_magic(file)
            readers = np.lib.format.read_array_header_1_0, np.lib.format.read_array_header_2_0
            shape, by_columns, dtype = readers[version[0] - 1](file)
    # The header is a Python expression, which can fail in all the ways of Python's parser.
    except (MemoryError, RecursionError):
        nested = "is not a readable .npy file: its header is nested too deeply"
        raise InputRefusedError(f"{path}: {nested}.") from None
    except Exception as problem:
        raise InputRefusedError(f"{path}: is not a readable .npy file ({problem}).") from None
    if dtype.kind not in "fiu" or len(shape) > 2 or min(shape, default=0) < 0:
        raise InputRefusedError(f"{path}: must contain an array of real numbers with one or two axes.")
    claimed, held = math.prod(shape) * dtype.itemsize, len(content) - file.tell()
    if claimed != held:
        raise InputRefusedError(
            f"{path}: an array of shape {shape} needs {claimed} bytes, but {held} follow the header; write "
            "the file again."
        )
    values = np.frombuffer(content, dtype, offset=file.tell())
    return values.reshape(shape, order="F" if by_columns else "C")


def _csv_heights(content: bytes, path: str) -> Float[np.ndarray, "rows columns"]:
    """Comma-separated heights without a header; empty cells are unknown heights."""
    rows: list[list[float]] = []
    reader = csv.reader(io.StringIO(utf8_text(content, path), newline=""))
    try:
        for number, cells in enumerate(reader, start=1):
            if not cells:
                continue
            if rows and len(cells) != len(rows[0]):
                raise InputRefusedError(
                    f"{path}, row {number}: has {len(cells)} cells, but the rows before have {len(rows[0])}; "
                    "all rows must have equally many."
                )
            rows.append([_cell(cell, f"{path}, row {number}", k + 1) for k, cell in enumerate(cells)])
    except csv.Error as problem:
        raise InputRefusedError(f"{path}, row {reader.line_num}: is not CSV text ({problem}).") from None
    if not rows:
        raise InputRefusedError(f"{path}: is empty; it must contain heights in um.")
    return np.array(rows)


def _cell(cell: str, where: str, column: int) -> float:
    try:
        return float(cell) if cell.strip() else math.nan
    except ValueError:
        raise InputRefusedError(
            f"{where}, column {column}: {cell!r} is not a number; the file must contain only heights in um, "
            "separated by commas, without a header."
        ) from None


_READERS = {".csv": _csv_heights, ".npy": _npy_heights}
