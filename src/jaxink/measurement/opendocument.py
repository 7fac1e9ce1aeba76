"""The rows of the sheets of an OpenDocument workbook (.ods), as LibreOffice writes it."""

import zipfile
from collections.abc import Iterator
from typing import BinaryIO
from xml.etree import ElementTree

_TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
_OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"
_TEXT = "{urn:oasis:names:tc:opendocument:xmlns:text:1.0}"
_COVERED = f"{_TABLE}covered-table-cell"
_CELLS = (f"{_TABLE}table-cell", _COVERED)
_VALUES = ("value", "date-value", "time-value", "boolean-value")


def rows_of(file: BinaryIO) -> Iterator[tuple[str, int, list[tuple[int, str]]]]:
    """Name of the sheet, number of repetitions, and (repetitions, text) of the cells, for each row in turn.

    A cell that is merged within its column stands beside all its rows, and is repeated in them.

    Errors of the archive and of the parser are those of `zipfile` and of `xml.etree.ElementTree`, or a
    ValueError for a repetition that is no number.
    """
    with zipfile.ZipFile(file) as archive, archive.open("content.xml") as content:
        name, merged = "", dict[int, tuple[int, str]]()
        for event, element in ElementTree.iterparse(content, ("start", "end")):
            if event == "start":
                if element.tag == f"{_TABLE}table":
                    name, merged = element.get(f"{_TABLE}name", ""), {}
            elif element.tag == f"{_TABLE}table-row":
                repetitions = _repeated(element, "rows")
                cells, merged = _cells(element, repetitions, merged)
                yield name, repetitions, cells
                # A sheet can have a million rows.
                element.clear()


def _cells(
    row: ElementTree.Element, repetitions: int, merged: dict[int, tuple[int, str]]
) -> tuple[list[tuple[int, str]], dict[int, tuple[int, str]]]:
    """(Repetitions, text) of the cells of a row, and the cells that reach down into the rows below.

    The latter are (number of these rows, text) by column.
    """
    cells: list[tuple[int, str]] = []
    below = {column: (n - repetitions, text) for column, (n, text) in merged.items() if n > repetitions}
    column = 0
    for cell in row:
        if cell.tag not in _CELLS:
            continue
        n, text = _repeated(cell, "columns"), _text(cell)
        n_rows = int(cell.get(f"{_TABLE}number-rows-spanned", "1"))
        if n_rows > 1 and int(cell.get(f"{_TABLE}number-columns-spanned", "1")) == 1:
            below[column] = (n_rows - 1, text)
        end = column + n
        if cell.tag == _COVERED:
            for filled in sorted(at for at in merged if column <= at < end):
                cells += [(filled - column, ""), (1, merged[filled][1])]
                column = filled + 1
            text = ""
        cells.append((end - column, text))
        column = end
    return cells, below


def _repeated(element: ElementTree.Element, what: str) -> int:
    return max(int(element.get(f"{_TABLE}number-{what}-repeated", "1")), 1)


def _text(cell: ElementTree.Element) -> str:
    """The value with all its digits or, of text, what is displayed without comments."""
    if cell.get(f"{_OFFICE}value-type", "string") != "string":
        for kind in _VALUES:
            value = cell.get(f"{_OFFICE}{kind}")
            if value is not None:
                return value
    return "\n".join("".join(part.itertext()) for part in cell if part.tag == f"{_TEXT}p")
