"""Tables below each other in one file, each with its header or with a title that says what differs."""

from collections.abc import Sequence
from typing import NamedTuple

from jaxink.measurement.names import meaning
from jaxink.measurement.table import is_number, refusal
from jaxink.measurement.titles import COLUMNS, ROWS, Fact, facts


class NamedRows(NamedTuple):
    """Names of the columns, and number and cells of the rows."""

    names: tuple[str, ...]
    numbers: list[int]
    cells: list[list[str]]


def one_below_the_other(
    source: str, table: NamedRows, titles: Sequence[tuple[int, str]], notes: list[str]
) -> NamedRows:
    """The rows of all tables of a file as one, with a column for each quantity that their titles state.

    Parameters
    ----------
    source
        The file, for messages.
    table
        Header of the first table, and everything below it.
    titles
        Lines above the header.
    notes
        Collects sentences on what was done.

    Raises
    ------
    InputRefusedError
        If the title of one table does not state what those of others do.
    """
    held: dict[str, Fact] = {}
    rows: list[tuple[int, list[str], dict[str, Fact]]] = []
    repeated, stated = 0, dict[str, None]()
    for number, cells in zip(table.numbers, table.cells, strict=True):
        if tuple(cell.strip() for cell in cells) == table.names:
            repeated += 1
            continue
        found = [] if _is_of_numbers(cells) else _facts(source, number, cells)
        if found:
            held = held | {fact.name: fact for fact in found}
            stated |= dict.fromkeys(held)
            continue
        rows.append((number, cells, held))
    own = {meant[0] for name in table.names if (meant := meaning(name)) is not None}
    stated = {name: None for name in stated if name not in own}
    if repeated:
        again = "once" if repeated == 1 else f"{repeated} times"
        notes.append(f"The header is repeated {again} further down; these rows were skipped.")
    if not stated:
        return table._replace(
            numbers=[number for number, _, _ in rows], cells=[cells for _, cells, _ in rows]
        )
    first = {fact.name: fact for number, text in titles for fact in _facts(source, number, [text])}
    full = []
    for number, cells, here in rows:
        known = first | here
        for name in stated:
            if name not in known:
                text = f"no title above states {name}, which others do; add it, as in '{name} = VALUE'"
                raise refusal(source, text, number)
        full.append([*cells, *(known[name].text for name in stated)])
    for name in stated:
        values = dict.fromkeys(cells[len(table.names) + list(stated).index(name)] for cells in full)
        notes.append(f"Tables stand below each other; their titles state {name}: {', '.join(values)}.")
    return NamedRows((*table.names, *stated), [number for number, _, _ in rows], full)


def _is_of_numbers(cells: Sequence[str]) -> bool:
    """Whether a row has values: as many numbers as texts, or more."""
    filled = [cell for cell in cells if cell.strip()]
    return 2 * sum(map(is_number, filled)) >= len(filled)


def _facts(source: str, number: int, cells: Sequence[str]) -> list[Fact]:
    """Quantities that a title states."""
    return [fact for fact in facts(source, number, cells) if fact.name not in (ROWS, COLUMNS)]
