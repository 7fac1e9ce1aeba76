"""Which sheets of a workbook are read, and their sides."""

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from jaxink.errors import InputRefusedError
from jaxink.measurement.table import refusal

# A name, several with commas, each perhaps with its side; or these as a list, or as sides by name.
Wanted = str | Sequence[str] | Mapping[str, str]


class Sheet(NamedTuple):
    """A sheet to read.

    Parameters
    ----------
    name
        Its name.
    side
        ``R`` or ``T`` as the caller states it for the sheet; None if not.
    """

    name: str
    side: str | None


def wanted_of(sheet: Any) -> Wanted | None:
    """What the caller gives, if it can be names of sheets."""
    names = [sheet] if isinstance(sheet, str) or sheet is None else sheet
    sides = list(names.values()) if isinstance(names, Mapping) else []
    if not isinstance(names, Collection) or not all(
        isinstance(n, str) or n is None for n in (*names, *sides)
    ):
        raise InputRefusedError("sheet must be a name, a list of names, or the side of each name.")
    return sheet


def possible_names(wanted: Wanted) -> set[str]:
    """Every name that the sheets can have, by `str.casefold`.

    Names may contain commas and equals signs themselves.
    """
    names = _listed(wanted)
    whole = [wanted] if isinstance(wanted, str) else []
    possible = (*whole, *names, *(name.rpartition("=")[0].strip() for name in names))
    return {name.casefold() for name in possible}


def chosen(
    path: Path,
    held: Collection[str],
    filled: Collection[str],
    tables: Collection[str],
    wanted: Wanted | None,
) -> list[Sheet]:
    """The sheets to read.

    Parameters
    ----------
    path
        The workbook, for messages.
    held, filled, tables
        Names of all sheets, of those that are not empty, and of those with rows of numbers.
    wanted
        What the caller wants; None: the only sheet that is not empty, or that has numbers.

    Raises
    ------
    InputRefusedError
        If there is no such sheet, it is empty, or it is not clear which one is meant.
    """
    if wanted is None:
        return [_only_one(path, list(filled), list(tables))]
    if isinstance(wanted, str) and (whole := _held_name(wanted, held)):
        sheets = [Sheet(whole, None)]
    else:
        sheets = [_of_text(path, text, held) for text in _listed(wanted)]
    names = [sheet.name for sheet in sheets]
    for name in names:
        if names.count(name) > 1:
            raise refusal(path, f"sheet '{name}' is given twice; give each sheet once")
        if name not in filled:
            raise refusal(path, f"sheet '{name}' is empty; it must have a header row and data rows")
    if not sheets:
        raise refusal(path, f"no sheet is named; its sheets are {', '.join(held)}")
    return sheets


def _listed(wanted: Wanted) -> list[str]:
    if isinstance(wanted, Mapping):
        return [f"{name}={side}" for name, side in wanted.items()]
    names = wanted.split(",") if isinstance(wanted, str) else wanted
    return [name.strip() for name in names if name.strip()]


def _of_text(path: Path, text: str, held: Collection[str]) -> Sheet:
    """The sheet and the side that one entry names."""
    if whole := _held_name(text, held):
        return Sheet(whole, None)
    name, equals, side = (part.strip() for part in text.rpartition("="))
    if equals and (found := _held_name(name, held)):
        if side not in ("R", "T"):
            raise refusal(path, f"the side of sheet '{found}' is '{side}'; write {found}=R or {found}=T")
        return Sheet(found, side)
    raise refusal(path, f"has no sheet '{name if equals else text}'; its sheets are {', '.join(held)}")


def _held_name(text: str, held: Collection[str]) -> str | None:
    """The sheet of this name, or the only one whose name differs from it in case alone."""
    if text in held:
        return text
    alike = [name for name in held if name.casefold() == text.casefold()]
    return alike[0] if len(alike) == 1 else None


def _only_one(path: Path, filled: list[str], tables: list[str]) -> Sheet:
    if not filled:
        raise refusal(path, "is empty; it must have a header row and data rows")
    # Notes and settings stand in sheets of their own.
    names = tables or filled
    if len(names) > 1:
        text = (
            f"has values in {len(names)} sheets, {', '.join(names)}; select one with --sheet NAME (in "
            f"Python: sheet='NAME'), or join sheets with --sheet \"{','.join(names)}\" (in Python: "
            f"sheet={names!r}), each with its side behind it if neither a column nor its name says it: NAME=R"
        )
        raise refusal(path, text)
    return Sheet(names[0], None)
