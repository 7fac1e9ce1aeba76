"""Values in a matrix, with angles or wavelengths along two edges, as a table of one row for each value."""

import re
from collections.abc import Collection, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from jaxink.measurement.blocks import Block, Row, blocks_of, cell_at, width
from jaxink.measurement.names import (
    UNITS,
    is_angle,
    is_known_unit,
    meaning,
    other_quantity,
    plain_unit,
    unit_problem,
)
from jaxink.measurement.records import names_a_record
from jaxink.measurement.table import TextTable, is_number, refusal
from jaxink.measurement.titles import COLUMNS, COORDINATES, ROWS, Fact, edge_cell, facts, refuse_other_values

# Of a corner that is divided so, the first name is that of the rows; with other signs it is not known.
_BACKSLASH = re.compile(r"\s*\\\s*")
_DOWN, _ALONG = "↓⇓▼", "→⇒►"
_MOST_SHOWN = 3
# Of light, in a list that could be one of azimuths.
_SHORTEST_NM = 200.0
_MOST_VALUES = 5_000_000
NONE = "the caller states the edges of a matrix, but the file has none with numbers along both; leave it out"


class Edges(NamedTuple):
    """Quantities along the edges of a matrix.

    Parameters
    ----------
    leading
        Names of the columns left of the values: one quantity for a matrix.
    along
        Quantity along the row above the values.
    because
        End of a sentence: who says so, if not the file.
    """

    leading: tuple[str, ...]
    along: str
    because: str

    @property
    def names(self) -> tuple[str, ...]:
        """All of them."""
        return (*self.leading, self.along)


def edges_of(source: str, block: Block, titles: Sequence[Fact], stated: Sequence[str] | None) -> Edges:
    """The quantities along the edges of a matrix.

    Raises
    ------
    InputRefusedError
        If nothing says what one of them is, two say different things, or the unit needs a conversion.
    """
    found: dict[str, dict[str, int]] = {ROWS: {}, COLUMNS: {}}
    for edge, target, unit, line in _told(block, titles):
        if target in COORDINATES:
            is_remark = stated is not None and not is_known_unit(target, unit)
            right = "; if it is right, state both edges: --matrix DOWN,ALONG"
            if not is_remark and (problem := unit_problem(target, unit, right)) is not None:
                raise refusal(source, problem, line, target)
            found[edge].setdefault(target, line)
    for edge, told in found.items():
        if len(told) > 1:
            text = f"the {edge} of the matrix are named {' and '.join(told)}; leave one of the names"
            raise refusal(source, text, block.header[0])
    heads = [block.header[1][j].strip() for j in block.leading]
    for head in heads:
        refuse_other_values(source, head, block.header[0])
        if is_angle(head) and (other := other_quantity("theta_o_deg", head)) is not None:
            raise refusal(source, other.of_column("theta_o_deg"), block.header[0], head)
    of_caller = _stated(source, stated, len(heads))
    rows = next(iter(found[ROWS]), None)
    columns = next(iter(found[COLUMNS]), None)
    for edge, name, given in ((ROWS, rows, of_caller.get(ROWS)), (COLUMNS, columns, of_caller.get(COLUMNS))):
        if None not in (name, given) and name != given:
            text = f"the {edge} of the matrix are {name}, but the caller gives {given}; remove one"
            raise refusal(source, text, block.header[0])
    rows, columns = of_caller.get(ROWS, rows), of_caller.get(COLUMNS, columns)
    because = ", as stated by the caller" if of_caller else ""
    if len(heads) > 1:
        if columns is None:
            raise _unknown(source, block, titles, None, None)
        return Edges(tuple(heads), columns, because)
    if rows is None or columns is None:
        raise _unknown(source, block, titles, rows, columns)
    if rows == columns:
        text = f"both edges of the matrix are named {rows}; name the other one"
        raise refusal(source, text, block.header[0])
    return Edges((rows,), columns, because)


