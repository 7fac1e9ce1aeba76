"""Which measurements a batch has: the files that match a pattern, or the rows of a table."""

import csv
import dataclasses
import io
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded, utf8_text
from jaxink.sample import Sample

FILE, NAME = "file", "name"
# Position of a measurement on its sample, for maps.
POSITION = ("x_mm", "y_mm")
# Separates the files of one measurement in a cell.
AND = "|"
_MOST_BYTES = 100_000_000
_UNSAFE = re.compile(r"[^\w.+-]+")
_LONGEST_NAME = 100


@dataclasses.dataclass(frozen=True)
class ListedMeasurement:
    """One measurement of a batch.

    Parameters
    ----------
    name
        Unique; names its folder and its row.
    files
        Its files, whose rows are joined.
    values
        Values of the sample for this measurement, by parameter.
    columns
        What else the table says of it.
    """

    name: str
    files: tuple[Path, ...]
    values: Mapping[str, float] = dataclasses.field(default_factory=dict)
    columns: Mapping[str, str | float] = dataclasses.field(default_factory=dict)


def listed_files(patterns: Any, folder: Path) -> tuple[ListedMeasurement, ...]:
    """One measurement for each file that matches a pattern, in the order of their paths.

    Parameters
    ----------
    patterns
        A pattern or a list of patterns; ``*`` stands for any characters, ``**`` for any folders.
    folder
        Where relative patterns begin.
    """
    patterns = [patterns] if isinstance(patterns, str) else patterns
    if not isinstance(patterns, list) or not all(isinstance(p, str) and p.strip() for p in patterns):
        raise InputRefusedError(f'measurements.files is {patterns!r}; write files = "sheets/*.csv".')
    found = dict.fromkeys(file for pattern in patterns for file in _matching(pattern, folder))
    if not found:
        raise InputRefusedError(
            f"measurements.files matches no file ({', '.join(patterns)} in {folder.resolve()}); write a "
            'pattern such as "sheets/*.csv".'
        )
    files = list(found)
    names = _safe_names([file.stem for file in files])
    if len(set(names)) < len(names):
        # Files with the same name are told apart by their suffixes and folders.
        shared = Path(*_shared_parts(files))
        names = _safe_names([str(file.relative_to(shared)).replace("/", "_") for file in files])
    _require_unique(names, "measurements.files")
    return tuple(ListedMeasurement(name, (file,)) for name, file in zip(names, files, strict=True))


def _matching(pattern: str, folder: Path) -> list[Path]:
    path = Path(pattern)
    base = Path(path.anchor) if path.is_absolute() else folder
    inside = str(path.relative_to(path.anchor)) if path.is_absolute() else pattern
    try:
        return sorted(file for file in base.glob(inside) if not file.is_dir())
    except (ValueError, NotImplementedError) as problem:
        raise InputRefusedError(f"measurements.files: {pattern!r} is no valid pattern ({problem}).") from None


def _shared_parts(files: Sequence[Path]) -> list[str]:
    shared = []
    for parts in zip(*(file.parent.parts for file in files), strict=False):
        if len(set(parts)) > 1:
            break
        shared.append(parts[0])
    return shared


def listed_rows(path: Path, sample: Sample) -> tuple[ListedMeasurement, ...]:
    """One measurement for each row of a CSV table.

    Parameters
    ----------
    path
        The table. Column ``file`` is required, from the folder of the table; several files of one measurement
        are separated by ``|``. Columns with a dot are parameters of the sample; ``name``, ``x_mm`` and
        ``y_mm`` are optional, others are kept.
    sample
        The sample, whose parameters the columns name.
    """
    text = utf8_text(read_bounded(path, _MOST_BYTES, "table of measurements"), str(path))
    first = text.split("\n", 1)[0]
    rows = [row for row in csv.reader(io.StringIO(text), delimiter=";" if ";" in first else ",") if row]
    heads = [head.strip() for head in rows[0]] if rows else []
    for head, count in Counter(heads).items():
        if count > 1 or not head:
            raise InputRefusedError(
                f"{path}, row 1: {count} columns are named '{head}'; names must be unique."
            )
    if FILE not in heads:
        raise InputRefusedError(f"{path}: has no column '{FILE}'; it must name the file of each measurement.")
    parameters = [head for head in heads if "." in head]
    for name in parameters:
        if _parameter(sample, name, path).tie is not None:
            raise InputRefusedError(
                f"{path}, column {name}: is tied to others in the sample file; remove it."
            )
    if len(rows) < 2:
        raise InputRefusedError(f"{path}: has no rows; it must have one for each measurement.")
    listed = [
        _listed(dict(_cells(row, heads, i, path)), parameters, i, path) for i, row in enumerate(rows[1:], 2)
    ]
    names = _safe_names([one.name for one in listed])
    _require_unique(names, f"{path}, column {NAME if NAME in heads else FILE}")
    return tuple(dataclasses.replace(one, name=name) for one, name in zip(listed, names, strict=True))


def _parameter(sample: Sample, name: str, path: Path):
    try:
        # The table's own sentence about an unknown name, with its hint.
        sample.parameters.replace(name)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{path}, row 1: {problem}") from None
    return sample.parameters[name]


def _cells(row: list[str], heads: list[str], number: int, path: Path):
    if len(row) != len(heads):
        raise InputRefusedError(f"{path}, row {number}: has {len(row)} cells; the header has {len(heads)}.")
    return zip(heads, (cell.strip() for cell in row), strict=True)


def _listed(cells: dict[str, str], parameters: list[str], number: int, path: Path) -> ListedMeasurement:
    named = [part.strip() for part in cells.pop(FILE).split(AND)]
    if not all(named):
        raise InputRefusedError(f"{path}, row {number}, column {FILE}: is empty; name a file.")
    files = tuple(path.parent / part for part in named)
    name = cells.pop(NAME, "") or files[0].stem
    numbers = {
        key: _number(cells.pop(key), f"{path}, row {number}, column {key}")
        for key in (*parameters, *POSITION)
        if cells.get(key)
    }
    values = {key: value for key, value in numbers.items() if key in parameters}
    at: dict[str, str | float] = {key: value for key, value in numbers.items() if key in POSITION}
    rest = {key: cell for key, cell in cells.items() if key not in (*parameters, *POSITION)}
    return ListedMeasurement(name, files, values, at | rest)


def _number(cell: str, where: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if abs(value) < float("inf"):
        return value
    raise InputRefusedError(f"{where}: is {cell!r}; it must be a finite number.")


def _safe_names(names: Sequence[str]) -> list[str]:
    """Names that are valid for files on every system."""
    return [_UNSAFE.sub("_", name).strip(".")[:_LONGEST_NAME] or "measurement" for name in names]


def _require_unique(names: Sequence[str], where: str) -> None:
    for name, count in Counter(name.lower() for name in names).items():
        if count > 1:
            raise InputRefusedError(
                f"{where}: {count} measurements would be named '{name}'; give each a name of its own (column "
                f"'{NAME}' of a table)."
            )
