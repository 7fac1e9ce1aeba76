"""Checks of single entries of a sample file: each returns a valid value or rejects it with a message."""

import math
from collections.abc import Collection
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample.hints import meant_key, meant_word, unknown_key
from jaxink.sample.measurement_schema import NUMBER, PRIOR, SMOOTHNESS
from jaxink.sample.parameters import Parameter, Prior, Smoothness
from jaxink.sample.schema import Quantity


def parameter_entry(given: Any, name: str, quantity: Quantity) -> dict[str, Any]:
    """A number or table of the file as a table with valid keys and the right unit; ``name`` is dotted."""
    entry = given if isinstance(given, dict) else {"value": given}
    only(entry, NUMBER, name)
    if entry.get("unit", quantity.unit) != quantity.unit:
        raise InputRefusedError(
            f"{name} has unit = {entry['unit']!r}; the unit must be "
            f"{quantity.unit or 'empty (a pure number)'}, as in its name."
        )
    return entry


def missing(name: str, key: str, quantity: Quantity) -> InputRefusedError:
    """Error for a missing number."""
    return InputRefusedError(
        f"{name} is missing; write {key} = <number{' in ' + quantity.unit if quantity.unit else ''}>."
    )


def parameter_of(name: str, entry: dict[str, Any], quantity: Quantity) -> Parameter:
    """One checked parameter with a dotted name, from an entry with keys of `NUMBER`."""
    unit = quantity.unit
    tie, free = entry.get("tie"), true_or_false(entry, "free", False, f"{name}: free")
    if tie is not None:
        if free or "value" in entry or not isinstance(tie, str):
            raise InputRefusedError(
                f'{name} has a tie, which gives its value; write tie = "expression" without value and free.'
            )
        if "prior" in entry:
            raise InputRefusedError(
                f"{name} has a tie and a prior; give the prior to the parameter that it is tied to."
            )
        return Parameter(name, math.nan, False, quantity.lowest, quantity.highest, unit, tie)
    if "prior" in entry and not free:
        raise InputRefusedError(f"{name} has a prior but is fixed; write free = true, or remove the prior.")
    lowest, highest = entry.get("min"), entry.get("max")
    if free and (lowest is None or highest is None):
        raise InputRefusedError(f"{name} is free and needs a range; give min and max.")
    lowest = quantity.lowest if lowest is None else lowest
    highest = quantity.highest if highest is None else highest
    for key, value in (("min", lowest), ("max", highest)):
        bounded(value, quantity, f"{name}: {key}")
    if not lowest < highest:
        raise InputRefusedError(f"{name} has min = {lowest:g} and max = {highest:g}; min must be below max.")
    value = entry.get("value", (lowest + highest) / 2 if free else None)
    if value is None:
        raise InputRefusedError(f"{name} is fixed and has no value; give one.")
    value = bounded(value, quantity, name)
    if free and not lowest <= value <= highest:
        raise InputRefusedError(
            f"{name}: the start value {value:g} must be within the range {lowest:g} to {highest:g}."
        )
    # A fixed value may be outside the range that an earlier fit had.
    lowest, highest = float(min(lowest, value)), float(max(highest, value))
    scale, multimodal, prior = quantity.scale, quantity.multimodal, _prior(name, entry)
    return Parameter(name, value, free, lowest, highest, unit, None, prior, scale, multimodal)


def _prior(name: str, entry: dict[str, Any]) -> Prior | None:
    if "prior" not in entry:
        return None
    given = _inner(name, "prior", entry["prior"], PRIOR)
    if given["standard_deviation"] == 0:
        raise InputRefusedError(f"{name}: prior.standard_deviation is 0; fix the parameter instead.")
    return Prior(**given)


def smoothness_of(name: str, entry: dict[str, Any]) -> Smoothness | None:
    """How fast a quantity with values by wavelength changes, from an entry with keys of `NUMBER`."""
    if "smoothness" not in entry:
        return None
    if not entry.get("free", False):
        raise InputRefusedError(
            f"{name} has a smoothness but is not free; write free = true, or remove the smoothness."
        )
    given = _inner(name, "smoothness", entry["smoothness"], SMOOTHNESS)
    for key, value in given.items():
        if value == 0:
            raise InputRefusedError(
                f"{name}: smoothness.{key} is 0; it must be positive. For one value at all wavelengths, "
                "remove per_wavelength and smoothness."
            )
    return Smoothness(**given)


