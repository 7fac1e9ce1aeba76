"""Tables separated by spaces, or with the header in a comment, as `numpy.savetxt` writes them."""

from collections.abc import Sequence

from jaxink.measurement.names import meaning
from jaxink.measurement.table import is_number, refusal

_DELIMITERS = ",;\t"
# So many names of a comment must be known for it to be a header.
_FEWEST_NAMES = 2


def as_delimited(source: str, lines: Sequence[str], notes: list[str]) -> list[str]:
    """Lines of a text file with its header out of its comment, and with commas in place of spaces.

    All lines as they are, unless the line above the first row of numbers has a name for each of its cells.

    Parameters
    ----------
    source
        The file, for messages.
    lines
        Its lines.
    notes
        Collects sentences on what was done.

    Raises
    ------
    InputRefusedError
        If a row has more or fewer words than the header.
    """
    filled = [k for k, line in enumerate(lines) if line.strip()]
    rows = [k for k in filled if not _is_comment(lines[k])]
    first = next((k for k in rows if _is_of_numbers(_cells(lines[k]))), None)
    above = None if first is None else max((k for k in filled if k < first), default=None)
    if first is None or above is None:
        return list(lines)
    n = len(_cells(lines[first]))
    header = _header(lines[above].lstrip(" #"), n)
    found = list(lines)
    if header is None or not _is_header(header, _is_comment(lines[above])):
        return found
    below = [k for k in rows if k >= first]
    by_spaces = not any(delimiter in lines[first] for delimiter in _DELIMITERS)
    if by_spaces and any(delimiter in lines[k] for k in below for delimiter in _DELIMITERS):
        return found
    if by_spaces:
        for k in below:
            words = lines[k].split()
            if len(words) != n:
                text = f"has {len(words)} words, but the header has {n}; separate the columns by commas"
                raise refusal(source, text, k + 1)
            found[k] = ",".join(words)
        notes.append("The columns are separated by spaces instead of commas.")
    delimiter = "," if by_spaces else max(_DELIMITERS, key=lines[first].count)
    if _is_comment(lines[above]):
        notes.append(f"The comment in row {above + 1} is the header.")
    elif not by_spaces:
        return found
    found[above] = delimiter.join(header)
    return found


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#")


def _cells(line: str) -> list[str]:
    """Cells by the most frequent delimiter, or by spaces."""
    delimiter = max(_DELIMITERS, key=line.count)
    return [cell.strip() for cell in line.split(delimiter)] if delimiter in line else line.split()


def _is_of_numbers(cells: Sequence[str]) -> bool:
    return len(cells) > 1 and 2 * sum(map(is_number, cells)) > len(cells)


def _header(line: str, n: int) -> list[str] | None:
    """The line in ``n`` cells, by a delimiter or by spaces."""
    ways = [_cells(line), line.split()]
    return next((cells for cells in ways if len(cells) == n), None)


def _is_header(cells: Sequence[str], of_comment: bool) -> bool:
    """Whether cells are names; those of a comment need to be known ones."""
    if is_number(cells[0]) or not all(cells):
        return False
    if not of_comment:
        return True
    known = sum(meaning(cell) is not None for cell in cells)
    return known >= min(_FEWEST_NAMES, len(cells)) and not any(map(is_number, cells))