def _stated(source: str, stated: Sequence[str] | None, n_leading: int) -> dict[str, str]:
    """What the caller says, by edge."""
    if stated is None:
        return {}
    names = [name.strip() for name in stated]
    if not 1 <= len(names) <= 2 or any(name not in COORDINATES for name in names):
        text = (
            f"matrix is '{','.join(names)}'; it must be the quantity down the first column and that along "
            f"the row above the values, of {', '.join(COORDINATES)}"
        )
        raise refusal(source, text)
    if n_leading > 1 or len(names) == 1:
        return {COLUMNS: names[-1]}
    return {ROWS: names[0], COLUMNS: names[1]}


def _told(block: Block, titles: Sequence[Fact]) -> Iterator[tuple[str, str, str, int]]:
    """Edge, quantity, unit and line of everything that names an edge."""
    line, header = block.header
    for fact in titles:
        if fact.name in (ROWS, COLUMNS):
            yield fact.name, fact.text, "", fact.line
    if len(block.leading) == 1:
        for edge, (target, unit) in corner(header[block.leading[0]]):
            yield edge, target, unit, line
    for j in block.labels:
        for row_line, cells in block.rows:
            if j < len(cells) and (meant := meaning(cells[j])) is not None:
                yield ROWS, *meant, row_line
    if not any(fact.name in (ROWS, COLUMNS) for fact in titles):
        yield from _labels_above(block)
    yield from _in_cells(COLUMNS, [(line, cell) for cell in header[block.first :]])
    if len(block.leading) == 1:
        j = block.leading[0]
        yield from _in_cells(ROWS, [(row_line, cells[j]) for row_line, cells in block.rows])


def corner(text: str) -> list[tuple[str, tuple[str, str]]]:
    """What a cell at the corner of a matrix says: edge, and quantity with its unit.

    A single name is that of the column below it. Of two, the first is that of the rows if they are divided
    by a backslash, or arrows say which is which; with a slash or a word between them it is not known.
    """
    text = text.strip()
    if "\\" not in text and (meant := meaning(text)) is not None:
        return [(ROWS, meant)]
    if any(sign in text for sign in _DOWN + _ALONG):
        pieces = re.findall(rf"[^{_DOWN}{_ALONG}]+|[{_DOWN}{_ALONG}]", text)
        pieces = [piece.strip(" \\/|,;") for piece in pieces if piece.strip(" \\/|,;")]
        # The arrows stand behind the names, or all before them.
        step = 1 if pieces[0] in _DOWN + _ALONG else -1
        found = []
        for k, piece in enumerate(pieces):
            if piece in _DOWN + _ALONG and 0 <= k + step < len(pieces):
                named = meaning(pieces[k + step])
                if named is not None:
                    found.append((ROWS if piece in _DOWN else COLUMNS, named))
        return found
    parts = _BACKSLASH.split(text)
    named_parts = [meaning(part) for part in parts]
    if len(parts) != 2:
        return []
    return [
        (edge, named) for edge, named in zip((ROWS, COLUMNS), named_parts, strict=True) if named is not None
    ]


def _labels_above(block: Block) -> Iterator[tuple[str, str, str, int]]:
    """Names in the row above the header: over the values that of the columns, left of them that of "
    "the rows.
    """
    if not block.titles:
        return
    line, cells = block.titles[-1]
    filled = [(j, cell) for j, cell in enumerate(cells) if cell.strip()]
    named = [(j, meaning(cell)) for j, cell in filled]
    if len(filled) > 2 or not filled or any(meant is None for _, meant in named):
        return
    sides = [COLUMNS if j >= block.first else ROWS for j, _ in filled]
    if len(set(sides)) < len(sides):
        return
    for edge, (_, meant) in zip(sides, named, strict=True):
        if meant is not None:
            yield edge, *meant, line


