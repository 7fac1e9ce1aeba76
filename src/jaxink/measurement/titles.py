"""What the lines above values state: wavelength, side, angles, and what the edges of a matrix are."""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from jaxink.measurement.names import (
    CONVERSIONS,
    SIDES,
    UNITS,
    meaning,
    plain_name,
    plain_unit,
    side_in_words,
    unit_problem,
)
from jaxink.measurement.table import is_number, refusal

# Quantities that a title can state, or the edge of a matrix have.
COORDINATES = ("theta_i_deg", "theta_o_deg", "phi_deg", "phi_i_deg", "phi_o_deg", "wavelength_nm")
ROWS, COLUMNS = "rows", "columns"
# A comma before a digit may be a decimal one.
_PIECES = re.compile(r"[;|\t\n]|,(?!\d)")
_DECORATION = re.compile(r"^[-*=~_]{2,}\s*|\s*(?:[-*=~_]{2,}|[.:])$")
_NUMBER = r"[-+\N{MINUS SIGN}]?(?:\d+(?:[.,]\d*)?|\.\d+)"
_VALUE = re.compile(rf"(?P<name>.*?)[\s=:]*(?P<value>{_NUMBER})\s*(?P<unit>[^\s\d=:]*)\s*")
# A name with its value, and nothing else.
_ALONE = re.compile(
    rf"(?P<name>[^\d=:;,|\t]+?)\s*(?:[=:;,|\t]|\s)\s*(?P<value>{_NUMBER})\s*(?P<unit>[^\s\d=:;,|]*)[;,|\s]*"
)
_SIDE_ALONE = re.compile(r"(?:(?P<name>[^\W\d]+)\s*(?:[=:;,|\t]|\s)\s*)?(?P<side>[^\W\d]+)[;,|\s]*")
_NAMES_OF_SIDE = (
    *("side", "seite", "mode", "modus", "type", "typ", "kind", "art", "geometry", "geometrie"),
    *("measurement", "messung"),
)
_EDGE = {
    ROWS: "rows row lines down vertical zeilen zeile senkrecht lignes ligne filas righe 行",
    COLUMNS: "columns column cols across along horizontal spalten spalte waagerecht colonnes colonne "
    "columnas 列",
}
_WHERE = {word: edge for edge, words in _EDGE.items() for word in words.split()}
_MOST_WORDS = 6


class Fact(NamedTuple):
    """Something that a title states.

    Parameters
    ----------
    name
        A quantity, ``side``, ``rows`` or ``columns``.
    text
        Its value as written; ``R`` or ``T``; the quantity along the rows' or the columns' edge.
    line
        Line of the title.
    """

    name: str
    text: str
    line: int


def facts(source: str, line: int, cells: Sequence[str]) -> list[Fact]:
    """What the cells of a title line state; text that states nothing is a title only.

    Raises
    ------
    InputRefusedError
        If a quantity is in a unit that needs a conversion.
    """
    cells = [_DECORATION.sub("", cell.strip().strip("#").strip()) for cell in cells]
    filled = [cell for cell in cells if cell]
    pieces: list[str] = []
    position = 0
    while position < len(filled):
        cell = filled[position]
        following = filled[position + 1] if position + 1 < len(filled) else ""
        # The name in one cell, its value in the next one.
        is_pair = meaning(cell.rstrip(" :=")) is not None and following
        if is_pair and (is_number(following) or side_in_words(following) or _VALUE.fullmatch(following)):
            pieces.append(f"{cell.rstrip(' :=')}: {following}")
            position += 2
            continue
        pieces += [piece.strip() for piece in _PIECES.split(cell)]
        position += 1
    # A list of numbers states none of them.
    is_list = any(is_number(piece) for piece in pieces)
    return [fact for piece in pieces if piece for fact in _of_piece(source, line, piece, is_list)]


def _of_piece(source: str, line: int, piece: str, is_list: bool) -> Iterator[Fact]:
    if (edge := _edge_statement(piece)) is not None:
        yield Fact(edge[0], edge[1], line)
        return
    refuse_other_values(source, piece, line)
    rest = piece
    found = None if is_list else _VALUE.fullmatch(piece)
    if found is not None:
        named = _named(found["name"])
        unit = found["unit"]
        if named is not None and named[0] in COORDINATES:
            target, own_unit, rest = named
            if (problem := unit_problem(target, unit or own_unit)) is not None:
                raise refusal(source, f"in the title '{piece}' {problem}", line)
            yield Fact(target, found["value"].replace("\N{MINUS SIGN}", "-"), line)
        elif plain_unit(unit) in UNITS["nm"] and _only_sides(found["name"]):
            yield Fact("wavelength_nm", found["value"], line)
            rest = found["name"]
        elif len(found["name"].strip(" :=")) <= 1:
            # T = 23 is no side.
            return
    if (side := side_in_words(rest)) is not None:
        yield Fact("side", side, line)