def _inner(name: str, key: str, given: Any, known: dict[str, Quantity]) -> dict[str, float]:
    """The numbers of a table within the table of a parameter, all of which are required."""
    if not isinstance(given, dict) or set(given) != set(known):
        raise InputRefusedError(f"{name}: {key} must be {{ {' = ..., '.join(known)} = ... }}.")
    return {part: bounded(given[part], quantity, f"{name}: {key}.{part}") for part, quantity in known.items()}


def is_number(value: Any) -> bool:
    """Whether a value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def bounded(value: Any, quantity: Quantity, name: str) -> float:
    """A finite number within the limits of the quantity."""
    unit, lowest, highest = f" {quantity.unit}" if quantity.unit else "", quantity.lowest, quantity.highest
    if not is_number(value):
        raise InputRefusedError(f"{name} is {value!r}; it must be a finite number{unit and ' in' + unit}.")
    if not lowest <= value <= highest:
        raise InputRefusedError(
            f"{name} is {value:g}{unit}; it must lie between {lowest:g} and {highest:g}{unit}."
        )
    return float(value)


def true_or_false(table: dict[str, Any], key: str, default: bool, name: str) -> bool:
    """A boolean key."""
    value = table.get(key, default)
    if not isinstance(value, bool):
        raise InputRefusedError(f"{name} is {value!r}; it must be true or false.")
    return value


def is_list_of_numbers(value: Any, least: int = 1) -> bool:
    """Whether a value is a list of at least so many finite numbers."""
    return isinstance(value, list) and len(value) >= least and all(is_number(v) for v in value)


def require_equally_many(where: str, **columns: list[float]) -> None:
    """Reject two columns, given by their keys, of different length."""
    (first, one), (second, other) = columns.items()
    if len(one) != len(other):
        raise InputRefusedError(
            f"{where}: {first} has {len(one)} entries and {second} {len(other)}; they must be equally long."
        )


def only(table: dict[str, Any], known, where: str) -> None:
    """Reject unknown keys; the message suggests the most similar valid one."""
    for key in table:
        if key not in known:
            raise InputRefusedError(f"{where} has the key '{key}', {unknown_key(key, known)}")


def require_version(document: dict[str, Any], version: int, what: str) -> None:
    """Reject a file without the version of ``what`` that is read."""
    found = document.get("schema_version")
    if found is True or found != version:
        said = "missing" if found is None else f"{found!r}"
        raise InputRefusedError(
            f"schema_version is {said}; this version of jaxink reads {what} of version {version}, so write "
            f"`schema_version = {version}` at the top."
        )


def refuse_sample(document: dict[str, Any], instead: str) -> None:
    """Reject a sample file where another kind of file is read."""
    if "layers" in document:
        raise InputRefusedError(f"is a sample file; {instead}")


def table_of(document: dict[str, Any], name: str) -> dict[str, Any]:
    """A table of a document, empty if it is absent."""
    table = document.get(name, {})
    if not isinstance(table, dict):
        raise InputRefusedError(f"{name} must be a table: write [{name}] and its keys below.")
    return table


def choice(table: dict[str, Any], key: str, known: Collection[str], where: str) -> str:
    """A key whose value is one of a few words; the message suggests the one that is meant."""
    value = table.get(key)
    # As a tuple, because a list is not hashable.
    if value in tuple(known):
        return value
    if value is None:
        other = meant_key(table, key)
        instead = f", but '{other}', which does not exist" if other else ""
        raise InputRefusedError(f"{where} has no {key}{instead}; write {key} = one of: {', '.join(known)}.")
    near = meant_word(value, known)
    others = ", ".join(word for word in known if word != near)
    hint = f"did you mean {near} (or else {others})?" if near else f"it must be one of: {others}."
    raise InputRefusedError(f"{where} has {key} = {value!r}; {hint}")
