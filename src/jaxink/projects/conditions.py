"""What the conditions that a file states mean for the sample of a project.

Nothing is guessed: a word that neither the project nor the sample explains is refused, and so is what the
project states differently.
"""

import dataclasses
import json
import re
import unicodedata
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.measurement import BACKING, LIT_SIDE, SAMPLE, THICKNESS, Condition, is_number, listed, refusal
from jaxink.projects.toml_text import toml_key
from jaxink.sample import layer_tables

_NO_BACKING = ("none", "no backing", "no")
# What a thickness may be, if the file states it: a start and a range, but nothing that fits one value only.
_OF_ANY_THICKNESS = {"value", "free", "min", "max", "unit"}
_FRONT, _BACK = "front", "back"


@dataclasses.dataclass(frozen=True)
class Part:
    """One measurement of those into which the file divides.

    Parameters
    ----------
    table
        As the user would have written it: its name, files, rows, specimen and lit side.
    stated
        Changes of the sample that the file states, by the name that owns their parameters.
    """

    table: dict[str, Any]
    stated: Mapping[str, dict[str, Any]] = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class KnownWords:
    """What explains the words of a file.

    Parameters
    ----------
    sample
        Tables of the common sample.
    specimens
        Changes by specimen.
    backings
        Reflectance, or table, by the word for a card behind the sample.
    several
        Conditions that have several values in the project.
    """

    sample: dict[str, Any]
    specimens: Mapping[str, dict[str, Any]]
    backings: Mapping[str, Any]
    several: frozenset[str]


class Role(Enum):
    """What a value of a condition is to its measurement."""

    DIVIDES = "one of several, each of which is a measurement"
    CHOSEN = "the one that rows choose"
    ONLY = "the only one of the files"


@dataclasses.dataclass(frozen=True)
class Value:
    """A value of a condition, and where it is first.

    Parameters
    ----------
    cell
        Its text.
    column, source, row
        Its place.
    role
        What it is to its measurement.
    divides_specimen
        Whether the rows of its specimen have other values, too.
    """

    cell: str
    column: Condition
    source: str
    row: int
    role: Role
    divides_specimen: bool = False

    @property
    def divides(self) -> bool:
        """Whether the measurement is one of several that the file holds."""
        return self.role is Role.DIVIDES

    def refusal(self, text: str) -> InputRefusedError:
        """Error that names file, row and column."""
        return refusal(self.source, text, self.row, self.column.heading)

    def choice(self, condition: str) -> str:
        """What chooses the rows with this value, in a project file."""
        return f"rows = {{ {condition} = {json.dumps(self.cell, ensure_ascii=False)} }}"

    def stated_twice(self, what: str, condition: str) -> InputRefusedError:
        """Error for what the measurement states of all values alike."""
        text = (
            f"the column has several values, but the project states {what} for all of them; remove that, or "
            f"choose one value by {self.choice(condition)}"
        )
        return self.refusal(text)


def short(cell: str) -> str:
    """A value in letters, digits, hyphens and underscores."""
    if is_number(cell):
        cell = f"{_number(cell):g}"
    plain = unicodedata.normalize("NFKD", cell).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9-]+", "_", plain).strip("_")


def explains_itself(cell: str) -> bool:
    """Whether a value of a backing needs no word of the project."""
    return cell.casefold() in _NO_BACKING or (is_number(cell) and 0 <= _number(cell) <= 1)


def _number(cell: str) -> float:
    return float(cell.replace(",", ".", 1))


def explained(part: dict[str, Any], values: Mapping[str, Value], known: KnownWords) -> Part:
    """A measurement with what its values mean for the sample."""
    # What is the same everywhere is left to the sample file, but a side that is lit has no place there.
    always = known.several | {LIT_SIDE}
    values = {k: value for k, value in values.items() if k in always or value.role is not Role.ONLY}
    if LIT_SIDE in values:
        part |= _lit_side(part, values[LIT_SIDE], known.sample)
    if SAMPLE in values:
        part |= _specimen(part, values[SAMPLE], known.specimens)
    specimen = part.get("specimen")
    specimen = specimen if isinstance(specimen, str) and specimen in known.specimens else ""
    changes = part.get("changes", {}), known.specimens.get(specimen, {})
    stated: dict[str, dict[str, Any]] = {}
    if THICKNESS in values:
        stated |= _thickness(values[THICKNESS], changes, specimen, known.sample)
    if BACKING in values:
        stated |= _backing(values[BACKING], changes, known.backings)
    return Part(part, stated)


