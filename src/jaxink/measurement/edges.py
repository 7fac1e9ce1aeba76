"""What the two edges of a matrix of values are: from its corner, labels, titles, or the caller."""

import re
from collections.abc import Collection, Iterator, Sequence
from typing import Any, NamedTuple

from jaxink.measurement.blocks import Block
from jaxink.measurement.names import meaning, unit_problem
from jaxink.measurement.table import refusal
from jaxink.measurement.titles import COLUMNS, COORDINATES, ROWS, Fact, edge_cell, refuse_other_values
from jaxink.measurement.units import UNITS, plain_unit

# Of a corner that is divided so, the first name is that of the rows; with other signs it is not known.
_BACKSLASH = re.compile(r"\s*\\\s*")
_DOWN, _ALONG = "↓⇓▼", "→⇒►"
_MOST_SHOWN = 3
# Of light, in a list that could be one of azimuths.
_SHORTEST_NM = 200.0


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
            if (problem := unit_problem(target, unit)) is not None:
                raise refusal(source, problem, line, target)
            found[edge].setdefault(target, line)
    for edge, told in found.items():
        if len(told) > 1:
            text = f"the {edge} of the matrix are named {' and '.join(told)}; leave one of the names"
            raise refusal(source, text, block.header[0])
    heads = [block.header[1][j].strip() for j in block.leading]
    for head in heads:
        refuse_other_values(source, head, block.header[0])
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
