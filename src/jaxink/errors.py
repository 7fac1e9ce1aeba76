"""Exceptions of jaxink; each carries one sentence that a user can act on."""

import difflib
from collections.abc import Collection, Iterable
from numbers import Integral, Real

_LONGEST_SENTENCE = 1500


class JaxinkError(Exception):
    """Base class of every error that jaxink raises on purpose.

    Parameters
    ----------
    sentence
        What is wrong and what would be right. It stays on one line and is shortened in its middle if it
        quotes more than anyone would read.
    """

    def __init__(self, sentence: str):
        sentence = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in sentence)
        if len(sentence) > _LONGEST_SENTENCE:
            half = _LONGEST_SENTENCE // 2
            sentence = f"{sentence[:half]} ... {sentence[-half:]}"
        super().__init__(sentence)


class InputRefusedError(JaxinkError, ValueError):
    """An input is wrong; the message names the file, row, column or parameter and the remedy."""


class PrecisionError(JaxinkError, RuntimeError):
    """A differentiable function was called while JAX computes in 32 bits."""


class UnsafeVersionError(JaxinkError, RuntimeError):
    """The installed jaxlib is one that can deadlock."""


class ForkedProcessError(JaxinkError, RuntimeError):
    """The process was forked off one that had computed with JAX."""


def shown(value: object) -> str:
    """An argument as a sentence names it: a number without its type, anything else as Python writes it.

    Parameters
    ----------
    value
        What was given.
    """
    if isinstance(value, Integral):
        return str(value)
    return f"{value:g}" if isinstance(value, Real) else repr(value)


def unknown_name(name: str, known: Iterable[str]) -> str:
    """End of a sentence about a name that does not exist, with the nearest that does.

    Parameters
    ----------
    name
        What was given.
    known
        The names that exist.
    """
    near = difflib.get_close_matches(name, list(known), n=1)
    hint = f"; did you mean {near[0]}?" if near else f"; known are: {', '.join(known)}."
    return f"which does not exist{hint}"


def require_kind(name: str, value: object, *kinds: type) -> None:
    """Refuse an argument of another kind than is wanted.

    Parameters
    ----------
    name
        Of the argument.
    value
        What was given.
    *kinds
        Its type must be one of these.

    Raises
    ------
    InputRefusedError
        If it is not.
    """
    if not isinstance(value, kinds):
        wanted = ", ".join(kind.__name__ for kind in kinds[:-1])
        wanted = f"{wanted} or {kinds[-1].__name__}" if wanted else kinds[-1].__name__
        raise InputRefusedError(f"{name} is of type {type(value).__name__}; it must be of type {wanted}.")


def require_one_of(name: str, value: object, allowed: Collection[str]) -> None:
    """Refuse a word that is none of those allowed.

    Parameters
    ----------
    name
        Of the argument.
    value
        What was given.
    allowed
        The words.

    Raises
    ------
    InputRefusedError
        With those allowed, if it is another.
    """
    if value not in allowed:
        raise InputRefusedError(f"{name} is {value!r}; it must be one of: {', '.join(allowed)}.")


def require_integer(name: str, value: object, least: int, most: int | None = None) -> None:
    """Refuse what is not a whole number of at least, and at most, so much.

    Parameters
    ----------
    name
        Of the argument.
    value
        What was given.
    least, most
        Smallest and largest number allowed; None: there is no largest.

    Raises
    ------
    InputRefusedError
        If it is not.
    """
    if not isinstance(value, Integral) or isinstance(value, bool) or int(value) < least:
        raise InputRefusedError(f"{name} is {value!r}; it must be a whole number of at least {least}.")
    if most is not None and int(value) > most:
        raise InputRefusedError(f"{name} is {value}; it must be at most {most}.")


def require_number(name: str, value: object) -> None:
    """Refuse what is not a number; infinity is one.

    Parameters
    ----------
    name
        Of the argument.
    value
        What was given.

    Raises
    ------
    InputRefusedError
        If it is not, or if it is NaN.
    """
    if not isinstance(value, Real) or isinstance(value, bool) or value != value:
        raise InputRefusedError(f"{name} is {shown(value)}; it must be a number.")
