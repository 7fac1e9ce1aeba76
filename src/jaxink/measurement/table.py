"""A measurement file, or a table in memory, as cells with the line number of each row, and its header."""

import dataclasses
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.measurement.names import is_unit, meaning

# Every column that is kept becomes a variable of the result.
MOST_COLUMNS = 1000
# What to do with a file that cannot be read.
AS_CSV = "save it as CSV (in Excel or LibreOffice: File, Save As, 'CSV UTF-8')"
_MISSING = ("nan", "NaN", "NaT", "None", "<NA>")
# Titles are shorter.
MOST_TITLE_LINES = 100
# So many known names make a header, and so many numbers a row of values.
_NAMES, _VALUES = 2, 3


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
    titles
        Line number and text of the lines above the header.
    is_matrix
        Whether the values stood in a matrix, whose titles say what they are.
    states_phi_deg
        Whether a matrix has the name ``phi_deg`` for its azimuths.
    """

    source: str
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: np.ndarray
    header_line: int
    notes: tuple[str, ...]
    sheet_side: str | None = None
    titles: tuple[tuple[int, str], ...] = ()
    is_matrix: bool = False
    states_phi_deg: bool = False

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


def is_frame(data: Any) -> bool:
    """Whether the object is a table of named columns."""
    is_framed = hasattr(data, "columns") and hasattr(data, "__getitem__") and not isinstance(data, str)
    return is_framed or isinstance(data, dict)


def kind_of(frame: Any) -> str:
    """What messages call a table in memory."""
    return "dict" if isinstance(frame, dict) else "DataFrame"


def table_of(frame: Any, source: str) -> TextTable:
    """The cells of a table in memory; rows are counted from 0, as by ``iloc``.

    An entry of a dict that is one number or one text is that of all rows.

    Raises
    ------
    InputRefusedError
        If it has no column or no row, two columns of one name, columns of several lengths, or too many.
    """
    if isinstance(frame, dict):
        frame = _Columns(frame)
    labels = list(frame.columns)
    names = tuple(_name(label) for label in labels)
    if not names:
        raise refusal(source, "has no columns")
    require_names(source, names, 0, ())
    for name in names:
        if names.count(name) > 1:
            raise refusal(source, "the column occurs twice", column=name)
    columns = [[_cell(value) for value in list(frame[label])] for label in labels]
    for name, column in zip(names, columns, strict=True):
        if len(column) != len(columns[0]):
            text = f"has {len(column)} entries, but column {names[0]} has {len(columns[0])}"
            raise refusal(source, text, column=name)
    rows = tuple(zip(*columns, strict=True))
    if not rows:
        raise refusal(source, "has columns but no rows")
    return TextTable(source, names, rows, np.arange(len(rows)), 0, ())


class _Columns(dict):
    """A dict of columns as a table; an entry alone is repeated."""

    def __init__(self, columns: dict):
        size = max((len(values) for values in columns.values() if np.ndim(values) > 0), default=1)
        super().__init__({n: [v] * size if np.ndim(v) == 0 else v for n, v in columns.items()})

    @property
    def columns(self) -> list:
        """Names of the columns."""
        return list(self)


def _name(label: Any) -> str:
    """A label, of several levels too."""
    parts = label if isinstance(label, tuple) else (label,)
    return " ".join(str(part) for part in parts if str(part)).strip()


def _cell(value: Any) -> str:
    """A value as it would stand in a file, with all of its digits."""
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else repr(float(value))
    if isinstance(value, np.generic):
        value = value.item()
    text = str(value)
    return "" if text in _MISSING else text


def header_position(source: str, rows: Sequence[Sequence[str]], lines: Sequence[int], renamed) -> int:
    """Position of the row with the most known column names among the first rows; 0 if none has two of them.

    Parameters
    ----------
    source
        The file, for messages.
    rows
        Cells of the first rows.
    lines
        Line number of each.
    renamed
        Names in the file that the caller assigns to known columns.

    Raises
    ------
    InputRefusedError
        If a row of values is above the header.
    """
    first = rows[:MOST_TITLE_LINES]
    counts = [sum(cell.strip() in renamed or meaning(cell) is not None for cell in row) for row in first]
    best = max(counts, default=0)
    if best < _NAMES:
        return _position_above_values(rows)
    position = counts.index(best)
    for row, line in zip(first[:position], lines, strict=False):
        if sum(is_number(cell) for cell in row) >= _VALUES:
            text = f"contains values, but is above the header in row {lines[position]}; put the header first"
            raise refusal(source, text, line)
    return position


def _position_above_values(rows: Sequence[Sequence[str]]) -> int:
    """Position of the first row of names, as many as there are values below; 0 if there is none."""
    for position, (row, below) in enumerate(zip(rows[:MOST_TITLE_LINES], rows[1:], strict=False)):
        if any(map(is_number, row)):
            return 0
        if len(row) > 1 and len(row) == len(below) and sum(map(is_number, below)) > 1:
            has_units = position > 0 and any(is_unit(cell) for cell in row)
            return position - 1 if has_units and len(rows[position - 1]) == len(row) else position
    return 0


def title_note(skipped: Sequence[int], header_line: int) -> list[str]:
    """Note on the lines above the header, if there are any."""
    if not skipped:
        return []
    which = "1 title line" if len(skipped) == 1 else f"{len(skipped)} title lines"
    verb = "was" if len(skipped) == 1 else "were"
    return [f"{which} above the header in row {header_line} {verb} skipped."]


def require_names(source: str, names: Collection[str], line: int, comments: Sequence[str]) -> None:
    """Reject a header of numbers, or of too many columns."""
    if len(names) > MOST_COLUMNS:
        raise refusal(source, f"has {len(names)} columns; at most {MOST_COLUMNS} are allowed", line)
    if all(is_number(name) for name in names if name):
        text = "contains numbers instead of column names; add a header row"
        if any(comment.lower().count("theta_") >= 2 for comment in comments):
            text += ", or remove the '#' before the existing one"
        raise refusal(source, text, line)