def _in_cells(edge: str, cells: Sequence[tuple[int, str]]) -> Iterator[tuple[str, str, str, int]]:
    """Names and units that the cells of an edge contain, such as ``theta_i = 30`` or ``550 nm``."""
    for line, text in cells:
        found = edge_cell(text)
        if found is None:
            continue
        if found.name:
            yield edge, found.name, found.unit, line
        elif plain_unit(found.unit) in UNITS["nm"] and found.unit:
            yield edge, "wavelength_nm", found.unit, line


def _unknown(source: str, block: Block, titles: Sequence[Fact], rows: str | None, columns: str | None) -> Any:
    """Error with what stands along the edges, and how to state what it is."""
    line, header = block.header
    entries = [cell.strip() for cell in header[block.first :] if cell.strip()]
    heads = [header[j].strip() for j in block.leading]
    taken = {fact.name for fact in titles} | {(meaning(head) or ("",))[0] for head in heads}
    along = {columns: 0} if columns else _possible(entries, taken)
    if len(heads) > 1:
        stated: list[tuple[str, ...]] = [(name,) for name in sorted(along, key=lambda name: along[name])]
        text = (
            f"the columns after {', '.join(heads[:4])} are headed {_shown(entries)}, and nothing says what "
            "these numbers are"
        )
    else:
        first_column = [cells[block.leading[0]].strip() for _, cells in block.rows]
        down = {rows: 0} if rows else _possible(first_column, taken)
        pairs = [(d, a) for d in down for a in along if d != a]
        stated = [*sorted(pairs, key=lambda pair: down[pair[0]] + along[pair[1]])]
        said = f"the corner says '{heads[0]}'" if heads[0] else "the corner is empty"
        text = (
            f"the values stand in a matrix with {_shown(first_column)} down and {_shown(entries)} along, "
            f"and {said}, so it is not known which angle or wavelength is along which edge"
        )
    if stated:
        text += f"; state it: {_option(stated[0])}"
    if stated and stated[0][::-1] in stated[1:]:
        text += f", or the other way round: --matrix {','.join(stated[0][::-1])}"
    return refusal(source, text, line)


def _possible(entries: Sequence[str], taken: Collection[str]) -> dict[str, int]:
    """Quantities that the entries of an edge can be, each with its rank, the most usual ones first."""
    values = [
        float(edge.number.replace(",", ".")) for cell in entries if (edge := edge_cell(cell)) is not None
    ]
    low, high = min(values), max(values)
    ranges = {
        "theta_o_deg": (-90, 90),
        "theta_i_deg": (0, 90),
        "phi_deg": (-180, 360),
        "wavelength_nm": (100, 2e4),
    }
    ranks = {name: rank for rank, name in enumerate(ranges)}
    if low >= _SHORTEST_NM:
        ranks["phi_deg"] = len(ranks)
    return {
        name: ranks[name]
        for name, (least, most) in ranges.items()
        if least <= low and high <= most and name not in taken
    }


def _option(names: tuple[str, ...]) -> str:
    shown = names if len(names) > 1 else names[0]
    return f"--matrix {','.join(names)} (in Python: matrix={shown!r})"


def _shown(entries: Sequence[str]) -> str:
    """The first entries of an edge and the last one."""
    if len(entries) <= _MOST_SHOWN + 1:
        return ", ".join(entries)
    return f"{', '.join(entries[:_MOST_SHOWN])}, ..., {entries[-1]}"


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
    above = tuple((line, " ".join(filter(None, row))) for block in blocks for line, row in block.titles)
    header = blocks[0].header[0]
    written = [text for _, text in above] + [cell for block in blocks for cell in block.header[1]]
    is_named = any("phi_deg" in text for text in written)
    return TextTable(
        source,
        names,
        cells,
        lines,
        header,
        (*notes, *told),
        None,
        above,
        is_matrix=True,
        states_phi_deg=is_named,
    )


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
