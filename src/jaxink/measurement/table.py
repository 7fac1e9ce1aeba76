"""The text of a measurement file as a table of cells, with the line number of each row."""

import codecs
import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded, utf8_text

# A few million rows.
_MOST_BYTES = 300_000_000
# Every column that is kept becomes a variable of the result.
_MOST_COLUMNS = 1000

_SIGNATURES = {
    b"PK": "is a spreadsheet or zip archive; export it as CSV",
    b"\x89HDF": "is a netCDF or HDF5 file; give it the suffix .nc",
    b"CDF": "is a classic netCDF file; convert it to netCDF 4 and give it the suffix .nc",
}
_DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs"}


@dataclass(frozen=True)
class TextTable:
    """Cells of a delimited text file.

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
    """

    source: str
    names: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: np.ndarray
    header_line: int
    notes: tuple[str, ...]

    def column(self, index: int) -> list[str]:
        """Cells of one column, stripped of white space."""
        return [row[index].strip() for row in self.rows]


def refusal(source, text, row=None, column=None) -> InputRefusedError:
    """Error with a message that names file, row and column before the text."""
    place = [str(source)]
    if row is not None:
        place.append(f"row {row}")
    if column is not None:
        place.append(f"column {column}")
    return InputRefusedError(f"{', '.join(place)}: {text}.")


def read_table(path) -> TextTable:
    """Read a delimited text file without interpreting its cells.

    The file is UTF-8 text with a header row and cells separated by commas, semicolons or tabs. It is rejected
    if it is missing, empty, not text, or if its rows differ in length.
    """
    path = Path(path)
    notes: list[str] = []
    lines, comments = _without_comments(_decoded_lines(path, notes), notes)
    filled = [number for number, line in enumerate(lines) if line.strip()]
    if not filled:
        kind = "contains only comments" if comments else "is empty"
        raise refusal(path, f"{kind}; it must have a header row and data rows")
    if any(not lines[number].strip() for number in range(filled[0], filled[-1])):
        notes.append("Blank or comment lines between the rows were skipped; row numbers count them.")
    delimiter = _delimiter(path, lines[filled[0]], filled[0] + 1, notes)
    numbers, rows = _parsed(path, lines, delimiter)
    if not rows:
        raise refusal(path, "contains only separators; it must have a header row and data rows")
    header, *rows = rows
    if len(header) > _MOST_COLUMNS:
        raise refusal(path, f"has {len(header)} columns; at most {_MOST_COLUMNS} are allowed", numbers[0])
    _check_lengths(path, header, rows, numbers[1:], delimiter)
    names = tuple(name.strip() for name in header)
    _check_header(path, names, numbers[0], comments)
    if not rows:
        raise refusal(path, "has a header but no data rows")
    cells = tuple(tuple(row) for row in rows)
    return TextTable(str(path), names, cells, np.array(numbers[1:]), numbers[0], tuple(notes))


def _decoded_lines(path: Path, notes: list[str]) -> list[str]:
    content = read_bounded(path, _MOST_BYTES, "measurement file")
    for signature, sentence in _SIGNATURES.items():
        if content.startswith(signature):
            raise refusal(path, sentence)
    if content.startswith(codecs.BOM_UTF8):
        notes.append("The byte-order mark at the start of the file was ignored.")
    text = utf8_text(content, str(path))
    if "\0" in text:
        row = text[: text.index("\0")].count("\n") + 1
        raise refusal(path, "contains a zero byte; it is a binary file, not CSV text", row)
    return io.StringIO(text, newline=None).read().split("\n")


def _without_comments(lines, notes):
    """Comment lines are emptied rather than removed, to keep the line numbers of the file."""
    comments = [line for line in lines if line.lstrip().startswith("#")]
    if comments:
        plural, verb = ("lines", "were") if len(comments) > 1 else ("line", "was")
        notes.append(f"{len(comments)} comment {plural} starting with '#' {verb} skipped.")
    return ["" if line.lstrip().startswith("#") else line for line in lines], comments


def _delimiter(path, header: str, row: int, notes: list[str]) -> str:
    counts = {delimiter: header.count(delimiter) for delimiter in _DELIMITERS}
    delimiter = max(counts, key=lambda delimiter: counts[delimiter])
    if counts[delimiter] == 0:
        raise refusal(path, "the header contains no comma; separate the columns by commas", row)
    if delimiter != ",":
        notes.append(f"The columns are separated by {_DELIMITERS[delimiter]} instead of commas.")
    return delimiter


def _parsed(path, lines, delimiter) -> tuple[list[int], list[list[str]]]:
    numbers, rows = [], []
    reader = csv.reader(lines, delimiter=delimiter, strict=True)
    try:
        for row in reader:
            if any(cell.strip() for cell in row):
                numbers.append(reader.line_num)
                rows.append(row)
    except csv.Error as error:
        raise refusal(path, f"is not CSV text ({error})", reader.line_num) from error
    return numbers, rows


def _check_lengths(path, header, rows, numbers, delimiter):
    for number, row in zip(numbers, rows, strict=True):
        if len(row) == len(header):
            continue
        hint = ""
        if delimiter == "," and len(row) > len(header):
            hint = "; if it has decimal commas, write 0.5 instead of 0,5"
        text = f"has {len(row)} cells, but the header has {len(header)}{hint}"
        raise refusal(path, text, number)


def _check_header(path, names, line, comments):
    if all(_is_number(name) for name in names if name):
        text = "contains numbers instead of column names; add a header row"
        if any(comment.lower().count("theta_") >= 2 for comment in comments):
            text += ", or remove the '#' before the existing one"
        raise refusal(path, text, line)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
