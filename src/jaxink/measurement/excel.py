"""The rows of the sheets of an Excel workbook (.xlsx), by the package openpyxl."""

import datetime
import warnings
import zipfile
from collections.abc import Iterator
from typing import Any, BinaryIO

_BLOCK = 1_000_000


def rows_of(file: BinaryIO) -> Iterator[tuple[str, int, list[tuple[int, str]]]]:
    """As `jaxink.measurement.opendocument.rows_of`; errors are whatever openpyxl raises.

    Raises
    ------
    ImportError
        If openpyxl is absent.
    """
    import openpyxl

    # Row by row, which takes little memory, it does not tell which cells are merged.
    row_by_row = not _has_merged_cells(file)
    # It warns of what it does not keep, such as colours.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for sheet in openpyxl.load_workbook(file, read_only=row_by_row, data_only=True).worksheets:
            merged: dict[tuple[int, int], Any] = {}
            if row_by_row:
                # The stated dimensions may be wrong.
                sheet.reset_dimensions()
            else:
                merged = _merged_downwards(sheet)
            # One that is empty has a name, too.
            yield sheet.title, 0, []
            for line, row in enumerate(sheet.iter_rows(values_only=True), start=1):
                values = enumerate(row, start=1)
                yield sheet.title, 1, [(1, _text(merged.get((line, column), v))) for column, v in values]


def _has_merged_cells(file: BinaryIO) -> bool:
    """Whether any sheet has merged cells; the file is left at its beginning."""
    mark = b"<mergeCell "
    with zipfile.ZipFile(file) as archive:
        for name in archive.namelist():
            if not name.startswith("xl/worksheets/"):
                continue
            with archive.open(name) as content:
                end = b""
                while block := content.read(_BLOCK):
                    if mark in end + block:
                        file.seek(0)
                        return True
                    end = block[-len(mark) :]
    file.seek(0)
    return False


def _merged_downwards(sheet: Any) -> dict[tuple[int, int], Any]:
    """Values of the cells below the first of those merged within a column, by row and column.

    Such a cell stands beside all its rows, as an angle of incidence beside its scan. One that is merged
    across columns is a title.
    """
    return {
        (row, area.min_col): sheet.cell(area.min_row, area.min_col).value
        for area in sheet.merged_cells.ranges
        if area.min_col == area.max_col
        for row in range(area.min_row + 1, area.max_row + 1)
    }


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
