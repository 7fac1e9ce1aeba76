"""Where the header of a table is: below the lines of a title, if there are any."""

from collections.abc import Collection, Sequence

from jaxink.measurement.names import meaning
from jaxink.measurement.table import MOST_COLUMNS, is_number, refusal

# Titles are shorter.
MOST_TITLE_LINES = 100
# So many known names make a header, and so many numbers a row of values.
_NAMES, _VALUES = 2, 3


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
        return 0
    position = counts.index(best)
    for row, line in zip(first[:position], lines, strict=False):
        if sum(is_number(cell) for cell in row) >= _VALUES:
            text = f"contains values, but is above the header in row {lines[position]}; put the header first"
            raise refusal(source, text, line)
    return position


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
