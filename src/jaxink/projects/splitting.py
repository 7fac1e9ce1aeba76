"""Files with several conditions are divided: one measurement for each of them.

A column that states a condition (`jaxink.measurement.rows`) and has several values divides the rows of a
measurement, unless its ``rows`` choose one of the values. Either way the value applies: which side was lit,
which specimen it was, how thick its ink, what was behind it (`jaxink.projects.conditions`). So does the only
value of a file, if other measurements of the project have other ones.
"""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.measurement import (
    LIT_SIDE,
    ONE_A_FILE,
    SAMPLE,
    THICKNESS,
    Conditions,
    overrides_of_files,
    read_conditions,
    refusal,
    same_cell,
)
from jaxink.projects.conditions import KnownWords, Part, Role, Value, explained, short

# Values by condition that occur together, and the positions of the files that have them.
Combinations = list[tuple[dict[str, Value], list[int]]]
# A column with more values is a reading, such as that of a thermometer.
_MOST_VALUES = 50


def conditions_in(table: Mapping[str, Any], folder: Path) -> Combinations:
    """Find the conditions of a measurement, as its files state them.

    Parameters
    ----------
    table
        The ``[[measurements]]`` table, with a name and the files.
    folder
        Folder of the files.

    Returns
    -------
    list of (values, files)
        Values by condition that occur together, in the order of the rows, and the positions of the files that
        have them; empty if the files state no condition.

    Raises
    ------
    InputRefusedError
        A file cannot be read, only some of the files state a condition, or a cell is empty.
    """
    files = _files(table)
    of_files, rows = overrides_of_files(len(files), table.get("reading", {})), table.get("rows", {})
    held = [
        (k, each)
        for k, file in enumerate(files)
        for each in read_conditions(folder / file, rows=rows, **of_files[k]) or [_none_of(folder / file)]
    ]
    roles = _roles([each for _, each in held])
    return _combinations(held, roles) if roles else []


def several_of(found: Iterable[Combinations]) -> frozenset[str]:
    """Conditions that have several values in the measurements of a project."""
    cells: dict[str, list[str]] = {}
    for values in (values for combinations in found for values, _ in combinations):
        for name, value in values.items():
            known = cells.setdefault(name, [])
            if not any(same_cell(value.cell, other) for other in known):
                known.append(value.cell)
    return frozenset(name for name, known in cells.items() if len(known) > 1)


def split(table: Mapping[str, Any], combinations: Combinations, known: KnownWords) -> list[Part]:
    """Divide a measurement by the conditions that its files state.

    Parameters
    ----------
    table
        The ``[[measurements]]`` table, with a name and the files.
    combinations
        Its conditions, from `conditions_in`.
    known
        What explains the words of the files.

    Returns
    -------
    list of Part
        One for each combination of values that the files have, in their order; a single one if no condition
        has several.

    Raises
    ------
    InputRefusedError
        A value is not explained, or the measurement states the same by itself; the message names file, row
        and column.
    """
    if not combinations:
        # Without conditions, or without rows, of which the reader tells.
        return [Part(dict(table))]
    files, reading = _files(table), table.get("reading", {})
    dividing = [name for name, value in combinations[0][0].items() if value.divides]
    names = {name: _short_names(name, [values[name].cell for values, _ in combinations]) for name in dividing}
    parts = []
    for values, where in combinations:
        part = dict(table)
        if dividing:
            part["name"] = "_".join([table["name"], *(names[name][values[name].cell] for name in dividing)])
            # Files may head a column differently; each is found by the condition that it states.
            part["rows"] = {**table.get("rows", {}), **{name: values[name].cell for name in dividing}}
            part["data"] = [files[k] for k in where]
            part["reading"] = _reading_of(reading, where, len(files))
        parts.append(explained(part, values, known))
    return parts


def _files(table: Mapping[str, Any]) -> list[str]:
    return [table["data"]] if isinstance(table["data"], str) else list(table["data"])


def _none_of(path: Path) -> Conditions:
    """A file of a format without columns of conditions."""
    return Conditions(str(path), {}, np.zeros(0, int), np.zeros(0, bool))