def refuse_other_values(source: str, text: str, line: int) -> None:
    """Reject a title or a corner that says that the values are no BSDF in 1/sr."""
    meant = meaning(text.strip(" :="))
    if meant is None:
        return
    target, unit = meant
    if target == "sigma_per_sr":
        what = (
            "are standard deviations, which are not read from a matrix; remove it, or write one row "
            "for each value"
        )
        raise refusal(
            source, f"'{text.strip()}' says that the values {what}, with a column sigma_per_sr", line
        )
    if target == "bsdf_per_sr" and (problem := unit_problem(target, unit)) is not None:
        raise refusal(source, problem.replace("the column", "the values").partition(", and name")[0], line)


def stated_alone(title: str) -> tuple[str, str] | None:
    """Wavelength, angle of incidence or side, by its name and as text, of a line that says nothing else.

    Less than `facts` finds: there, titles say what differs between tables, here one may be about something
    else, such as the wavelength of a reference.
    """
    text = _DECORATION.sub("", title.strip().strip("#").strip())
    found = _ALONE.fullmatch(text)
    if found is not None:
        target, own_unit = meaning(found["name"].strip()) or ("", "")
        if target not in ("wavelength_nm", "theta_i_deg"):
            return None
        if unit_problem(target, found["unit"] or own_unit) is not None:
            return None
        return target, found["value"].replace("\N{MINUS SIGN}", "-").replace(",", ".")
    found = _SIDE_ALONE.fullmatch(text)
    if found is not None and (found["name"] or "side").lower() in _NAMES_OF_SIDE:
        side = SIDES.get(found["side"].lower())
        return None if side is None else ("side", side)
    return None


def _named(text: str) -> tuple[str, str, str] | None:
    """Quantity and unit that the last words name, and the words before them."""
    text = text.strip(" :=,")
    words = text.split()
    for first in range(max(0, len(words) - _MOST_WORDS), len(words)):
        if (meant := meaning(" ".join(words[first:]))) is not None:
            return meant[0], meant[1], " ".join(words[:first])
    return None


def _only_sides(text: str) -> bool:
    """Whether a text before a number in nm says nothing, or only what the values are."""
    words = text.strip(" :=@").split()
    names = [word for word in words if word.lower() not in ("at", "bei", "à", "@", "values", "werte")]
    return all(side_in_words(word) or (meaning(word) or ("",))[0] == "bsdf_per_sr" for word in names)


def _edge_statement(piece: str) -> tuple[str, str] | None:
    """``rows`` or ``columns`` and the quantity there, of a text such as "rows: exit angle"."""
    words = re.split(r"[\s:：=()\[\]]+", piece.strip(" :：=()[]"))
    for position in (0, -1):
        edge = _WHERE.get(words[position].lower())
        if edge is None or len(words) < 2:
            continue
        word = words[position]
        text = piece.strip()
        rest = (
            text[len(word) :] if position == 0 else re.sub(rf"[(\[]?\s*{re.escape(word)}\s*[)\]]?$", "", text)
        )
        meant = meaning(rest.strip(" :：="))
        if meant is not None and meant[0] in COORDINATES:
            return edge, meant[0]
    return None


class EdgeCell(NamedTuple):
    """A cell of an edge: its number as text, and what it says of the quantity, if anything."""

    number: str
    name: str
    unit: str


def edge_cell(text: str) -> EdgeCell | None:
    """A number, perhaps with a unit or a name: ``30``, ``30°``, ``theta_i = 30``; None if it is neither."""
    text = text.strip()
    if not text or len(text) > 60:
        return None
    if is_number(text):
        return EdgeCell(text, "", "") if plain_name(text) not in ("nan", "inf", "infinity") else None
    found = _VALUE.fullmatch(text)
    if found is None:
        return None
    unit, name = plain_unit(found["unit"]), found["name"].strip(" :=")
    if unit and not any(unit in words for words in (*UNITS.values(), *CONVERSIONS.values())):
        return None
    meant = meaning(name) if name else ("", "")
    if meant is None or (meant[0] and meant[0] not in COORDINATES):
        return None
    return EdgeCell(found["value"].replace("\N{MINUS SIGN}", "-"), meant[0], found["unit"])
