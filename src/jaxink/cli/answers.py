"""Answers and options as people write them: numbers with units and decimal commas, words in short."""

import re
from collections.abc import Sequence

from jaxink.errors import InputRefusedError
from jaxink.sample import AMBIGUOUS, converted, is_length

_NUMBER = re.compile(r"([+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d.,]*)")


def quantity(name: str, text: str) -> float:
    """The number that a text states for a field, in the unit that its name ends with.

    Parameters
    ----------
    name
        Field such as ``ink_um``; one without a unit, such as ``ink_index``, is a pure number.
    text
        Such as ``90 um``, ``0.09 mm`` or ``1,5``.

    Raises
    ------
    InputRefusedError
        If it is no number, could be two, or has another kind of unit.
    """
    text = text.strip()
    own = name.rpartition("_")[2]
    own_unit = own if is_length(own) else ""
    example = f", such as 20 or 20 {own_unit}" if own_unit else ", such as 1.5"
    found = _NUMBER.fullmatch(text)
    if found is None:
        if text.lower().lstrip("+-") in ("nan", "inf", "infinity"):
            return float(text)
        raise InputRefusedError(f"{name} is {text!r}; it must be a number{example}.")
    if AMBIGUOUS.fullmatch(found[1]):
        thousands, decimal = found[1].replace(",", ""), found[1].replace(",", ".")
        raise InputRefusedError(f"{name} is {text!r}, which can be {thousands} or {decimal}; write a point.")
    value, unit = float(found[1].replace(",", ".")), found[2]
    if not unit:
        return value
    if not own_unit:
        raise InputRefusedError(f"{name} is {text!r}; it has no unit, so write the number only.")
    found_value = converted(value, unit, own_unit)
    if found_value is None:
        raise InputRefusedError(f"{name} is {text!r}; its unit must be one of nm, um, mm, cm.")
    return found_value


def word(name: str, text: str, words: Sequence[str]) -> str:
    """The word that a text means, whatever its capitals, spaces and hyphens.

    Parameters
    ----------
    name
        What is asked for.
    text
        A word, its beginning if no other word begins so, its initials, such as ``hg``, or its number from 1.
    words
        The words that there are.

    Raises
    ------
    InputRefusedError
        If it is none of them.
    """
    given = _letters(text)
    exact = [one for one in words if _letters(one) == given]
    short = [one for one in words if given and (_letters(one).startswith(given) or _initials(one) == given)]
    numbered = [one for number, one in enumerate(words, start=1) if str(number) == given]
    for found in (exact, short, numbered):
        if len(found) == 1:
            return found[0]
    raise InputRefusedError(f"{name} is {text.strip()!r}; it must be one of: {' | '.join(words)}.")


def _letters(text: str) -> str:
    return re.sub(r"[\s_-]", "", text).lower()


def _initials(text: str) -> str:
    return "".join(part[0] for part in text.split("_"))
