"""Short signatures for ``help``: types by their names, arrays by their kind and axes, long defaults cut."""

import collections.abc
import inspect
import types
import typing
from contextlib import suppress
from typing import Any, TypeVar

T = TypeVar("T")
_LONGEST_DEFAULT = 40


class _Words:
    """What `inspect` shows as it is, in the place of a type or of a default."""

    def __init__(self, words: str):
        self._words = words

    def __repr__(self) -> str:
        return self._words


def shortly_signed(thing: T) -> T:
    """The same function or class, whose signature, and those of its methods, ``help`` shows in short words.

    Annotations are as before.
    """
    if isinstance(thing, type):
        for member in vars(thing).values():
            if isinstance(member, types.FunctionType) and not member.__name__.startswith("_"):
                _sign(member)
    if callable(thing):
        _sign(thing)
    return thing


def short_type(annotation: Any) -> str:
    """A type in a few words."""
    if isinstance(annotation, str):
        return annotation
    if annotation is None or annotation is type(None):
        return "None"
    if annotation is Ellipsis:
        return "..."
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin in (typing.Union, types.UnionType):
        words = list(dict.fromkeys(short_type(one) for one in arguments))
        # NumPy's and JAX's types of what can become an array are unions of a dozen types of their own.
        if any("numpy._typing" in repr(one) for one in arguments):
            rest = [word for word in words if word == "None"]
            return " | ".join(["ArrayLike", *rest])
        return " | ".join(words)
    if hasattr(annotation, "dtype") and hasattr(annotation, "dim_str"):
        name, axes = annotation.__name__.partition("[")[0], annotation.dim_str
        return f"{name}[{axes!r}]"
    if origin is collections.abc.Callable:
        return "Callable"
    if origin is not None:
        inner = ", ".join(short_type(one) for one in arguments)
        return f"{getattr(origin, '__name__', str(origin))}[{inner}]"
    return getattr(annotation, "__name__", str(annotation))


def _sign(thing: Any) -> None:
    # What has no signature, or no place for another one, stays as it is.
    with suppress(AttributeError, TypeError, ValueError):
        thing.__signature__ = _short(inspect.signature(thing))


def _short(signature: inspect.Signature) -> inspect.Signature:
    empty = inspect.Signature.empty
    parameters = [
        p.replace(annotation=_type(p.annotation), default=_default(p.default))
        for p in signature.parameters.values()
    ]
    returned = signature.return_annotation
    return signature.replace(
        parameters=parameters, return_annotation=returned if returned is empty else _type(returned)
    )


def _type(annotation: Any) -> Any:
    if annotation is inspect.Parameter.empty or isinstance(annotation, _Words):
        return annotation
    return _Words(short_type(annotation))


def _default(value: Any) -> Any:
    if value is inspect.Parameter.empty or len(repr(value)) <= _LONGEST_DEFAULT:
        return value
    return _Words(f"{type(value).__name__}(...)")