def _lit_side(part: Mapping[str, Any], value: Value, sample: dict[str, Any]) -> dict[str, Any]:
    """The lit side that a value states."""
    layers = layer_tables(sample)
    ends = [str(layer.get("name")) for layer in (layers[0], layers[-1])]
    meanings = {} if len(layers) == 1 else {ends[0].casefold(): _FRONT, ends[1].casefold(): _BACK}
    meanings |= {_FRONT: _FRONT, _BACK: _BACK}
    meant = meanings.get(value.cell.casefold())
    by_itself = part.get("lit_side")
    if by_itself is not None:
        if value.divides:
            raise value.stated_twice("lit_side", LIT_SIDE)
        if meant and meanings.get(str(by_itself).casefold(), meant) != meant:
            text = (
                f"the file states '{value.cell}', but the measurement lit_side = '{by_itself}'; correct one"
            )
            raise value.refusal(text)
        return {}
    if meant is None and value.role is not Role.ONLY:
        raise value.refusal(
            f"'{value.cell}' is neither an outer layer of the sample ({' or '.join(dict.fromkeys(ends))}) "
            "nor front or back in its order; write one of these, or a [[measurements]] table for each value, "
            f"with {value.choice(LIT_SIDE)} and its lit_side"
        )
    return {} if meant is None else {"lit_side": meant}


def _specimen(part: Mapping[str, Any], value: Value, known: Mapping[str, Any]) -> dict[str, Any]:
    """The specimen whose name a value is."""
    if "specimen" in part:
        if value.divides:
            raise value.stated_twice("specimen", SAMPLE)
        return {}
    named = [name for name in known if name == value.cell]
    named = named or [name for name in known if short(name) == short(value.cell) != ""]
    if not named and value.divides:
        raise value.refusal(
            f"'{value.cell}' is none of the specimens ({listed(known) or 'there are none'}); write "
            f"[specimens.{toml_key(value.cell)}] and what differs there from the common sample, or nothing "
            f"below it if nothing does, or choose one by {value.choice(SAMPLE)}"
        )
    return {"specimen": named[0]} if named else {}


def _table(given: Any) -> Mapping[str, Any]:
    """Changes, or none where the file has no table; that is refused where they are applied."""
    return given if isinstance(given, dict) else {}


def _is_stated(value: Value, states: Sequence[bool], what: str, condition: str) -> bool:
    """Whether the changes of the measurement, or its specimen, state what a value does, and for it alone."""
    of_measurement, of_specimen = states
    if (of_measurement and value.divides) or (of_specimen and value.divides_specimen):
        raise value.stated_twice(what, condition)
    return of_measurement or of_specimen


def _thickness(
    value: Value, changes: tuple[Any, Any], specimen: str, sample: dict[str, Any]
) -> dict[str, dict[str, Any]]:
    """The thickness of the ink in micrometres; prints of one specimen and thickness share it."""
    inks = [layer for layer in layer_tables(sample) if layer.get("kind") == "scattering"]
    names = [str(layer.get("name")) for layer in inks]
    states = [any(THICKNESS in _table(_table(each).get(name)) for name in names) for each in changes]
    if _is_stated(value, states, "the thickness of the ink", THICKNESS):
        return {}
    if len(inks) != 1:
        raise value.refusal(
            f"the column states one thickness, but the sample has {len(inks)} scattering layers; write a "
            f"[[measurements]] table for each value, with {value.choice(THICKNESS)} and changes"
        )
    if value.column.unit != "um":
        unit = f"is '{value.column.unit}'" if value.column.unit else "is not stated"
        raise value.refusal(f"the unit {unit}; write micrometres, and name the column {THICKNESS}")
    if not is_number(value.cell):
        raise value.refusal(f"'{value.cell}' is not a number; write the thickness in micrometres")
    number, common = _number(value.cell), inks[0].get(THICKNESS)
    if isinstance(common, dict):
        if other := sorted(common.keys() - _OF_ANY_THICKNESS):
            raise value.refusal(
                f"the file states the thickness, but {names[0]}.{THICKNESS} of the common sample has "
                f"{other[0]}, which is of one thickness only; remove it, or write specimens"
            )
        entry = {**common, "value": number} if common.get("free") else number
    else:
        entry = number
    owner = f"{f'{specimen}_' if specimen else ''}thickness_{short(value.cell)}um"
    return {owner: {names[0]: {THICKNESS: entry}}}


def _backing(
    value: Value, changes: tuple[Any, Any], backings: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """What was behind the sample: a reflectance, a word of the project, or nothing."""
    states = [BACKING in _table(each) for each in changes]
    if _is_stated(value, states, "the backing", BACKING):
        return {}
    word = value.cell.casefold()
    named = {key.casefold(): given for key, given in backings.items()}
    given = named.get(word, False if word in _NO_BACKING else None)
    if given is None and is_number(word):
        given = _number(word)
        if not 0 <= given <= 1:
            raise value.refusal(
                f"{value.cell} is no reflectance between 0 and 1; divide per cent by 100, or, if it is the "
                "name of a card, state its reflectance in the project file: backings = "
                f"{{ {toml_key(value.cell)} = 0.5 }}"
            )
    if given is None:
        raise value.refusal(
            f"the reflectance of '{value.cell}' is not stated; state it at the top of the project file, such "
            f"as backings = {{ {toml_key(value.cell)} = 0.5 }}, or write it in the cells (none: no backing)"
        )
    is_number_given = not isinstance(given, dict | bool)
    owner = f"backing_{short(value.cell) or sorted(named).index(word) + 1}"
    return {owner: {BACKING: {"reflectance": given} if is_number_given else given}}
