"""Fingerprint of a static description, the same in every process; it identifies a stored program."""

import dataclasses
import enum
import hashlib
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

_PACKAGE = Path(__file__).resolve().parents[1]


class _UnknownKindError(Exception):
    pass


def fingerprint(*things: Any) -> str | None:
    """Hash of the contents of things, or None if one of them has no canonical form.

    Numbers, texts, arrays, collections, enumerations, and this package's own dataclasses, classes and named
    functions have one. A class defined elsewhere has none: its code is not part of `source_fingerprint`.

    Parameters
    ----------
    *things
        Of any kind.
    """
    digest = hashlib.sha256()
    try:
        for thing in things:
            _feed(digest.update, thing)
    except _UnknownKindError:
        return None
    return digest.hexdigest()


@cache
def source_fingerprint() -> str:
    """Hash of this package's source, so that no program outlives the code that it was traced from."""
    digest = hashlib.sha256()
    for file in sorted(_PACKAGE.rglob("*.py")):
        digest.update(f"{file.relative_to(_PACKAGE).as_posix()}\0".encode() + file.read_bytes())
    return digest.hexdigest()


def _feed(update: Callable[[bytes], None], thing: Any) -> None:
    """Feed a thing and its length to a hash, so that no two things feed the same bytes."""

    def text(kind: str, content: str) -> None:
        data = content.encode()
        update(f"{kind} {len(data)} ".encode() + data)

    match thing:
        case None | bool() | str() | bytes():
            text(type(thing).__name__, repr(thing))
        case enum.Enum():
            text("enum", f"{_named(type(thing))} {thing.value!r}")
        case int():
            text("int", repr(int(thing)))
        case float():
            text("float", float(thing).hex())
        case np.ndarray() | np.generic() if thing.dtype != object:
            text("array", f"{thing.dtype.str} {thing.shape}")
            update(np.ascontiguousarray(thing).tobytes())
        case tuple() | list():
            text(type(thing).__name__, str(len(thing)))
            for item in thing:
                _feed(update, item)
        case frozenset():
            each = [fingerprint(item) for item in thing]
            if None in each:
                raise _UnknownKindError
            text("set", " ".join(sorted(map(str, each))))
        case type():
            text("class", _named(thing))
        case _ if dataclasses.is_dataclass(thing):
            text("dataclass", _named(type(thing)))
            for field in dataclasses.fields(thing):
                text("field", field.name)
                _feed(update, getattr(thing, field.name, None))
        case Mapping():
            text("mapping", f"{_named(type(thing))} {len(thing)}")
            for key, value in thing.items():
                _feed(update, key)
                _feed(update, value)
        case _ if callable(thing):
            text("function", _named(thing))
        case _:
            raise _UnknownKindError


def _named(thing: Any) -> str:
    """Where a class or function is defined; only what has a name in this package or in Python's own."""
    module, name = getattr(thing, "__module__", ""), getattr(thing, "__qualname__", "")
    is_own = module == "builtins" or module.split(".")[0] == __name__.split(".")[0]
    if not is_own or not name or "<" in name:
        raise _UnknownKindError
    return f"{module}.{name}"
