"""Rows of units and decimal commas, understood where they have one meaning only."""

import re
from collections.abc import Mapping

from jaxink.measurement.table import TextTable, is_number, refusal
from jaxink.measurement.units import CONVERSIONS, UNIT_OF, UNITS, plain_unit

_NOTHING = ("", "-", "--", "none")
_WORDS = {word for words in UNITS.values() for word in words}
_WORDS |= {word for words in CONVERSIONS.values() for word in words}

_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_WHOLE = re.compile(r"[+-]?\d+([eE][+-]?\d+)?")
# One and a half thousand, or one and a half.
_AMBIGUOUS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")


def without_units(table: TextTable, known: Mapping[str, int], notes: list[str]) -> TextTable:
    """The table without a row of units below its header; one with other units is rejected."""
    first, line = table.rows[0], table.lines[0]
    stated = {name: plain_unit(first[known[name]]) for name in UNIT_OF if name in known}
    if any(is_number(word) for word in stated.values()) or not any(
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