def _roles(tables: Sequence[Conditions]) -> dict[str, Role]:
    """The conditions that the files state, and what each is to the measurement."""
    found = {}
    for name in dict.fromkeys(name for each in tables for name in each.columns):
        here = [each for each in tables if name in each.columns]
        all_values = _distinct(here, name, chosen=False)
        n_values = len(all_values)
        is_partial = len(here) < len(tables)
        is_left_out = n_values == 1 and name != LIT_SIDE and is_partial
        if n_values > _MOST_VALUES or all_values == [""] or is_left_out:
            continue
        if is_partial:
            without = next(each for each in tables if name not in each.columns)
            heading = here[0].columns[name].heading
            text = f"has no column {heading}, but {here[0].source} has one; add it, or write two measurements"
            raise refusal(without.source, text)
        is_one = len(_distinct(here, name)) == 1
        found[name] = Role.ONLY if n_values == 1 else Role.CHOSEN if is_one else Role.DIVIDES
    return found


def _distinct(tables: Sequence[Conditions], name: str, chosen: bool = True) -> list[str]:
    """Different cells of a column, of the chosen rows or of all; one more than the most, if they are more."""
    found: list[str] = []
    for each in tables:
        rows = zip(each.columns[name].cells, each.kept, strict=True)
        for cell in dict.fromkeys(cell for cell, kept in rows if kept or not chosen):
            if len(found) <= _MOST_VALUES and not any(same_cell(cell, other) for other in found):
                found.append(cell)
    return found


def _combinations(held: Sequence[tuple[int, Conditions]], roles: Mapping[str, Role]) -> Combinations:
    """Values that occur together, in the order of the rows, and the positions of the files that have them."""
    spelt = {name: _distinct([each for _, each in held], name) for name in roles}
    found: dict[tuple[str, ...], tuple[dict[str, Value], list[int]]] = {}
    for k, each in held:
        first: dict[tuple[str, ...], int] = {}
        columns = [each.columns[name] for name in roles]
        for row, cells in enumerate(zip(*(column.cells for column in columns), strict=True)):
            if each.kept[row]:
                first.setdefault(cells, row)
        for cells, row in first.items():
            values = {}
            for name, column, cell in zip(roles, columns, cells, strict=True):
                one = next(other for other in spelt[name] if same_cell(cell, other))
                values[name] = Value(one, column, each.source, int(each.lines[row]), roles[name])
                if not cell and roles[name] is not Role.ONLY:
                    raise values[name].refusal("the cell is empty, but others are not; fill it")
            _, where = found.setdefault(tuple(value.cell for value in values.values()), (values, []))
            if k not in where:
                where.append(k)
    return [(_within_specimens(values, [v for v, _ in found.values()]), w) for values, w in found.values()]


def _within_specimens(
    values: Mapping[str, Value], combinations: Sequence[Mapping[str, Value]]
) -> dict[str, Value]:
    """The values, with whether others of the same condition occur with their specimen."""
    one = values.get(SAMPLE)
    same = [other for other in combinations if one is None or other[SAMPLE].cell == one.cell]
    return {
        name: dataclasses.replace(value, divides_specimen=len({other[name].cell for other in same}) > 1)
        for name, value in values.items()
    }


def _short_names(condition: str, cells: Sequence[str]) -> dict[str, str]:
    """A part of a name for each value; numbers where letters do not tell them apart."""
    unit = "um" if condition == THICKNESS else ""
    names = {cell: f"{letters}{unit}" if (letters := short(cell)) else "" for cell in cells}
    if "" in names.values() or len({name.lower() for name in names.values()}) < len(names):
        return {cell: str(k) for k, cell in enumerate(names, 1)}
    return names


def _reading_of(reading: Mapping[str, Any], where: Sequence[int], n_files: int) -> dict[str, Any]:
    """What is stated about some of the files."""
    return {
        key: [value[k] for k in where]
        if key in ONE_A_FILE and isinstance(value, list) and len(value) == n_files
        else value
        for key, value in reading.items()
    }
