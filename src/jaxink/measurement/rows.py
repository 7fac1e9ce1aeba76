"""Rows of one condition, and the columns in which files say what was changed between their rows."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Int

from jaxink.display.brief import brief_repr
from jaxink.measurement.columns import listed
from jaxink.measurement.names import CONVERSIONS, UNIT_OF, UNITS, name_and_unit, plain_name, plain_unit
from jaxink.measurement.table import TextTable, is_number, refusal

LIT_SIDE, SAMPLE, THICKNESS, BACKING = "lit_side", "sample", "thickness_um", "backing"
# Headings of the conditions that a model can follow; case, spaces and underscores do not count.
_HEADINGS = {
    LIT_SIDE: "lit side, illuminated side, side lit, side illuminated, lit layer, lit face, illuminated face",
    SAMPLE: "sample, sample name, specimen, specimen name, print, drawdown",
    THICKNESS: "thickness, ink thickness, film thickness, layer thickness, dry thickness",
    BACKING: "backing, backing reflectance, card, background, reflectance of the backing",
}
_CONDITION_OF = {
    plain_name(heading.strip()): condition
    for condition, text in _HEADINGS.items()
    for heading in text.split(",")
}
_MICROMETRES = {"um", "\N{MICRO SIGN}m", "\N{GREEK SMALL LETTER MU}m", "micron", "microns"}
_MICROMETRES |= {"micrometre", "micrometres", "micrometer", "micrometers"}
IN_A_PROJECT = "fit them together in a project (jaxink init --project)"
_NOTHING = ("", "-", "--", "none", "1")
_WORDS = {word for words in UNITS.values() for word in words}
_WORDS |= {word for words in CONVERSIONS.values() for word in words}
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_WHOLE = re.compile(r"[+-]?\d+([eE][+-]?\d+)?")
# One and a half thousand, or one and a half.
_AMBIGUOUS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")


def condition_of(heading: str) -> tuple[str, str] | None:
    """Condition that a column with this heading states, and its unit; None if it is no condition."""
    stem, unit = name_and_unit(heading)
    condition = _CONDITION_OF.get(plain_name(stem))
    if condition == THICKNESS:
        return THICKNESS, "um" if plain_unit(unit) in _MICROMETRES else unit.strip()
    condition = _CONDITION_OF.get(plain_name(heading))
    return None if condition is None else (condition, "")


@dataclass(frozen=True)
class Condition:
    """A column that states a condition.

    Parameters
    ----------
    heading
        Name of the column in the file.
    unit
        Unit that the heading states; may be empty.
    cells
        Text of each row.
    """

    __repr__ = brief_repr

    heading: str
    unit: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Conditions:
    """Conditions of the rows of one table.

    Parameters
    ----------
    source
        The file or sheet, as named by the user.
    columns
        Columns of conditions by what they state: lit_side, sample, thickness_um, backing.
    lines
        Line number of each row in the file, shape ``(rows,)``.
    kept
        Whether the caller wants the row, shape ``(rows,)``.
    """

    __repr__ = brief_repr

    source: str
    columns: Mapping[str, Condition]
    lines: Int[np.ndarray, " rows"]
    kept: Bool[np.ndarray, " rows"]


def conditions_of(table: TextTable, rows: Mapping[str, Any], sample: str | None) -> Conditions:
    """The columns of a table that state conditions; parameters and errors as for `with_rows_of`."""
    columns = {}
    for condition in _HEADINGS:
        found = _headings_of(table, condition)
        cells = {name: tuple(table.column(table.names.index(name))) for name in found}
        if len([name for name in found if len(set(cells[name])) > 1]) > 1:
            raise refusal(table.source, _ambiguous(found, condition))
        for name in found[:1]:
            columns[condition] = Condition(name, (condition_of(name) or ("", ""))[1], cells[name])
    kept = np.ones(len(table.rows), bool)
    for heading, value in (*rows.items(), *([] if sample is None else [(SAMPLE, sample)])):
        kept &= _chosen(table, heading, value)
    return Conditions(table.source, columns, table.lines, kept)


def with_rows_of(table: TextTable, rows: Any, notes: list[str]) -> tuple[TextTable, dict[str, str]]:
    """Only the rows whose cells are those that the caller wants.

    Parameters
    ----------
    table
        The table, with decimal points.
    rows
        Cell by column; a column is named by its heading, or by the condition that it states.
    notes
        Is told how many rows remain.

    Returns
    -------
    table, attrs
        The rows, and what the caller has chosen, by column.

    Raises
    ------
    InputRefusedError
        If there is no such column, no such cell in it, or no row with all of these cells.
    """
    if not isinstance(rows, Mapping):
        raise refusal(
            table.source, f"rows is {rows!r}; name columns and their cells, such as {{'lit_side': 'ink'}}"
        )
    if not rows:
        return table, {}
    keep = np.ones(len(table.rows), bool)
    for heading, value in rows.items():
        keep &= _chosen(table, heading, value)
    words = " and ".join(f"{heading} = {_text(value)!r}" for heading, value in rows.items())
    if not keep.any():
        raise refusal(table.source, f"no row has {words}; choose cells that occur together")
    notes.append(f"Of {len(keep)} rows, the {int(keep.sum())} with {words} were read, as requested.")
    return _kept(table, keep), {str(heading): _text(value) for heading, value in rows.items()}


def with_one_sample(
    table: TextTable, extra: Mapping[str, int], sample: str | None
) -> tuple[TextTable, dict[str, str]]:
    """The rows of one sample, which is chosen if column ``sample`` has several, and its name."""
    if SAMPLE not in extra:
        if sample is not None:
            raise refusal(table.source, f"has no column sample from which to select '{sample}'")
        return table, {}
    cells = table.column(extra[SAMPLE])
    held = list(dict.fromkeys(cells))
    if sample is None and len(held) > 1:
        text = (
            f"contains {len(held)} samples, {listed(held)}; select one with --which NAME (in Python: "
            f"sample='NAME'), or {IN_A_PROJECT}"
        )
        raise refusal(table.source, text, column=SAMPLE)
    chosen = held[0] if sample is None else sample
    return _kept(table, _chosen(table, SAMPLE, chosen)), {SAMPLE: chosen}


def same_cell(cell: str, value: str) -> bool:
    """Whether two cells are equal, as numbers if both are numbers."""
    return cell == value or (is_number(cell) and is_number(value) and _number(cell) == _number(value))


def _chosen(table: TextTable, heading: Any, value: Any) -> Bool[np.ndarray, " rows"]:
    """Rows with a cell in one column."""
    if not isinstance(heading, str) or isinstance(value, bool) or not isinstance(value, str | int | float):
        text = f"rows has {heading!r}: {value!r}; give the text or the number of a cell for each column"
        raise refusal(table.source, text)
    index, wanted = _index(table, heading), _text(value)
    cells = table.column(index)
    keep = np.array([same_cell(cell, wanted) for cell in cells])
    if not keep.any():
        held = listed(dict.fromkeys(cells)) or "nothing but empty cells"
        what = "sample" if heading == SAMPLE else "the cell"
        text = f"does not contain {what} '{wanted}'; it must be one of {held}"
        raise refusal(table.source, text, column=table.names[index])
    return keep


def _index(table: TextTable, heading: str) -> int:
    """Position of the column with a heading, or that states the condition of this name."""
    found = [name for name in table.names if name == heading]
    found = found or [name for name in table.names if name and plain_name(name) == plain_name(heading)]
    found = found or (_headings_of(table, heading) if heading in _HEADINGS else [])
    if len(found) > 1:
        raise refusal(table.source, _ambiguous(found, heading))
    if found:
        return table.names.index(found[0])
    text = f"has no column {heading} from which to choose rows; the header has {listed(table.names)}"
    raise refusal(table.source, text)


def _ambiguous(names: list[str], condition: str) -> str:
    several = " and ".join(f"'{name}'" for name in names)
    return f"the columns {several} can be {condition}; rename all but one"


def _headings_of(table: TextTable, condition: str) -> list[str]:
    """Columns that state a condition: the one of its name, else those with several values, else all."""
    found = [name for name in table.names if (condition_of(name) or ("",))[0] == condition]
    exact = [name for name in found if plain_name(name) == condition]
    several = [name for name in found if len(set(table.column(table.names.index(name)))) > 1]
    return exact or several or found


def _kept(table: TextTable, keep: Bool[np.ndarray, " rows"]) -> TextTable:
    rows = tuple(row for row, kept in zip(table.rows, keep, strict=True) if kept)
    return table.with_rows(rows, table.lines[keep])


def _text(value: Any) -> str:
    """A cell as it would be written."""
    return value.strip() if isinstance(value, str) else f"{value:.15g}"


def _number(cell: str) -> float:
    return float(cell.replace(",", ".", 1))


def without_units(table: TextTable, known: Mapping[str, int], notes: list[str]) -> TextTable:
    """The table without a row of units below its header; one with other units is rejected."""
    first, line = table.rows[0], table.lines[0]
    stated = {name: plain_unit(first[known[name]]) for name in UNIT_OF if name in known}
    if any(is_number(word) and word != "1" for word in stated.values()) or not any(
        word in _WORDS for word in stated.values()
    ):
        return table
    for name, word in stated.items():
        unit = UNIT_OF[name]
        if word in UNITS[unit] or word in _NOTHING:
            continue
        factor = CONVERSIONS[unit].get(word)
        remedy = f"multiply the column by {factor}" if factor else f"the column must be in {unit}"
        raise refusal(table.source, f"the unit is '{first[known[name]].strip()}'; {remedy}", line, name)
    if len(table.rows) == 1:
        raise refusal(table.source, "has a header and a row of units but no data rows")
    notes.append(f"Row {line} states the units of the columns and was skipped.")
    return table.with_rows(table.rows[1:], table.lines[1:])


def with_decimal_points(
    table: TextTable, known: Mapping[str, int], extra: Mapping[str, int], notes: list[str]
) -> TextTable:
    """The table with its decimal commas written as points.

    A file has either commas or points in its numbers; both, or commas that can separate thousands, are
    rejected.
    """
    columns = {name: table.column(index) for name, index in known.items() if name != "side"}
    commas = [
        (int(line), name, cell)
        for name, cells in columns.items()
        for line, cell in zip(table.lines, cells, strict=True)
        if "," in cell and _COMMA.fullmatch(cell)
    ]
    if not commas:
        return table
    line, name, cell = min(commas, key=lambda found: found[0])
    for other, cells in columns.items():
        for other_line, pointed in zip(table.lines, cells, strict=True):
            if "." in pointed and is_number(pointed):
                text = (
                    f"'{cell}' has a decimal comma, but '{pointed}' in row {other_line}, column {other}, a "
                    "decimal point; write all numbers alike"
                )
                raise refusal(table.source, text, line, name)
    if all(_AMBIGUOUS.fullmatch(found) for _, _, found in commas):
        text = f"'{cell}' can be {cell.replace(',', '')} or {cell.replace(',', '.')}; write a decimal point"
        raise refusal(table.source, text, line, name)
    notes.append(f"Decimal commas were read as points (first in row {line}, column {name}: '{cell}').")
    others = (index for index in extra.values() if _has_commas(table.column(index)))
    changed = {index for name, index in known.items() if name != "side"} | set(others)
    rows = (
        tuple(_pointed(cell) if index in changed else cell for index, cell in enumerate(row))
        for row in table.rows
    )
    return table.with_rows(tuple(rows), table.lines)


def has_decimal_commas(table: TextTable) -> bool:
    """Whether any cell is a number with a decimal comma."""
    return any("," in cell and _COMMA.fullmatch(cell.strip()) for row in table.rows for cell in row)


def _has_commas(cells: list[str]) -> bool:
    """Whether a column consists of numbers, some with a decimal comma."""
    filled = [cell for cell in cells if cell]
    numbers = all(_COMMA.fullmatch(cell) or _WHOLE.fullmatch(cell) for cell in filled)
    return numbers and any("," in cell for cell in filled)


def _pointed(cell: str) -> str:
    return cell.replace(",", ".") if _COMMA.fullmatch(cell.strip()) else cell
