"""The cells of the sheets of a workbook."""

import dataclasses
import zipfile
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.reading import open_bounded
from jaxink.measurement import excel, matrix, opendocument
from jaxink.measurement.names import side_in_words
from jaxink.measurement.sheets import Wanted, chosen, possible_names
from jaxink.measurement.stacked import one_below_the_other
from jaxink.measurement.table import (
    AS_CSV,
    MOST_COLUMNS,
    TextTable,
    header_position,
    is_number,
    refusal,
    require_names,
    title_note,
)

EXCEL_SUFFIXES, OPENDOCUMENT_SUFFIXES = (".xlsx", ".xlsm"), (".ods",)
# A row of a measurement has as many numbers.
_FEWEST_NUMBERS = 3
_MOST_BYTES = 100_000_000
# Unpacked, and as rows and cells; a sheet of Excel itself has at most a million rows.
_MOST_UNPACKED_BYTES = 600_000_000
_MOST_ROWS, _MOST_CELLS = 1_100_000, 20_000_000


class SheetTable(NamedTuple):
    """The cells of a sheet, and the side that the caller states for it."""

    name: str
    table: TextTable
    side: str | None


def read_sheets(
    path: Path,
    sheet: Wanted | None = None,
    renamed: Collection[str] = (),
    edges: Sequence[str] | None = None,
) -> list[SheetTable]:
    """Read one sheet or several without interpreting their cells.

    Parameters
    ----------
    path
        The workbook.
    sheet
        The sheets, as in `jaxink.measurement.sheets.chosen`; None: the only one that is not empty.
    renamed
        Names in the sheet that the caller assigns to known columns.
    edges
        What is along the edges of a matrix, as in `jaxink.measurement.matrix.table_of`.

    Raises
    ------
    InputRefusedError
        If openpyxl is absent, the file is not a workbook or too large, or several sheets are not empty.
    """
    with open_bounded(path, _MOST_BYTES, "measurement file") as file:
        _require_small(path, file)
        try:
            sheets = _filled(path, file, sheet)
        except (InputRefusedError, MemoryError):
            raise
        except ImportError:
            raise refusal(
                path, f"reading Excel needs the package openpyxl (pip install openpyxl); or {AS_CSV}"
            ) from None
        # The parsers raise errors of many types for damaged files.
        except Exception as problem:
            text = f"is not a readable workbook ({type(problem).__name__}); {AS_CSV}"
            raise refusal(path, text) from None
    filled = [name for name, (_, rows) in sheets.items() if rows]
    tables = [name for name in filled if any(_has_numbers(row) for row in sheets[name][1])]
    found, wanted = [], chosen(path, list(sheets), filled, tables, sheet)
    for name, side in wanted:
        # Of several, each is named by its source.
        is_one = len(wanted) == 1
        source = str(path) if is_one else f"{path}, sheet {name}"
        told = [f"The table is sheet '{name}' of the workbook."] if is_one else []
        table = _table(source, *sheets[name], told, name, renamed, edges)
        notes = table.notes
        if sheet is None and len(filled) > 1:
            others = ", ".join(other for other in filled if other != name)
            notes = (*notes, f"No other sheet has rows of numbers; they were not read ({others}).")
        named = side_in_words(name) if side is None else None
        found.append(SheetTable(name, dataclasses.replace(table, sheet_side=named, notes=notes), side))
    return found


def _has_numbers(row: list[str]) -> bool:
    return sum(is_number(cell) for cell in row) >= _FEWEST_NUMBERS


def _require_small(path: Path, file: BinaryIO) -> None:
    """Reject what is no zip archive, or unpacks to more than any measurement."""
    try:
        with zipfile.ZipFile(file) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, ValueError, NotImplementedError):
        raise refusal(path, f"is not a workbook; {AS_CSV}") from None
    if size > _MOST_UNPACKED_BYTES:
        most = _MOST_UNPACKED_BYTES / 1e6
        raise refusal(path, f"unpacks to {size / 1e6:.3g} MB; at most {most:.3g} are allowed")
    file.seek(0)


Rows = tuple[list[int], list[list[str]]]


def _filled(path: Path, file: BinaryIO, wanted: Wanted | None) -> dict[str, Rows]:
    """Line numbers and cells of the rows that are not empty, by sheet; of the wanted ones only."""
    rows_of = excel.rows_of if path.suffix.lower() in EXCEL_SUFFIXES else opendocument.rows_of
    sheets: dict[str, Rows] = {}
    names = None if wanted is None else possible_names(wanted)
    line, current, n_cells = 0, None, 0
    for name, repetitions, row in rows_of(file):
        line, current = (line, current) if name == current else (0, name)
        lines, rows = sheets.setdefault(name, ([], []))
        cells = _expanded(path, name, line + 1, row) if names is None or name.casefold() in names else []
        # What is empty at the end of a sheet may be repeated often.
        n_rows = repetitions if cells else 0
        n_cells += len(row) + n_rows * len(cells)
        if line + n_rows > _MOST_ROWS or n_cells > _MOST_CELLS:
            raise refusal(path, f"sheet {name} has more cells than a measurement", line + 1)
        lines += range(line + 1, line + 1 + n_rows)
        rows += [cells] * n_rows
        line += repetitions
    return sheets


def _expanded(path: Path, name: str, line: int, row: list[tuple[int, str]]) -> list[str]:
    """Cells of a row, without empty ones at the end."""
    cells: list[str] = []
    waiting = 0
    for repetitions, text in row:
        if not text.strip():
            waiting += repetitions
            continue
        if len(cells) + waiting + repetitions > MOST_COLUMNS:
            raise refusal(path, f"sheet {name} has more than {MOST_COLUMNS} columns", line)
        cells += [""] * waiting + [text] * repetitions
        waiting = 0
    return cells


def _table(
    source: str, lines: list[int], rows: list[list[str]], told: list[str], sheet: str, renamed, edges
) -> TextTable:
    if not renamed:
        found = matrix.table_of(source, list(zip(lines, rows, strict=True)), edges, told)
        if found is not None:
            return found
    if edges is not None:
        raise refusal(source, f"sheet '{sheet}': {matrix.NONE}")
    position = header_position(source, rows, lines, renamed)
    names = tuple(name.strip() for name in rows[position])
    header_line = lines[position]
    require_names(source, names, header_line, ())
    notes = [*told, *title_note(lines[:position], header_line)]
    numbers, cells = lines[position + 1 :], rows[position + 1 :]
    if not cells:
        raise refusal(source, "has a header but no data rows")
    if numbers[-1] - header_line > len(cells):
        notes.append("Blank rows were skipped; row numbers count them.")
    for line, row in zip(numbers, cells, strict=True):
        if len(row) > len(names):
            text = f"has {len(row)} cells, but the header has {len(names)}; name the column or empty the cell"
            raise refusal(source, text, line)
    titles = {
        n: " ".join(filter(None, row)) for n, row in zip(lines[:position], rows[:position], strict=True)
    }
    padded = [[*row, *[""] * (len(names) - len(row))] for row in cells]
    below = one_below_the_other(source, names, list(zip(numbers, padded, strict=True)), titles, notes)
    if not below.cells:
        raise refusal(source, "has a header but no data rows")
    where, above = np.array(below.numbers), tuple(titles.items())
    return TextTable(
        source, (*names, *below.stated), below.rows(), where, header_line, tuple(notes), titles=above
    )
