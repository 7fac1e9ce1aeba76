"""Delimited text files: their cells, a measurement as tidy CSV, and what to do with what is no table."""

import codecs
import csv
import io
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from jaxink.files.reading import read_bounded
from jaxink.files.spreadsheet import cell, comment
from jaxink.files.writing import written_whole
from jaxink.measurement import matrix
from jaxink.measurement.blocks import starts_a_matrix
from jaxink.measurement.dataset import GonioData
from jaxink.measurement.plain_text import as_delimited
from jaxink.measurement.stacked import Below, one_below_the_other
from jaxink.measurement.table import (
    AS_CSV,
    MOST_TITLE_LINES,
    TextTable,
    header_position,
    is_number,
    refusal,
    require_names,
    title_note,
)

_NAMES = ("theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr")
FROM_PYTHON = (
    "load it in Python and hand its table to jaxink.read(DataFrame), or save that with DataFrame.to_csv"
)
FROM_ITS_SOURCE = "ask the program that wrote it for a table as CSV text"
# So much of a file tells text from other content.
_HEAD = 4096
# A few million rows.
_MOST_BYTES = 300_000_000
_SIGNATURES = {
    b"PK": f"is a workbook or zip archive; give an Excel workbook the suffix .xlsx, or {AS_CSV}",
    b"\xd0\xcf\x11\xe0": f"is a workbook of Excel 2003 or older; {AS_CSV}",
    b"%PDF": f"is a PDF document; {FROM_ITS_SOURCE}",
    b"\x89HDF": "is a netCDF or HDF5 file; give it the suffix .nc",
    b"CDF": "is a classic netCDF file; convert it to netCDF 4 and give it the suffix .nc",
}
_DELIMITERS = {",": "commas", ";": "semicolons", "\t": "tabs"}
# Within which a matrix begins, if there is one.
_FIRST_LINES = 300
_UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def write_csv(data: GonioData, path: str | Path, comments: Sequence[str] = ()) -> None:
    """Write the columns of docs/manual/measurement-file.md, one row for each point.

    Parameters
    ----------
    data
        The measurement; masks are not written.
    path
        The file.
    comments
        Lines above the header, without their ``#``.

    Raises
    ------
    InputRefusedError
        If the file cannot be written; an existing one is then unchanged.
    """
    path = Path(path)
    names = _NAMES if data.sigma_per_sr is None else (*_NAMES, "sigma_per_sr")
    columns = [getattr(data, name).tolist() for name in names]
    # Blank cells remain blank.
    columns += [["" if v != v else cell(v) for v in values.tolist()] for values in data.extra.values()]
    with written_whole(path) as part, part.open("w", encoding="utf-8", newline="") as file:
        for line in comments:
            file.write(comment(f"# {' '.join(line.split())}") + "\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*names, *map(cell, data.extra)])
        writer.writerows(zip(*columns, strict=True))


def remedy_for(head: bytes) -> str:
    """What to do with a file that begins so: only what a spreadsheet opens can be saved as CSV there."""
    if is_json(head):
        return FROM_PYTHON
    if is_binary(head):
        return FROM_ITS_SOURCE
    return AS_CSV


def is_json(head: bytes) -> bool:
    """Whether the text begins as JSON."""
    start = head[:_HEAD].lstrip(b"\xef\xbb\xbf \t\r\n")
    return start[:1] == b"{" or (start[:1] == b"[" and start[1:].lstrip()[:1] in (b"{", b"[", b'"'))


def is_binary(head: bytes) -> bool:
    """Whether these are no characters of a text in UTF-8, UTF-16 or Latin-1."""
    part = head[:_HEAD]
    if part.startswith((b"\xff\xfe", b"\xfe\xff")):
        return False
    controls = sum(byte < 32 and byte not in b"\t\n\r\f\x1a\x1b" for byte in part)
    return controls > 0 and controls * 100 >= len(part)


def read_table(path: Path, renamed: Collection[str] = (), edges: Sequence[str] | None = None) -> TextTable:
    """Read a delimited text file without interpreting its cells.

    The file has a header row and cells separated by commas, semicolons or tabs. Text in UTF-16 is recognised
    by its byte-order mark; bytes that are not UTF-8 are read as Windows-1252, which contains Latin-1. The
    file is rejected if it is missing, empty, not text, or if its rows differ in length.

    Parameters
    ----------
    path
        The file.
    renamed
        Names in the file that the caller assigns to known columns.
    edges
        What is along the edges of a matrix, as in `jaxink.measurement.matrix.table_of`.
    """
    notes: list[str] = []
    content = read_bounded(path, _MOST_BYTES, "measurement file")
    written = as_delimited(str(path), lines_of(path, content, notes), notes)
    if not renamed and (table := _matrix(path, written, edges, notes)) is not None:
        return table
    if edges is not None:
        raise refusal(path, matrix.NONE)
    lines, comments = _without_comments(written, notes)
    filled = [number for number, line in enumerate(lines) if line.strip()]
    if not filled:
        kind = "contains only comments" if comments else "is empty"
        raise refusal(path, f"{kind}; it must have a header row and data rows")
    filled = filled[_header(path, lines, filled, renamed) :]
    notes += title_note([n for n, line in enumerate(lines[: filled[0]], 1) if line.strip()], filled[0] + 1)
    titles = comments | {n: line.strip() for n, line in enumerate(lines[: filled[0]], 1) if line.strip()}
    # Emptied rather than removed, to keep the line numbers of the file.
    lines[: filled[0]] = [""] * filled[0]
    if any(not lines[number].strip() for number in range(filled[0], filled[-1])):
        notes.append("Blank or comment lines between the rows were skipped; row numbers count them.")
    delimiter = _delimiter(path, lines, filled[0], notes)
    numbers, rows = _parsed(path, lines, delimiter)
    if not rows:
        raise refusal(path, "contains only separators; it must have a header row and data rows")
    header, *rows = rows
    names = tuple(name.strip() for name in header)
    require_names(str(path), names, numbers[0], list(comments.values()))
    lines_below = list(zip(numbers[1:], rows, strict=True))
    below = one_below_the_other(str(path), names, lines_below, titles, notes)
    if not below.cells:
        raise refusal(path, "has a header but no data rows")
    _of_equal_length(path, len(names), below, delimiter, notes)
    above = tuple(sorted((number, text) for number, text in titles.items() if number < numbers[0]))
    where = np.array(below.numbers)
    return TextTable(
        str(path), (*names, *below.stated), below.rows(), where, numbers[0], tuple(notes), titles=above
    )


def _matrix(path: Path, lines: list[str], edges: Sequence[str] | None, notes: list[str]) -> TextTable | None:
    """The values of a matrix, if the file has one with one of the delimiters."""
    for delimiter, name in _DELIMITERS.items():
        first = [row for row in _split(lines[:_FIRST_LINES], delimiter) if row[1]]
        if not starts_a_matrix(first):
            continue
        told = (
            [*notes, f"The columns are separated by {name} instead of commas."] if delimiter != "," else notes
        )
        return matrix.table_of(str(path), _split(lines, delimiter), edges, told)
    return None


def _split(lines: Sequence[str], delimiter: str) -> list[tuple[int, list[str]]]:
    """Line number and cells of the lines that are not blank; what a comment says can be a title."""
    filled = [(number, line) for number, line in enumerate(lines, 1) if line.strip(f" \r{delimiter}")]
    # One line each: a quotation mark of a title must not swallow what follows.
    return [
        (number, next(csv.reader([line.lstrip(" #")], delimiter=delimiter), [])) for number, line in filled
    ]


def _header(path: Path, lines: list[str], filled: list[int], renamed: Collection[str]) -> int:
    first = filled[:MOST_TITLE_LINES]
    delimiter = _of_rows([lines[number] for number in filled])
    cells = [
        (plain := lines[number].replace('"', "")).split(delimiter or _most_frequent(plain))
        for number in first
    ]
    return header_position(str(path), cells, [number + 1 for number in first], renamed)


def lines_of(path: str | Path, content: bytes, notes: list[str]) -> list[str]:
    """Lines of the text that a file contains, whatever its encoding and its line ends; notes say what it has.

    Raises
    ------
    InputRefusedError
        If the content is not text.
    """
    for signature, sentence in _SIGNATURES.items():
        if content.startswith(signature):
            raise refusal(path, sentence)
    if is_json(content):
        raise refusal(path, f"is JSON, not a table; {FROM_PYTHON}")
    text = _decoded(path, content, notes)
    if "\0" in text:
        row = text[: text.index("\0")].count("\n") + 1
        raise refusal(
            path, f"contains a zero byte; it is a binary file, not CSV text; {FROM_ITS_SOURCE}", row
        )
    return io.StringIO(text.replace("\N{MINUS SIGN}", "-"), newline=None).read().split("\n")


def _decoded(path: str | Path, content: bytes, notes: list[str]) -> str:
    """Text of a file, with a note on any encoding but plain UTF-8."""
    if content.startswith(_UTF16):
        notes.append("The file is UTF-16 text.")
        try:
            return content.decode("utf-16")
        except UnicodeDecodeError:
            raise refusal(path, f"begins like UTF-16 text, but is not; {AS_CSV}") from None
    if content.startswith(codecs.BOM_UTF8):
        notes.append("The byte-order mark at the start of the file was ignored.")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        row = content[: problem.start].count(b"\n") + 1
    try:
        text = content.removeprefix(codecs.BOM_UTF8).decode("cp1252")
    except UnicodeDecodeError as problem:
        row, byte = content[: problem.start].count(b"\n") + 1, content[problem.start]
        remedy = remedy_for(content)
        sentence = f"byte 0x{byte:02x} is neither UTF-8 nor Latin-1 text; {remedy}"
        raise refusal(path, sentence, row) from None
    notes.append(f"The file is not UTF-8 (first in row {row}) and was read as Latin-1 (Windows-1252).")
    return text


def _without_comments(lines, notes):
    """Comment lines are emptied rather than removed, to keep the line numbers of the file."""
    comments = {
        number: "# " + line.strip(" #\t\r")
        for number, line in enumerate(lines, 1)
        if line.lstrip().startswith("#")
    }
    if comments:
        plural, verb = ("lines", "were") if len(comments) > 1 else ("line", "was")
        notes.append(f"{len(comments)} comment {plural} starting with '#' {verb} skipped.")
    return ["" if line.lstrip().startswith("#") else line for line in lines], comments


def _of_rows(lines: Sequence[str]) -> str | None:
    """The delimiter by which the most lines are rows of numbers; None without such rows."""
    found = {
        delimiter: sum(_is_of_numbers(line.split(delimiter)) for line in lines[:MOST_TITLE_LINES])
        # Numbers with decimal commas are numbers with the others, too.
        for delimiter in (";", "\t", ",")
    }
    best = max(found, key=lambda delimiter: found[delimiter])
    return best if found[best] else None


def _is_of_numbers(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell.strip()]
    return len(filled) > 1 and 2 * sum(map(is_number, filled)) > len(filled)


def _most_frequent(line: str) -> str:
    return max(_DELIMITERS, key=line.count)


def _delimiter(path, lines: Sequence[str], position: int, notes: list[str]) -> str:
    header, row = lines[position], position + 1
    delimiter = _of_rows([line for line in lines[position + 1 :] if line.strip()]) or _most_frequent(header)
    if delimiter not in header:
        delimiter = _most_frequent(header)
    if delimiter not in header:
        text = "the header contains no comma, semicolon or tab; separate the columns by commas"
        raise refusal(path, text, row)
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


def _of_equal_length(path, n: int, below: Below, delimiter: str, notes: list[str]) -> None:
    """Drop empty cells beyond the header; rows of another length are rejected."""
    cut = 0
    for k, (number, row) in enumerate(zip(below.numbers, below.cells, strict=True)):
        if len(row) > n and not any(cell.strip() for cell in row[n:]):
            below.cells[k], cut = row[:n], cut + 1
        if len(below.cells[k]) != n:
            raise refusal(path, _other_length(row, n, delimiter), number)
    if cut:
        rows = "1 row ends" if cut == 1 else f"{cut} rows end"
        notes.append(f"{rows} with an empty cell beyond the header, which was ignored.")


def _other_length(row: list[str], n: int, delimiter: str) -> str:
    """What is wrong with a row of more or fewer cells than the header."""
    cells = "1 cell" if len(row) == 1 else f"{len(row)} cells"
    text = f"has {cells}, but the header has {n}"
    if len(row) < n:
        return f"{text}; a cell that is empty still needs its separator"
    if delimiter == ",":
        text += "; if it has decimal commas, separate the columns by semicolons, or write 0.5 instead of 0,5"
    return text
