"""Values in a matrix, with angles or wavelengths along two edges, as a table with one row for each value."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxink.measurement.blocks import Block, Row, blocks_of, cell_at, width
from jaxink.measurement.conditions import names_a_record
from jaxink.measurement.edges import Edges, edges_of
from jaxink.measurement.table import TextTable, is_number, refusal
from jaxink.measurement.titles import Fact, edge_cell, facts

_MOST_VALUES = 5_000_000
NONE = "the caller states the edges of a matrix, but the file has none with numbers along both; leave it out"


def table_of(
    source: str, rows: Sequence[Row], stated: Sequence[str] | None = None, notes: Sequence[str] = ()
) -> TextTable | None:
    """The values of all matrices in the rows of a file, one row for each value; None if there is no matrix.

    Parameters
    ----------
    source
        The file, for messages.
    rows
        Line number and cells of the rows that are not blank.
    stated
        Quantities along the edge of the rows and along that of the columns, or of the latter only, as the
        caller states them.
    notes
        Sentences on what was changed before.

    Raises
    ------
    InputRefusedError
        If it cannot be known what the edges are, or a matrix is not complete.
    """
    blocks = blocks_of(source, rows)
    if not blocks:
        return None
    titles = [_facts(source, block) for block in blocks]
    named = _of_each_block(source, blocks, titles)
    tables = []
    for block, stated_facts, values in zip(blocks, titles, named, strict=True):
        edges = edges_of(source, block, stated_facts, stated)
        for name in values:
            if name in edges.names:
                text = f"the title states {name}, which is along an edge of the matrix, too; remove one"
                raise refusal(source, text, values[name].line)
        tables.append(_expanded(source, block, edges, values))
    names = tables[0][0]
    if any(other != names for other, _, _ in tables):
        raise refusal(
            source, "its matrices have different edges; give each in a file of its own", blocks[-1].header[0]
        )
    _refuse_unnamed_difference(source, blocks, tables)
    cells = tuple(row for _, part, _ in tables for row in part)
    lines = np.array([line for _, _, part in tables for line in part])
    if not cells:
        raise refusal(source, "its matrix has no value", blocks[0].header[0])
    told = _notes(blocks, edges, named, sum(b.empty for b in map(_size, blocks)))
    return TextTable(source, names, cells, lines, blocks[0].header[0], (*notes, *told))


def _facts(source: str, block: Block) -> list[Fact]:
    held = [fact for line, cells in block.titles for fact in facts(source, line, cells)]
    seen: dict[str, Fact] = {}
    for fact in held:
        first = seen.setdefault(fact.name, fact)
        if first.text != fact.text:
            text = (
                f"the title states {fact.name} = {fact.text}, but that in row {first.line} {first.text}; "
                "leave one above each matrix"
            )
            raise refusal(source, text, fact.line)
    return list(seen.values())


def _of_each_block(source: str, blocks: list[Block], titles: list[list[Fact]]) -> list[dict[str, Fact]]:
    """What the titles state of each matrix; what only the first of them states holds for all."""
    each = [{fact.name: fact for fact in held if fact.name not in ("rows", "columns")} for held in titles]
    names = dict.fromkeys(name for held in each for name in held)
    for name in names:
        without = [k for k, held in enumerate(each) if name not in held]
        if without == list(range(1, len(blocks))):
            for held in each[1:]:
                held[name] = each[0][name]
        elif without:
            text = (
                f"the title above this matrix does not state {name}, which others do; add it, as in "
                f"'{name} = VALUE'"
            )
            raise refusal(source, text, blocks[without[0]].header[0])
    return [{name: held[name] for name in names} for held in each]


def _refuse_unnamed_difference(source: str, blocks: list[Block], tables) -> None:
    """Reject matrices of the same directions with other titles, such as those of two samples."""
    seen: dict[tuple[str, ...], int] = {}
    for k, (_, cells, _) in enumerate(tables):
        for *where, _ in cells:
            first = seen.setdefault(tuple(where), k)
            titles = [" ".join(" ".join(row).split()) for row in (_texts(blocks[first]), _texts(blocks[k]))]
            if first == k or titles[0] == titles[1] or all(names_a_record(title) for title in titles):
                continue
            text = (
                f"this matrix and that in row {blocks[first].header[0]} have the same angles, and their "
                f"titles, '{titles[1]}' and '{titles[0]}', do not state a wavelength, an angle or a side "
                "that differs; keep one of them, or name both 'repeat' if they are repeats"
            )
            raise refusal(source, text, blocks[k].header[0])


def _texts(block: Block) -> list[str]:
    return [cell for _, cells in block.titles for cell in cells if cell.strip()]


def _expanded(source: str, block: Block, edges: Edges, values: dict[str, Fact]):
    """Names, cells and lines of one row for each value."""
    end = width(block.header[1])
    along = [edge_cell(cell_at(block.header[1], j)) for j in range(block.first, end)]
    leading = block.leading
    names = (*edges.leading, edges.along, *values, "bsdf_per_sr")
    fixed = tuple(fact.text for fact in values.values())
    cells, lines = [], []
    for line, row in block.rows:
        heads = []
        for j in leading:
            found = edge_cell(cell_at(row, j))
            # A column of texts, such as the side, stays as it is.
            heads.append(cell_at(row, j) if found is None or len(leading) > 1 else found.number)
        if len(leading) == 1 and not is_number(heads[0]):
            raise refusal(
                source, f"'{heads[0]}' on the edge of the matrix is not a number", line, leading[0] + 1
            )
        for j, head in enumerate(along, block.first):
            value = cell_at(row, j)
            if not value:
                continue
            if edge_cell(value) is None or not is_number(value):
                text = (
                    f"'{value}' in the matrix is not a number; empty the cell if nothing was measured there"
                )
                raise refusal(source, text, line, j + 1)
            cells.append((*heads, head.number if head else "", *fixed, value))
            lines.append(line)
    if len(cells) > _MOST_VALUES:
        raise refusal(source, f"its matrix has {len(cells)} values; at most {_MOST_VALUES} are allowed")
    return names, cells, lines


class _Size(NamedTuple):
    rows: int
    columns: int
    empty: int


def _size(block: Block) -> _Size:
    columns = width(block.header[1]) - block.first
    held = sum(bool(cell.strip()) for _, cells in block.rows for cell in cells[block.first :])
    return _Size(len(block.rows), columns, len(block.rows) * columns - held)


def _notes(blocks: list[Block], edges: Edges, named: list[dict[str, Fact]], n_empty: int) -> list[str]:
    sizes = [_size(block) for block in blocks]
    shape = f"{sizes[0].rows} x {sizes[0].columns}"
    many = f"{len(blocks)} matrices, the first one" if len(blocks) > 1 else "a matrix"
    notes = [
        f"The values stand in {many} of {shape}: {' and '.join(edges.leading)} down, {edges.along} along "
        f"row {blocks[0].header[0]}{edges.because}."
    ]
    for name in named[0]:
        told = [held[name] for held in named]
        if len({fact.text for fact in told}) == 1:
            notes.append(
                f"Title row {told[0].line} states {name}: {told[0].text}, read as that of every value."
            )
        else:
            notes.append(f"The titles state {name}: {', '.join(dict.fromkeys(f.text for f in told))}.")
    if n_empty:
        cells = "1 cell" if n_empty == 1 else f"{n_empty} cells"
        notes.append(f"{cells} of the matrix had no value and gave no row.")
    return notes
