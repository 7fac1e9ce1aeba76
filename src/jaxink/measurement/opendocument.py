"""The rows of the sheets of an OpenDocument workbook (.ods), as LibreOffice writes it."""

import zipfile
from collections.abc import Iterator
from typing import BinaryIO
from xml.etree import ElementTree

_TABLE = "{urn:oasis:names:tc:opendocument:xmlns:table:1.0}"
_OFFICE = "{urn:oasis:names:tc:opendocument:xmlns:office:1.0}"
_TEXT = "{urn:oasis:names:tc:opendocument:xmlns:text:1.0}"
_CELLS = (f"{_TABLE}table-cell", f"{_TABLE}covered-table-cell")
_VALUES = ("value", "date-value", "time-value", "boolean-value")


def rows_of(file: BinaryIO) -> Iterator[tuple[str, int, list[tuple[int, str]]]]:
    """Name of the sheet, number of repetitions, and (repetitions, text) of the cells, for each row in turn.

    Errors of the archive and of the parser are those of `zipfile` and of `xml.etree.ElementTree`, or a
    ValueError for a repetition that is no number.
    """
    with zipfile.ZipFile(file) as archive, archive.open("content.xml") as content:
        name = ""
        for event, element in ElementTree.iterparse(content, ("start", "end")):
            if event == "start":
                if element.tag == f"{_TABLE}table":
                    name = element.get(f"{_TABLE}name", "")
            elif element.tag == f"{_TABLE}table-row":
                cells = [(_repeated(cell, "columns"), _text(cell)) for cell in element if cell.tag in _CELLS]
                yield name, _repeated(element, "rows"), cells
                # A sheet can have a million rows.
                element.clear()


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
