"""A first project file, written from the files of its measurements."""

import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from jaxink.measurement import BACKING, LIT_SIDE, SAMPLE, THICKNESS, is_readings_file, overrides_of_files
from jaxink.projects.conditions import Value, explains_itself, short
from jaxink.projects.schema import PROJECT_VERSION
from jaxink.projects.splitting import conditions_in, several_of
from jaxink.projects.toml_text import toml_key, toml_value

# Reflectance of usual cards; of others nothing is known.
_USUAL = {"white": 0.85, "black": 0.04}
_UNKNOWN = 0.5
_LONGEST = 40


def first_measurements(
    files: Sequence[Path], folder: Path, reading: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Tables of ``[[measurements]]``, one for each file.

    Parameters
    ----------
    files
        The files.
    folder
        Folder of the project file, from which it names them.
    reading
        What the files do not state: keywords of `jaxink.read`; lists have one entry for each file.
    """
    of_files = overrides_of_files(len(files), reading)
    tables: list[dict[str, Any]] = []
    for k, file in enumerate(files):
        stem = short(file.stem)[:_LONGEST] or "measurement"
        used = {table["name"].lower() for table in tables}
        names = (stem, *(f"{stem}_{n}" for n in range(2, len(files) + 2)))
        name = next(name for name in names if name.lower() not in used)
        if is_readings_file(file):
            tables.append({"name": name, "readings": _from(folder, file)})
            continue
        table: dict[str, Any] = {"name": name, "data": _from(folder, file)}
        tables.append(table | ({"reading": of_files[k]} if of_files[k] else {}))
    return tables


def project_text(
    tables: Sequence[Mapping[str, Any]], folder: Path, sample: str, layers: Sequence[str]
) -> str:
    """Text of a project file with comments.

    Parameters
    ----------
    tables
        Those of `first_measurements`.
    folder
        Folder of the project file.
    sample
        The common sample file, as the project names it.
    layers
        Names of its layers, the lit one first.
    """
    held = [[] if "readings" in table else conditions_in(table, folder) for table in tables]
    applies = several_of(held) | {LIT_SIDE}
    found = [
        [{name: value for name, value in values.items() if name in applies} for values, _ in combinations]
        for combinations in held
    ]
    lines = [*_head(tables, sample), *_cards(found), *_specimens(found)]
    for table, combinations in zip(tables, found, strict=True):
        lines += [*_measurement(table, combinations, layers)]
    return "\n".join(lines) + "\n"


def _from(folder: Path, file: Path) -> str:
    """Name of a file from a folder."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        # On another drive.
        return file.absolute().as_posix()


def _head(tables: Sequence[Mapping[str, Any]], sample: str) -> Iterator[str]:
    n = len(tables)
    yield f"# Project of {n} {'measurement' if n == 1 else 'measurements'}, written by jaxink init."
    yield "# Every key: docs/manual/projects.md."
    yield "# Lines that say ASSUMED are usual values, not knowledge: correct them."
    yield "# One ink is fitted to all measurements; write below what differs between them."
    yield f"schema_version = {PROJECT_VERSION}"
    yield f"title = {toml_value(', '.join(str(table['name']) for table in tables))}"
    yield f"sample = {toml_value(sample)}  # what all have in common"


def _cards(found: Sequence[Sequence[Mapping[str, Value]]]) -> Iterator[str]:
    """The reflectance of each card that a file names."""
    cells = dict.fromkeys(cell for cell in _cells(found, BACKING) if not explains_itself(cell))
    if not cells:
        return
    yield ""
    yield "# Reflectance of the cards that the files name."
    yield "[backings]"
    for cell in cells:
        yield f"{toml_key(cell)} = {_USUAL.get(cell.casefold(), _UNKNOWN)}  # ASSUMED: measure it"


def _specimens(found: Sequence[Sequence[Mapping[str, Value]]]) -> Iterator[str]:
    """A table for each sample that a file names, or an example of one."""
    yield ""
    yield "# What differs on one print or drawdown, by the names of the layers; its measurements share it."
    cells = dict.fromkeys(_cells(found, SAMPLE))
    if not cells:
        yield "# [specimens.thick]"
        yield "# ink.thickness_um = 75"
    for cell in cells:
        yield f"[specimens.{toml_key(cell)}]"
        yield "# ink.thickness_um = 75"
    yield ""
    yield "# What is a property of one instrument, such as a factor of all of its readings."
    yield "# [instruments.arm]"
    yield "# noise.relative = 0.01"


def _cells(found: Sequence[Sequence[Mapping[str, Value]]], name: str) -> Iterator[str]:
    """Values of a condition."""
    for combinations in found:
        for values in combinations:
            if name in values:
                yield values[name].cell


def _measurement(
    table: Mapping[str, Any], combinations: Sequence[Mapping[str, Value]], layers: Sequence[str]
) -> Iterator[str]:
    """The table of a measurement, and what else it may state."""
    yield ""
    yield "[[measurements]]"
    for key, value in table.items():
        yield f"{key} = {toml_value(value)}"
    stated = combinations[0] if combinations else {}
    for name, value in stated.items():
        cells = list(dict.fromkeys(values[name].cell for values in combinations))
        column = f"Column {value.column.heading}"
        if value.divides:
            listed = ", ".join(cells[:6]) + (", ..." if len(cells) > 6 else "")
            yield f"# {column} divides it into measurements of {len(cells)} values: {listed}."
        else:
            yield f"# {column} says {cells[0]}."
    if SAMPLE not in stated:
        yield '# specimen = "thick"  # one of [specimens.NAME] above'
    yield '# instrument = "arm"  # one of [instruments.NAME] above'
    if LIT_SIDE not in stated and len(layers) > 1:
        yield f'# lit_side = "{layers[-1]}"  # if light meets that layer first; else it is {layers[0]}'
    if THICKNESS not in stated:
        yield "# changes.ink.thickness_um = 75  # what differs here alone"
    if BACKING not in stated:
        yield "# changes.backing.reflectance = 0.04"
