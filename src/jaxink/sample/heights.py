"""Files of measured surface heights."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.sample.entries import bounded

_SUFFIXES = (".csv", ".npy")


def read_heights(given: Any, where: str, folder: Path) -> Float[np.ndarray, "..."]:
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
    Float[np.ndarray, "..."]
        In um; not a number where a cell is empty.
    """
    if not isinstance(given, str):
        raise InputRefusedError(f"{where} is {given!r}; it must name a file of heights in um, {_either()}.")
    path = folder / given
    if not path.is_file():
        raise InputRefusedError(f"{where} names {path}, but there is no such file.")
    if path.suffix not in _SUFFIXES:
        raise InputRefusedError(
            f"{where} names {path}; its suffix must be {_either()}, which name the format."
        )
    try:
        values = _csv_heights(path, where) if path.suffix == ".csv" else np.load(path, allow_pickle=False)
    except InputRefusedError:
        raise
    except (OSError, ValueError, EOFError, csv.Error) as problem:
        raise InputRefusedError(f"{where}: {path} cannot be read ({problem}).") from None
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu":
        raise InputRefusedError(f"{where}: {path} must hold one array of real numbers.")
    return values.ravel() if values.ndim == 2 and 1 in values.shape else values


def read_pitch(pitch: Any, where: str, n_axes: int) -> float | tuple[float, ...]:
    """Distance of neighbouring heights in um: one, or one along y and one along x.

    Parameters
    ----------
    pitch
        As written.
    where
        Key, for messages.
    n_axes
        Of the heights.

    Returns
    -------
    float or tuple[float, ...]
    """
    each = pitch if isinstance(pitch, list) else [pitch]
    if len(each) not in (1, n_axes):
        raise InputRefusedError(
            f"{where} is {pitch}; give one number, or one along y and one along x for a map."
        )
    each = [bounded(p, 1e-6, 1e6, where, "um") for p in each]
    return each[0] if len(each) == 1 else tuple(each)


def _either() -> str:
    return " or ".join(_SUFFIXES)


def _csv_heights(path: Path, where: str) -> Float[np.ndarray, "rows columns"]:
    """Comma-separated heights without a head; an empty cell is a height that is not known."""
    rows: list[list[float]] = []
    with path.open(encoding="utf-8", newline="") as file:
        for number, cells in enumerate(csv.reader(file), start=1):
            if not cells:
                continue
            if rows and len(cells) != len(rows[0]):
                raise InputRefusedError(
                    f"{where}: {path}, row {number} has {len(cells)} cells, but those before "
                    f"have {len(rows[0])}; every row needs as many."
                )
            rows.append(
                [_cell(cell, f"{where}: {path}, row {number}", k + 1) for k, cell in enumerate(cells)]
            )
    if not rows:
        raise InputRefusedError(f"{where}: {path} is empty.")
    return np.array(rows)


def _cell(cell: str, where: str, column: int) -> float:
    try:
        return float(cell) if cell.strip() else math.nan
    except ValueError:
        raise InputRefusedError(
            f"{where}, column {column}: {cell!r} is no number; the file holds heights in um only, separated "
            "by commas, without a head."
        ) from None
