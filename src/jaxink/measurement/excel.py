"""The rows of the sheets of an Excel workbook (.xlsx), by the package openpyxl."""

import datetime
import warnings
from collections.abc import Iterator
from typing import Any, BinaryIO


def rows_of(file: BinaryIO) -> Iterator[tuple[str, int, list[tuple[int, str]]]]:
    """As `jaxink.measurement.opendocument.rows_of`; errors are whatever openpyxl raises.

    Raises
    ------
    ImportError
        If openpyxl is absent.
    """
    import openpyxl

    # It warns of what it does not keep, such as colours.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for sheet in openpyxl.load_workbook(file, read_only=True, data_only=True).worksheets:
            # The stated dimensions may be wrong.
            sheet.reset_dimensions()
            # One that is empty has a name, too.
            yield sheet.title, 0, []
            for row in sheet.iter_rows(values_only=True):
                yield sheet.title, 1, [(1, _text(value)) for value in row]


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
