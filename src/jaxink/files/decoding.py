"""Plain data, as in JSON, converted back to the types that wrote them; what does not fit is rejected."""

import dataclasses
import json
import math
import types
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Union, get_args, get_origin, get_type_hints, is_typeddict

from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded, shown_path

# More than jaxink ever writes; parsing integers of thousands of digits would take seconds.
_MOST_DIGITS = 18
_LONGEST_SHOWN = 40
_NOUNS = {float: "a finite number", int: "an integer", bool: "true or false", str: "a string"}


@dataclasses.dataclass(frozen=True)
class Rules:
    """What the types alone do not say.

    Parameters
    ----------
    nulls
        The non-finite number that null stands for, by key; "" means all other keys. For keys that are not
        listed, null is rejected unless the type allows None.
    made_of
        For a type that is not a dataclass: the type of its plain data, and the function that constructs it.
    """

    nulls: Mapping[str, float] = dataclasses.field(default_factory=dict)
    made_of: Mapping[type, tuple[Any, Callable[[Any], Any]]] = dataclasses.field(default_factory=dict)


def read_json(path, limit_bytes: int, what: str) -> Any:
    """Plain data of a JSON file; parameters and errors as for `open_bounded` and `json_of`."""
    refusal = f"{shown_path(path)}: is not a jaxink {what}"
    if Path(path).suffix.lower() != ".json":
        refusal += ", which is a .json file, or the folder that contains it"
    content = read_bounded(path, limit_bytes, what)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputRefusedError(f"{refusal}; this is not UTF-8 text.") from None
    return json_of(text, refusal)


def json_of(text: str, refusal: str) -> Any:
    """Plain data of a JSON text; an `InputRefusedError` gives ``refusal`` and the reason in brackets."""
    try:
        return json.loads(text, parse_constant=_no_number, parse_int=_integer)
    except RecursionError:
        problem = "tables or lists are nested too deeply"
    except json.JSONDecodeError as found:
        problem = "this is not JSON" if found.pos == 0 else str(found)
    except ValueError as found:
        problem = str(found)
    raise InputRefusedError(f"{refusal} ({problem}).")


def decode(kind: Any, value: Any, key: str = "", rules: Rules | None = None) -> Any:
    """Convert plain data to a dataclass, tuple, dictionary, number, bool or string, or a union of them.

    Parameters
    ----------
    kind
        The type, written as in an annotation.
    value
        The data.
    key
        Dotted name of the data in messages.
    rules
        What the types alone do not say.

    Raises
    ------
    InputRefusedError
        If a key is missing, unknown, or has a value of the wrong type.
    """
    return _Decoder(rules or Rules()).of(kind, value, key)


class _Decoder:
    def __init__(self, rules: Rules):
        self.rules = rules

    def of(self, kind: Any, value: Any, key: str) -> Any:
        if kind is Any:
            return value
        if kind in self.rules.made_of:
            plain, make = self.rules.made_of[kind]
            return _made(make, self.of(plain, value, key), key)
        if dataclasses.is_dataclass(kind) or is_typeddict(kind):
            return self._instance(kind, value, key)
        origin, arguments = get_origin(kind), get_args(kind)
        if origin in (Union, types.UnionType):
            return self._one_of(arguments, value, key)
        if origin is tuple:
            return self._tuple(arguments, value, key)
        if origin is dict:
            table = _table(value, key)
            return {name: self.of(arguments[1], inner, _inside(key, name)) for name, inner in table.items()}
        if kind is float and value is None:
            name = key.rpartition(".")[2]
            number = self.rules.nulls.get(name, self.rules.nulls.get(""))
            if number is not None:
                return number
        if not _is(kind, value):
            raise InputRefusedError(f"{key} is {described(value)}; it must be {_NOUNS[kind]}.")
        return kind(value)

    def _instance(self, kind: Any, value: Any, key: str) -> Any:
        table, hints, needed = _table(value, key), _hints(kind), _needed(kind)
        for name in table:
            if name not in needed:
                raise InputRefusedError(
                    f"{_inside(key, name)} is a key that this version of jaxink does not know; valid keys "
                    f"are: {', '.join(needed)}."
                )
        for name, is_needed in needed.items():
            if is_needed and name not in table:
                raise InputRefusedError(f"{_inside(key, name)} is missing.")
        found = {name: self.of(hints[name], inner, _inside(key, name)) for name, inner in table.items()}
        return _made(lambda named: kind(**named), found, key)

    def _one_of(self, kinds: tuple[Any, ...], value: Any, key: str) -> Any:
        if value is None and types.NoneType in kinds:
            return None
        kinds = tuple(kind for kind in kinds if kind is not types.NoneType)
        # Only plain types, numbers and strings, occur as alternatives.
        fitting = [kind for kind in kinds if len(kinds) == 1 or _is(kind, value)]
        if not fitting:
            nouns = " or ".join(_NOUNS[kind] for kind in kinds)
            raise InputRefusedError(f"{key} is {described(value)}; it must be {nouns}.")
        return self.of(fitting[0], value, key)

    def _tuple(self, kinds: tuple[Any, ...], value: Any, key: str) -> tuple:
        if not isinstance(value, list | tuple):
            raise InputRefusedError(f"{key} is {described(value)}; it must be a list.")
        if kinds[1:] == (...,):
            kinds = kinds[:1] * len(value)
        if len(kinds) != len(value):
            raise InputRefusedError(f"{key} has {len(value)} entries; it must have {len(kinds)}.")
        each = enumerate(zip(kinds, value, strict=True))
        return tuple(self.of(kind, inner, f"{key}[{number}]") for number, (kind, inner) in each)


def _made(make: Callable[[Any], Any], of: Any, key: str) -> Any:
    try:
        return make(of)
    except InputRefusedError as problem:
        raise InputRefusedError(f"{key}: {problem}" if key else str(problem)) from None


def _is(kind: type, value: Any) -> bool:
    if kind is float:
        # JSON text such as 1e999 is read as infinity.
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    return isinstance(value, kind) and (kind is not int or not isinstance(value, bool))


def _table(value: Any, key: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise InputRefusedError(f"{key or 'the top level'} is {described(value)}; it must be a table.")
    return value


@cache
def _hints(kind: Any) -> dict[str, Any]:
    return get_type_hints(kind)


@cache
def _needed(kind: Any) -> dict[str, bool]:
    """Fields of a type, and whether each is required."""
    if is_typeddict(kind):
        return {name: name in kind.__required_keys__ for name in kind.__annotations__}
    missing = dataclasses.MISSING
    return {
        field.name: field.default is missing and field.default_factory is missing
        for field in dataclasses.fields(kind)
        if field.init
    }


def _inside(key: str, name: str) -> str:
    name = name if len(name) <= _LONGEST_SHOWN and name.isprintable() else described(name)
    return f"{key}.{name}" if key else name


def described(value: Any) -> str:
    """Short description of plain data for a message."""
    if isinstance(value, dict | list | tuple):
        return f"a {'table' if isinstance(value, dict) else 'list'} of {len(value)}"
    if value is None or isinstance(value, bool):
        return json.dumps(value)
    text = repr(value)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}..."


def _no_number(text: str) -> float:
    raise ValueError(f"{text} is not a valid JSON number")


def _integer(text: str) -> int:
    if len(text.lstrip("-")) > _MOST_DIGITS:
        raise ValueError(f"an integer has {len(text.lstrip('-'))} digits")
    return int(text)
