"""An effect in a plain sentence with all of its numbers."""

import re
from collections.abc import Mapping

from jaxink.effects.kinds import Effect
from jaxink.numerics.digits import plus_minus

# Ends of parameters' names that are units.
_UNITS = re.compile(r"_(per_mm|per_sr|deg2|deg|mm|um2|um|nm|rad|ln)$")
_FIELD = re.compile(r"\{(\w+)(%?)\}")


def in_numbers(
    effect: Effect, values: Mapping[str, float], errors: Mapping[str, float | None], difference: bool = False
) -> str:
    """What is true if an effect is present as strong as its values say.

    Parameters
    ----------
    effect
        The effect.
    values, errors
        Value and standard error of each of its terms, by name; an error is None if it is unknown.
    difference
        Whether the value of the first term is its distance from the declared value.

    Returns
    -------
    str
        Without a capital letter or a full stop, such as ``15.1 +- 1.3 % of the area has ink of 0.2 times the
        thickness``.
    """
    terms = {term.name: term for term in effect.terms if term.name in values}
    by_key: dict[str, list[str]] = {}
    for name in terms:
        by_key.setdefault(name.partition("@")[0].rsplit(".", 1)[-1], []).append(name)

    def told(name: str, in_percent: bool = False) -> str:
        scale = 100.0 if in_percent else 1.0
        value, error = values[name], errors.get(name)
        unit = "%" if in_percent else terms[name].unit
        text = plus_minus(scale * value, None if error is None else scale * error)
        return f"{text} {unit}" if unit else text

    def told_each(key: str, in_percent: bool) -> str:
        """The number, or that of each wavelength."""
        names = by_key[key]
        waves = [name.partition("@")[2] for name in names]
        texts = [told(name, in_percent) for name in names]
        return ", ".join(f"{text} at {w} nm" if w else text for text, w in zip(texts, waves, strict=True))

    needed = {key for key, _ in _FIELD.findall(effect.numbered)}
    if effect.numbered and needed <= by_key.keys():
        return _FIELD.sub(lambda found: told_each(found[1], bool(found[2])), effect.numbered)
    if difference:
        return f"{effect.statement}, by {told(effect.strength.name)}" if terms else effect.statement
    listed = ", ".join(f"{_words(name)} {told(name)}" for name in terms)
    return f"{effect.statement}: {listed}" if listed else effect.statement


def _words(name: str) -> str:
    """Name of a quantity in words, such as ``detector diameter`` of ``instrument.detector_diameter_mm``."""
    key, _, wave = name.rsplit(".", 1)[-1].partition("@")
    words = _UNITS.sub("", key).replace("_", " ")
    return f"{words} at {wave} nm" if wave else words
