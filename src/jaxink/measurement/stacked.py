"""Tables below each other in one file, each with its header or with a title that says what differs."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from jaxink.errors import InputRefusedError
from jaxink.measurement.names import meaning
from jaxink.measurement.records import names_a_record
from jaxink.measurement.table import is_number, refusal
from jaxink.measurement.titles import COLUMNS, ROWS, Fact, facts


class Row(NamedTuple):
    """A row of values: its number and cells, what titles above it state, and their other texts."""

    number: int
    cells: list[str]
    stated: dict[str, str]
    texts: tuple[str, ...]


class Below(NamedTuple):
    """The rows below the first header of a file, and a text for each row of what titles state."""

    numbers: list[int]
    cells: list[list[str]]
    stated: dict[str, list[str]]

    def rows(self) -> tuple[tuple[str, ...], ...]:
        """The cells of each row, and behind them what titles state."""
        return tuple(
            (*cells, *(texts[k] for texts in self.stated.values())) for k, cells in enumerate(self.cells)
        )


def one_below_the_other(
    source: str,
    names: tuple[str, ...],
    lines: Sequence[tuple[int, list[str]]],
    titles: Mapping[int, str],
    notes: list[str],
) -> Below:
    """The rows of all tables of a file, and what the title of each says of them.

    Parameters
    ----------
    source
        The file, for messages.
    names
        Header of the first table.
    lines
        Number and cells of the lines below it.
    titles
        By number, lines above it, and comments.
    notes
        Collects sentences on what was done.

    Raises
    ------
    InputRefusedError
        If a title does not state what those of others do, or it is not known in what tables differ.
    """
    repeated = [number for number, cells in lines if _is_header(cells, names)]
    rows = list(_rows(source, names, lines, titles))
    if repeated:
        again = "once" if len(repeated) == 1 else f"{len(repeated)} times"
        notes.append(f"The header is repeated {again} further down; these rows were skipped.")
    _refuse_unnamed_difference(source, names, rows)
    own = {meant[0] for name in names if (meant := meaning(name)) is not None}
    varied = dict.fromkeys(name for row in rows for name in row.stated if name not in own)
    # What stands above a single table is read only where it is asked for.
    if not any(row.stated != rows[0].stated for row in rows):
        varied = {}
    stated: dict[str, list[str]] = {}
    for name in varied:
        for row in rows:
            if name not in row.stated:
                text = f"no title above states {name}, which others do; add it, as in '{name} = VALUE'"
                raise refusal(source, text, row.number)
        stated[name] = [row.stated[name] for row in rows]
        values = ", ".join(dict.fromkeys(stated[name]))
        notes.append(f"Tables stand below each other; their titles state {name}: {values}.")
    return Below([row.number for row in rows], [row.cells for row in rows], stated)


def facts_of_title(source: str, number: int, text: str) -> list[Fact]:
    """Quantities that a line above a table states; nothing if it is not clear."""
    try:
        found = facts(source, number, [text])
    except InputRefusedError:
        return []
    return [fact for fact in found if fact.name not in (ROWS, COLUMNS)]


def _rows(
    source: str, names: tuple[str, ...], lines: Sequence[tuple[int, list[str]]], titles: Mapping[int, str]
) -> Iterator[Row]:
    held = sorted([*lines, *((number, [text]) for number, text in titles.items())])
    state: dict[str, str] = {}
    texts: tuple[str, ...] = ()
    # Lines since the last row, whether they state something, and those that only a title explains.
    waiting, is_told, odd = list[str](), False, list[tuple[int, list[str]]]()
    for number, cells in held:
        if _is_header(cells, names):
            odd = []
        elif number in titles or _is_title(cells, names):
            text = " ".join(cell.strip() for cell in cells if cell.strip())
            found = facts_of_title(source, number, text)
            state = state | {fact.name: fact.text for fact in found}
            is_told |= bool(found)
            waiting += [] if found else [text]
            odd += [] if number in titles else [(number, cells)]
        else:
            if odd and not is_told:
                raise _no_row(source, *odd[0], names)
            texts = tuple(waiting) if waiting or is_told else texts
            waiting, is_told, odd = [], False, []
            yield Row(number, cells, state, texts)
    if odd and not is_told:
        raise _no_row(source, *odd[0], names)


def _is_header(cells: Sequence[str], names: tuple[str, ...]) -> bool:
    return tuple(cell.strip() for cell in cells) == names


def _is_title(cells: Sequence[str], names: tuple[str, ...]) -> bool:
    """Whether a line is no row of values: mostly text, in fewer cells than the header has."""
    filled = [cell for cell in cells if cell.strip()]
    is_row = len(cells) == len(names) and len(filled) > 1
    return not is_row and 2 * sum(map(is_number, filled)) < len(filled)


def _no_row(source: str, number: int, cells: Sequence[str], names: tuple[str, ...]) -> InputRefusedError:
    n = "1 cell" if len(cells) == 1 else f"{len(cells)} cells"
    text = (
        f"has {n}, but the header has {len(names)}; if it is a title of the rows below, remove it, and add a "
        "column with what it says to all rows; if it is a remark, remove it"
    )
    return refusal(source, text, number)


def _refuse_unnamed_difference(source: str, names: tuple[str, ...], rows: Sequence[Row]) -> None:
    """Reject tables of the same directions with other titles, such as those of two samples."""
    meant = [(meaning(name) or ("",))[0] for name in names]
    if "theta_o_deg" not in meant or len({row.texts for row in rows}) < 2:
        return
    where = [k for k, target in enumerate(meant) if target not in ("bsdf_per_sr", "sigma_per_sr")]
    seen: dict[tuple, Row] = {}
    for row in rows:
        key = (*(row.cells[k] for k in where if k < len(row.cells)), *sorted(row.stated.items()))
        first = seen.setdefault(key, row)
        new = [text for text in row.texts if text not in first.texts]
        old = [text for text in first.texts if text not in row.texts]
        if new and old and not all(map(names_a_record, (*new, *old))):
            text = (
                f"this row and row {first.number} have the same angles, and what stands above, "
                f"'{new[0]}' and '{old[0]}', is no wavelength, angle or side; add a column with it, or keep "
                "one of the tables"
            )
            raise refusal(source, text, row.number)
