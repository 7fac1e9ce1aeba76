"""A measurement file as a table of cells, with the line number of each row."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from jaxink.errors import InputRefusedError

# Every column that is kept becomes a variable of the result.
MOST_COLUMNS = 1000
# What to do with a file that cannot be read.
AS_CSV = "save it as CSV (in Excel or LibreOffice: File, Save As, 'CSV UTF-8')"


@dataclass(frozen=True)
class TextTable:
    """Cells of a delimited text file or of a sheet.

    Parameters
    ----------
    source
        The file as named by the user.
    names
        Column names of the header, stripped of white space.
    rows
        Cells of each row, as text.
    lines
        Line number of each row in the file, from 1, shape ``(rows,)``.
    header_line
        Line number of the header.
    notes
        Sentences on what was changed.
    sheet_side
        ``R`` or ``T`` if the name of the sheet says so.
    """

    source: str
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: np.ndarray
    header_line: int
    notes: tuple[str, ...]
    sheet_side: str | None = None

    def column(self, index: int) -> list[str]:
        """Cells of one column, stripped of white space."""
        return [row[index].strip() for row in self.rows]

    def with_rows(self, rows: tuple[tuple[str, ...], ...], lines: np.ndarray) -> "TextTable":
        """The table with other rows."""
        return dataclasses.replace(self, rows=rows, lines=lines)

    def with_constant(self, name: str, cell: str) -> "TextTable":
        """The table with one more column, the same cell in every row."""
        rows = tuple((*row, cell) for row in self.rows)
        return dataclasses.replace(self, names=(*self.names, name), rows=rows)


def refusal(source, text, row=None, column=None) -> InputRefusedError:
    """Error with a message that names file, row and column before the text."""
    place = [str(source)]
    if row is not None:
        place.append(f"row {row}")
    if column is not None:
        place.append(f"column {column}")
    return InputRefusedError(f"{', '.join(place)}: {text}.")


def is_number(text: str) -> bool:
    """Whether a cell is a number, with a decimal point or a decimal comma."""
    try:
        float(text.replace(",", ".", 1))
    except ValueError:
        return False
    return True
