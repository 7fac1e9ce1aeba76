"""The cells of a sheet of an Excel workbook."""

import datetime
import warnings
import zipfile
from collections.abc import Collection, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.reading import open_bounded
from jaxink.measurement.header import header_position, require_names, title_note
from jaxink.measurement.table import AS_CSV, TextTable, refusal

_MOST_BYTES = 100_000_000
# Unpacked, and as cells; Excel itself has at most a million rows.
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
    try:
        import openpyxl
    except ImportError:
        raise refusal(
            path, f"reading Excel needs the package openpyxl (pip install 'jaxink[excel]'); or {AS_CSV}"
        ) from None
    with open_bounded(path, _MOST_BYTES, "measurement file") as file:
        _require_small(path, file)
        try:
            # It warns of what it does not keep, such as colours.
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                book = openpyxl.load_workbook(file, read_only=True, data_only=True)
                lines, rows, name = _cells(path, book, sheet)
        except (InputRefusedError, MemoryError):
            raise
        # The parser raises errors of many types for damaged files.
        except Exception as problem:
            text = f"is not a readable workbook ({type(problem).__name__}); {AS_CSV}"
            raise refusal(path, text) from None
    return _table(path, lines, rows, name, renamed)


def _require_small(path: Path, file) -> None:
    """Reject what is no zip archive, or unpacks to more than any measurement."""
    try:
        with zipfile.ZipFile(file) as archive:
            size = sum(member.file_size for member in archive.infolist())
    except (zipfile.BadZipFile, ValueError, NotImplementedError):
        raise refusal(path, f"is not an Excel workbook; {AS_CSV}") from None
    if size > _MOST_UNPACKED_BYTES:
        raise refusal(
            path, f"unpacks to {size / 1e6:.3g} MB; at most {_MOST_UNPACKED_BYTES / 1e6:.3g} are allowed"
        )
    file.seek(0)


def _cells(path: Path, book: Any, wanted: str | None) -> tuple[list[int], list[list[str]], str]:
    """Numbers and cells of the rows that are not empty, and the name of the sheet."""
    sheets = {sheet.title: sheet for sheet in book.worksheets}
    if wanted is not None and wanted not in sheets:
        raise refusal(path, f"has no sheet '{wanted}'; its sheets are {', '.join(sheets)}")
    chosen = sheets if wanted is None else {wanted: sheets[wanted]}
    found = {name: filled for name, sheet in chosen.items() if (filled := list(_filled(path, sheet)))}
    if not found:
        raise refusal(path, "is empty; it must have a header row and data rows")
    if len(found) > 1:
        text = (
            f"has values in {len(found)} sheets, {', '.join(found)}; select one with --sheet NAME (in "
            "Python: sheet='NAME')"
        )
        raise refusal(path, text)
    name, filled = next(iter(found.items()))
    return [line for line, _ in filled], [row for _, row in filled], name


def _filled(path: Path, sheet: Any) -> Iterator[tuple[int, list[str]]]:
    # The stated dimensions may be wrong.
    sheet.reset_dimensions()
    n_cells = 0
    for line, row in enumerate(sheet.iter_rows(values_only=True), start=1):
        n_cells += len(row)
        if line > _MOST_ROWS or n_cells > _MOST_CELLS:
            raise refusal(path, f"sheet {sheet.title} has more cells than a measurement", line)
        cells = _trimmed(map(_text, row))
        if cells:
            yield line, cells


def _trimmed(cells: Iterable[str]) -> list[str]:
    """Cells without empty ones at the end."""
    kept = list(cells)
    while kept and not kept[-1].strip():
        kept.pop()
    return kept


def _text(value: Any) -> str:
    """Text of a cell, from which a number is read without loss."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).upper()
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime.datetime | datetime.date | datetime.time):
        return value.isoformat()
    return str(value)


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
