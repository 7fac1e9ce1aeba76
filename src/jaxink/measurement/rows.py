"""Rows of one condition, and the columns in which files say what was changed between their rows."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Int

from jaxink.measurement.columns import listed
from jaxink.measurement.names import name_and_unit, plain_name
from jaxink.measurement.table import TextTable, is_number, refusal
from jaxink.measurement.units import plain_unit

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
