"""A short ``repr``: fields on a few lines, with arrays and nested objects by their kind and size."""

import dataclasses
import enum
import reprlib
import textwrap
from collections.abc import Mapping
from typing import Any

MOST_LINES = 9
LINE_WIDTH = 100
_LONGEST_TEXT, _LONGEST_NESTED, _MOST_ITEMS = 200, 60, 4


def brief_repr(self: Any) -> str:
    """``repr`` of a dataclass or an equinox module, on `MOST_LINES` lines at most."""
    parts = [f"{f.name}={brief(getattr(self, f.name, None))}" for f in dataclasses.fields(self) if f.repr]
    return limited(f"{type(self).__name__}({', '.join(parts)})")


def limited(text: str) -> str:
    """Text wrapped, and cut off after `MOST_LINES` lines."""
    lines = textwrap.wrap(text, LINE_WIDTH, subsequent_indent="  ", break_on_hyphens=False)
    if len(lines) > MOST_LINES:
        lines = [*lines[: MOST_LINES - 1], "  ..."]
    return "\n".join(lines)


def brief(value: Any) -> str:
    """One short phrase for any value."""
    if isinstance(value, enum.Enum):
        return str(value.name)
    if value is None or isinstance(value, bool | int | float | complex):
        return f"{value:.6g}" if isinstance(value, float) else repr(value)
    if isinstance(value, str):
        return _text(value)
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return f"{value.dtype}[{', '.join(map(str, value.shape))}]"
    if isinstance(value, tuple | list):
        return _sequence(value)
    if isinstance(value, dict):
        return _mapping(value)
    return _object(value)


def _text(text: str) -> str:
    """``repr`` of a string, shortened in the middle."""
    shortener = reprlib.Repr()
    shortener.maxstring = _LONGEST_TEXT
    return shortener.repr(text)


def _sequence(values: tuple[Any, ...] | list[Any]) -> str:
    if not values:
        return "()"
    shown = [brief(value) for value in values[: _MOST_ITEMS + 1]]
    if len(values) <= _MOST_ITEMS and sum(map(len, shown)) <= _LONGEST_NESTED:
        return f"({', '.join(shown)}{',' * (len(values) == 1)})"
    kinds = {type(value).__name__ for value in values}
    return f"({len(values)} {kinds.pop() if len(kinds) == 1 else 'values'})"


def _mapping(values: dict[Any, Any]) -> str:
    shown = ", ".join(f"{brief(key)}: {brief(value)}" for key, value in list(values.items())[:_MOST_ITEMS])
    if len(values) <= _MOST_ITEMS and len(shown) <= _LONGEST_NESTED:
        return f"{{{shown}}}"
    return f"{{{len(values)} entries}}"


def _object(value: Any) -> str:
    name = type(value).__name__
    if isinstance(value, Mapping) or hasattr(type(value), "__len__"):
        return f"{name}[{len(value)}]"
    if isinstance(value, type) or callable(value):
        return getattr(value, "__name__", name)
    if not dataclasses.is_dataclass(value):
        return name
    parts = [f"{f.name}={brief(getattr(value, f.name, None))}" for f in dataclasses.fields(value) if f.repr]
    whole = f"{name}({', '.join(parts)})"
    return whole if len(whole) <= _LONGEST_NESTED else f"{name}(...)"


def counted(n: int, what: str) -> str:
    """A number with its noun, such as ``1 row`` or ``2 rows``."""
    return f"{n} {what}{'' if n == 1 else 's'}"
