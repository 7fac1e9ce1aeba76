"""Checks of single entries of a sample file: each passes on a value or refuses it with a sentence."""

import math
from collections.abc import Collection
from typing import Any

from jaxink.errors import InputRefusedError, unknown_name
from jaxink.sample.measurement_schema import NUMBER, PRIOR
from jaxink.sample.parameters import Parameter, Prior
from jaxink.sample.quantity import Quantity


def parameter_entry(given: Any, name: str, quantity: Quantity) -> dict[str, Any]:
    """What a file says of a number, as a table with known keys and the right unit.

    Parameters
    ----------
    given
        A number or a table.
    name
        Dotted name.
    quantity
        What it may be.
    """
    entry = given if isinstance(given, dict) else {"value": given}
    only(entry, NUMBER, name)
    if entry.get("unit", quantity.unit) != quantity.unit:
        raise InputRefusedError(
            f"{name} has unit = {entry['unit']!r}; it is always in "
            f"{quantity.unit or 'no unit (a pure number)'}, as its name says."
        )
    return entry


def missing(name: str, key: str, quantity: Quantity) -> InputRefusedError:
    """The refusal of a file that lacks a number."""
    return InputRefusedError(
        f"{name} is missing; write {key} = <number{' in ' + quantity.unit if quantity.unit else ''}>."
    )


def parameter_of(name: str, entry: dict[str, Any], quantity: Quantity) -> Parameter:
    """One checked parameter.

    Parameters
    ----------
    name
        Its dotted name.
    entry
        What the file says of it, keys of `NUMBER`.
    quantity
        What it may be.
    """
    unit = quantity.unit
    tie, free = entry.get("tie"), true_or_false(entry, "free", False, f"{name}: free")
    if tie is not None:
        if free or "value" in entry or not isinstance(tie, str):
            raise InputRefusedError(
                f'{name} has a tie, which gives its value: write tie = "expression" without value and free.'
            )
        if "prior" in entry:
            raise InputRefusedError(
                f"{name} has a tie and a prior; give the prior to the parameter it follows."
            )
        return Parameter(name, math.nan, False, quantity.lowest, quantity.highest, unit, tie)
    if "prior" in entry and not free:
        raise InputRefusedError(f"{name} has a prior but is fixed; write free = true, or remove the prior.")
    lowest, highest = entry.get("min"), entry.get("max")
    if free and (lowest is None or highest is None):
        raise InputRefusedError(f"{name} is free and needs a range: give min and max.")
    lowest = quantity.lowest if lowest is None else lowest
    highest = quantity.highest if highest is None else highest
    for key, value in (("min", lowest), ("max", highest)):
        bounded(value, quantity, f"{name}: {key}")
    if not lowest < highest:
        raise InputRefusedError(f"{name}: min = {lowest:g} is not below max = {highest:g}.")
    value = entry.get("value", (lowest + highest) / 2 if free else None)
    if value is None:
        raise InputRefusedError(f"{name} is fixed and has no value.")
    value = bounded(value, quantity, name)
    if free and not lowest <= value <= highest:
        raise InputRefusedError(
            f"{name}: the start value {value:g} lies outside its range {lowest:g} ... {highest:g}."
        )
    prior = _prior(name, entry)
    return Parameter(
        name,
        value,
        free,
        # What is fixed may lie outside the range that a fit once had.
        float(min(lowest, value)),
        float(max(highest, value)),
        unit,
        prior=prior,
        scale=quantity.scale,
        multimodal=quantity.multimodal,
    )


def _prior(name: str, entry: dict[str, Any]) -> Prior | None:
    prior = entry.get("prior")
    if prior is None:
        return None
    if not isinstance(prior, dict) or set(prior) != set(PRIOR):
        raise InputRefusedError(f"{name}: prior must be {{ mean = ..., standard_deviation = ... }}.")
    given = {key: bounded(prior[key], quantity, f"{name}: prior.{key}") for key, quantity in PRIOR.items()}
    if given["standard_deviation"] == 0:
        raise InputRefusedError(f"{name}: prior.standard_deviation is 0; fix the parameter instead.")
    return Prior(**given)


def is_number(value: Any) -> bool:
    """Whether a value of a file is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def bounded(value: Any, quantity: Quantity, name: str) -> float:
    """A finite number within limits, or a sentence."""
    unit, lowest, highest = f" {quantity.unit}" if quantity.unit else "", quantity.lowest, quantity.highest
    if not is_number(value):
        raise InputRefusedError(f"{name} is {value!r}; it must be a finite number{unit and ' in' + unit}.")
    if not lowest <= value <= highest:
        raise InputRefusedError(
            f"{name} is {value:g}{unit}; it must lie between {lowest:g} and {highest:g}{unit}."
        )
    return float(value)


def true_or_false(table: dict[str, Any], key: str, default: bool, name: str) -> bool:
    """A switch, or a sentence."""
    value = table.get(key, default)
    if not isinstance(value, bool):
        raise InputRefusedError(f"{name} is {value!r}; it must be true or false.")
    return value


def is_list_of_numbers(value: Any, least: int = 1) -> bool:
    """Whether a value of a file is a list of finite numbers, and of how many at least."""
    return isinstance(value, list) and len(value) >= least and all(is_number(v) for v in value)


def require_equally_many(where: str, **columns: list[float]) -> None:
    """Refuse two columns, given by their keys, that do not belong together."""
    (first, one), (second, other) = columns.items()
    if len(one) != len(other):
        raise InputRefusedError(
            f"{where}: {first} has {len(one)} entries and {second} {len(other)}; they must be equally many."
        )


def only(table: dict[str, Any], known, where: str) -> None:
    """Refuse keys that mean nothing, with the nearest that would."""
    for key in table:
        if key not in known:
            raise InputRefusedError(f"{where} has the key '{key}', {unknown_name(key, known)}")


def table_of(document: dict[str, Any], name: str) -> dict[str, Any]:
    """A table of a document, empty where the file is silent."""
    table = document.get(name, {})
    if not isinstance(table, dict):
        raise InputRefusedError(f"{name} must be a table: write [{name}] and its keys below.")
    return table


def choice(table: dict[str, Any], key: str, known: Collection[str], where: str) -> str:
    """One of a few words."""
    value = table.get(key)
    # A dictionary of the known cannot be asked for a list.
    if value not in tuple(known):
        raise InputRefusedError(f"{where} has {key} = {value!r}; it must be one of: {', '.join(known)}.")
    return value
