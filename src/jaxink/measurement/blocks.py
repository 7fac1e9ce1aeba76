"""Where in the rows of a file matrices of values are, and what stands above and beside them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxink.measurement.names import meaning
from jaxink.measurement.table import is_number, refusal
from jaxink.measurement.titles import edge_cell

# The first matrix begins within so many filled lines; fewer angles along an edge are no matrix.
_MOST_TITLE_LINES, _FEWEST = 100, 2
_FEWEST_NAMES = 3
Row = tuple[int, list[str]]


class Block(NamedTuple):
    """A matrix in the rows of a file.

    Parameters
    ----------
    titles
        The rows above it, down from the block before.
    header
        Its row with the edge of the columns.
    first
        Position of the first value in each row; left of it are the edge of the rows, and other columns.
    labels
        Positions of columns left of the values that have no value for each row, such as a label of the edge.
    rows
        The rows with values.
    """

    titles: list[Row]
    header: Row
    first: int
    labels: tuple[int, ...]
    rows: list[Row]

    @property
    def leading(self) -> list[int]:
        """Positions of the columns that say where each row is."""
        return [j for j in range(self.first) if j not in self.labels]


def starts_a_matrix(rows: Sequence[Row]) -> bool:
    """Whether a matrix begins within the first rows of a file, which has no header of named columns."""
    if any(_is_header(cells) for _, cells in rows[:_MOST_TITLE_LINES]):
        return False
    if _has_numeric_corner(rows) or _side_by_side(rows) is not None:
        return True
    return any(_first_value(rows, k) is not None for k in range(min(len(rows), _MOST_TITLE_LINES)))


def _is_header(cells: Sequence[str]) -> bool:
    """Whether a row names several columns, one of which has the values."""
    if len(cells) < _FEWEST_NAMES or any(is_number(cell) for cell in cells[-2:]):
        return False
    meant = [found[0] for cell in cells if (found := meaning(cell)) is not None]
    return len(meant) >= _FEWEST_NAMES and "bsdf_per_sr" in meant


def blocks_of(source: str, rows: Sequence[Row]) -> list[Block]:
    """The matrices of a file, in its order; empty if there is none.

    Raises
    ------
    InputRefusedError
        If a row of values is longer than the edge above it or belongs to no matrix, or matrices stand side by
        side.
    """
    if not starts_a_matrix(rows):
        return []
    if (beside := _side_by_side(rows)) is not None:
        text = f"{beside[1]} matrices stand side by side; put them one below the other, each with its title"
        raise refusal(source, text, beside[0])
    if _has_numeric_corner(rows):
        return [_block(source, [], rows[0], 1, list(rows[1:]))]
    blocks: list[Block] = []
    titles: list[Row] = []
    k = 0
    while k < len(rows):
        first = _first_value(rows, k) if blocks or k < _MOST_TITLE_LINES else None
        if first is None:
            if blocks:
                _refuse_stray_values(source, rows[k])
            titles.append(rows[k])
            k += 1
            continue
        header, k = rows[k], k + 1
        taken = [rows[k]]
        k += 1
        while k < len(rows) and _is_continued(rows, k, first):
            taken.append(rows[k])
            k += 1
        blocks.append(_block(source, titles, header, first, taken))
        titles = []
    return blocks


def _first_value(rows: Sequence[Row], k: int) -> int | None:
    """Position of the first value of a matrix whose header is this row; None if it is not one."""
    if k + 1 >= len(rows):
        return None
    cells, below = rows[k][1], rows[k + 1][1]
    end = width(cells)
    first = end
    while first > 0 and edge_cell(cells[first - 1]) is not None:
        first -= 1
    n = end - first
    if n < _FEWEST or first < 1 or not _is_monotonic(cells[first:end]):
        return None
    # Rows of values have numbers there, too.
    if any(edge_cell(cell) is not None for cell in cells[:first]):
        return None
    if (
        first > 1
        and not any(_is_coordinate(cell) for cell in cells[:first])
        and not _only_text(cells[:first])
    ):
        return None
    return first if _is_data(below, first) and not _has_values(cells[:first]) else None


def _only_text(cells: Sequence[str]) -> bool:
    """Whether at most one cell has a text, as the corner of a matrix that stands to the right."""
    return sum(bool(cell.strip()) for cell in cells) <= 1


def _has_values(leading: Sequence[str]) -> bool:
    """Whether the values are in a column of their own; a number as the name of another one is an accident."""
    return len(leading) > 1 and any((meaning(cell) or ("",))[0] == "bsdf_per_sr" for cell in leading)


def _has_numeric_corner(rows: Sequence[Row]) -> bool:
    """Whether the whole file is a matrix of numbers only, whose first row and column ascend or descend."""
    widths = {width(cells) for _, cells in rows}
    if len(rows) <= _FEWEST or len(widths) != 1 or min(widths) <= _FEWEST:
        return False
    if not all(is_number(cell) for _, cells in rows for cell in cells[: width(cells)]):
        return False
    return _is_monotonic(rows[0][1][1:]) and _is_monotonic([cells[0] for _, cells in rows[1:]])


def _is_coordinate(cell: str) -> bool:
    return meaning(cell) is not None


def _is_continued(rows: Sequence[Row], k: int, first: int) -> bool:
    """Whether a row belongs to the matrix above; the header of the next one does not."""
    return _is_data(rows[k][1], first) and _first_value(rows, k) is None


def _is_data(cells: Sequence[str], first: int) -> bool:
    """A number on the edge, and numbers or nothing right of it."""
    if width(cells) <= first or edge_cell(cells[first - 1]) is None and not _has_edge(cells[:first]):
        return False
    values = [cell for cell in cells[first : width(cells)] if cell.strip()]
    return sum(is_number(cell) for cell in values) * 2 >= len(values) > 0


def _has_edge(leading: Sequence[str]) -> bool:
    return len(leading) > 1 and any(edge_cell(cell) is not None for cell in leading)


def width(cells: Sequence[str]) -> int:
    """Number of cells up to the last one that is not empty."""
    return max((j + 1 for j, cell in enumerate(cells) if cell.strip()), default=0)


def _is_monotonic(cells: Sequence[str]) -> bool:
    values = [
        float(found.number.replace(",", ".")) for cell in cells if (found := edge_cell(cell)) is not None
    ]
    steps = np.diff(values)
    return bool((steps > 0).all() or (steps < 0).all())


def _side_by_side(rows: Sequence[Row]) -> tuple[int, int] | None:
    """Line with the edges of several matrices next to each other, and how many they are."""
    for (line, cells), (_, below) in zip(rows[:_MOST_TITLE_LINES], rows[1:], strict=False):
        is_value = [is_number(cell) for cell in cells]
        starts = [j for j, here in enumerate(is_value) if here and not (j and is_value[j - 1])]
        ends = [next((k for k in range(j, len(cells)) if not is_value[k]), len(cells)) for j in starts]
        if len(starts) < 2 or starts[0] == 0 or len(below) < ends[-1]:
            continue
        # Left of each edge stands that of the rows below.
        if all(
            end - start >= _FEWEST
            and _is_monotonic(cells[start:end])
            and all(is_number(cell) for cell in below[start - 1 : end])
            for start, end in zip(starts, ends, strict=True)
        ):
            return line, len(starts)
    return None


def _refuse_stray_values(source: str, row: Row) -> None:
    """Reject a row of values below a matrix that does not belong to it."""
    cells = [cell for cell in row[1] if cell.strip()]
    if sum(is_number(cell) for cell in cells) >= 3:
        text = (
            "has values, but belongs to no matrix; a matrix has its angles in the row above and in "
            "its first column"
        )
        raise refusal(source, text, row[0])


def _block(source: str, titles: list[Row], header: Row, first: int, rows: list[Row]) -> Block:
    end = width(header[1])
    for line, cells in rows:
        if width(cells) > end:
            text = (
                f"has {width(cells) - first} values, but the edge in row {header[0]} has "
                f"{end - first} entries"
            )
            raise refusal(source, text, line)
    labels = tuple(j for j in range(first) if _is_label(j, header, rows))
    return Block(titles, header, first, labels, rows)


def _is_label(column: int, header: Row, rows: list[Row]) -> bool:
    """Whether a column left of the values is empty, or has no more than one text."""
    if cell_at(header[1], column):
        return False
    held = [text for _, cells in rows if (text := cell_at(cells, column))]
    return not held or (len(held) == 1 and edge_cell(held[0]) is None)


def cell_at(cells: Sequence[str], column: int) -> str:
    """A cell without white space; empty beyond the end of the row."""
    return cells[column].strip() if column < len(cells) else ""
