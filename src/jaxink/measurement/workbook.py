"""The cells of a sheet of a workbook."""

import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import BinaryIO

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.reading import open_bounded
from jaxink.measurement import excel, opendocument
from jaxink.measurement.header import header_position, require_names, title_note
from jaxink.measurement.table import AS_CSV, MOST_COLUMNS, TextTable, refusal

EXCEL_SUFFIXES, OPENDOCUMENT_SUFFIXES = (".xlsx", ".xlsm"), (".ods",)
_MOST_BYTES = 100_000_000
# Unpacked, and as rows and cells; a sheet of Excel itself has at most a million rows.
_MOST_UNPACKED_BYTES = 600_000_000
_MOST_ROWS, _MOST_CELLS = 1_100_000, 20_000_000


def read_sheet(path: Path, sheet: str | None = None, renamed: Collection[str] = ()) -> TextTable:
    """Read a sheet without interpreting its cells.

    Parameters
    ----------
    path
        The workbook.
    sheet
        Name of the sheet; None: the only one that is not empty.
    renamed
        Names in the sheet that the caller assigns to known columns.

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
                path, f"reading Excel needs the package openpyxl (pip install 'jaxink[excel]'); or {AS_CSV}"
            ) from None
        # The parsers raise errors of many types for damaged files.
        except Exception as problem:
            text = f"is not a readable workbook ({type(problem).__name__}); {AS_CSV}"
            raise refusal(path, text) from None
    name = _chosen(path, sheets, sheet)
    return _table(path, *sheets[name], name, renamed)


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


def _filled(path: Path, file: BinaryIO, wanted: str | None) -> dict[str, Rows]:
    """Line numbers and cells of the rows that are not empty, by sheet; of the wanted one only."""
    rows_of = excel.rows_of if path.suffix.lower() in EXCEL_SUFFIXES else opendocument.rows_of
    sheets: dict[str, Rows] = {}
    line, current, n_cells = 0, None, 0
    for name, repetitions, row in rows_of(file):
        line, current = (line, current) if name == current else (0, name)
        lines, rows = sheets.setdefault(name, ([], []))
        cells = _expanded(path, name, line + 1, row) if wanted in (None, name) else []
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


def _chosen(path: Path, sheets: dict[str, Rows], wanted: str | None) -> str:
    """Name of the sheet to read."""
    if wanted is not None and wanted not in sheets:
        raise refusal(path, f"has no sheet '{wanted}'; its sheets are {', '.join(sheets)}")
    found = [name for name in sheets if sheets[name][1] and wanted in (None, name)]
    if not found:
        raise refusal(path, "is empty; it must have a header row and data rows")
    if len(found) > 1:
        text = (
            f"has values in {len(found)} sheets, {', '.join(found)}; select one with --sheet NAME (in "
            "Python: sheet='NAME')"
        )
        raise refusal(path, text)
    return found[0]


def _table(path: Path, lines: list[int], rows: list[list[str]], sheet: str, renamed) -> TextTable:
    position = header_position(str(path), rows, lines, renamed)
    names = tuple(name.strip() for name in rows[position])
    header_line = lines[position]
    require_names(str(path), names, header_line, ())
    notes = [f"The table is sheet '{sheet}' of the workbook.", *title_note(lines[:position], header_line)]
    numbers, cells = lines[position + 1 :], rows[position + 1 :]
    if not cells:
        raise refusal(path, "has a header but no data rows")
    if numbers[-1] - header_line > len(cells):
        notes.append("Blank rows were skipped; row numbers count them.")
    for line, row in zip(numbers, cells, strict=True):
        if len(row) > len(names):
            text = f"has {len(row)} cells, but the header has {len(names)}; name the column or empty the cell"
            raise refusal(path, text, line)
    full = tuple((*row, *[""] * (len(names) - len(row))) for row in cells)
    return TextTable(str(path), names, full, np.array(numbers), header_line, tuple(notes))
