"""Exceptions of jaxink, and checks of arguments.

Every exception carries one sentence that the user can act on. The functions ``require_...`` raise
`InputRefusedError` if an argument is invalid; ``name`` is what the message calls it.
"""

from collections.abc import Collection, Iterable, Mapping
from numbers import Integral, Real

_LONGEST_SENTENCE = 1500


class JaxinkError(Exception):
    """Base class of every error that jaxink raises on purpose.

    Parameters
    ----------
    sentence
        What is wrong and what would be right. It is kept on one line, and long sentences are shortened in
        the middle.
    """

    def __init__(self, sentence: str):
        sentence = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in sentence)
        if len(sentence) > _LONGEST_SENTENCE:
            half = _LONGEST_SENTENCE // 2
            sentence = f"{sentence[:half]} ... {sentence[-half:]}"
        super().__init__(sentence)


class InputRefusedError(JaxinkError, ValueError):
    """Invalid input; the message names the file, row, column or parameter and the remedy."""


class NoSuchNameError(InputRefusedError, KeyError):
    """A name that a table does not have."""

    # That of KeyError shows the sentence in quotation marks.
    __str__ = Exception.__str__


class NotConvergedError(InputRefusedError):
    """A fit that others begin from has not found a minimum; the message says what may help."""


class NotFiniteError(JaxinkError, FloatingPointError):
    """A model or its derivatives are not finite where a computation cannot go on without them."""


class NoDerivativeError(JaxinkError, NotImplementedError):
    """A derivative was asked for that is not available, or not accurate."""


class PrecisionError(JaxinkError, RuntimeError):
    """A differentiable function was called while JAX uses 32-bit floats, or is strict by one of its flags."""


class PlatformError(JaxinkError, RuntimeError):
    """JAX finds no device of the kind that it is told to use."""


class UnsafeVersionError(JaxinkError, RuntimeError):
    """The installed version of jaxlib can deadlock."""


class ForkedProcessError(JaxinkError, RuntimeError):
    """The process was forked from one that had already computed with JAX."""


def shown(value: object) -> str:
    """Text of a value for a message: numbers without their type, anything else by ``repr``."""
    if isinstance(value, Integral):
        return str(value)
    return f"{value:g}" if isinstance(value, Real) else repr(value)


def no_such_name(known: Iterable[str], near: str | None = None) -> str:
    """End of a sentence about a name that does not exist; suggests ``near``, or lists the known ones."""
    hint = f"; did you mean {near}?" if near else f"; valid names are: {', '.join(known)}."
    return f"which does not exist{hint}"


def require_kind(name: str, value: object, *kinds: type) -> None:
    """Reject an argument that is not an instance of one of the given types."""
    if not isinstance(value, kinds):
        wanted = ", ".join(kind.__name__ for kind in kinds[:-1])
        wanted = f"{wanted} or {kinds[-1].__name__}" if wanted else kinds[-1].__name__
        raise InputRefusedError(f"{name} is of type {type(value).__name__}; it must be of type {wanted}.")


def require_by_name(name: str, value: object, example: Mapping[str, float]) -> None:
    """Reject values that are not given by name, such as an array; the message shows what to hand over."""
    if not isinstance(value, Mapping):
        first = ", ".join(f"'{key}': {number:g}" for key, number in [*example.items()][:2])
        more = ", ..." if len(example) > 2 else ""
        kind = type(value).__name__
        raise InputRefusedError(
            f"{name} is of type {kind}; it must be a dict of numbers by name: {{{first}{more}}}."
        )


def require_one_of(name: str, value: object, allowed: Collection[str]) -> None:
    """Reject a word that is not one of those allowed."""
    if value not in allowed:
        raise InputRefusedError(f"{name} is {value!r}; it must be one of: {', '.join(allowed)}.")


def require_integer(name: str, value: object, least: int, most: int | None = None) -> None:
    """Reject anything but an integer between ``least`` and ``most``, inclusive; None: no upper limit."""
    if not isinstance(value, Integral) or isinstance(value, bool) or int(value) < least:
        raise InputRefusedError(f"{name} is {value!r}; it must be an integer of at least {least}.")
    if most is not None and int(value) > most:
        raise InputRefusedError(f"{name} is {value}; it must be at most {most}.")


def require_number(name: str, value: object) -> None:
    """Reject anything but a real number; infinity is allowed, NaN is not."""
    if not isinstance(value, Real) or isinstance(value, bool) or value != value:
        raise InputRefusedError(f"{name} is {shown(value)}; it must be a number.")


def require_positive(name: str, value: object) -> None:
    """Reject anything but a positive, finite number."""
    require_number(name, value)
    if not 0 < value < float("inf"):  # type: ignore[operator]
        raise InputRefusedError(f"{name} is {shown(value)}; it must be positive and finite.")
