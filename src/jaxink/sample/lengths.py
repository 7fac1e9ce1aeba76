"""Thicknesses in millimetres or micrometres, whichever the user has."""

import math
from decimal import Decimal
from typing import Any

from jaxink.errors import InputRefusedError

# The other key, and the power of ten from its unit to that of the parameter.
_OTHER = {"thickness_mm": ("thickness_um", -3), "thickness_um": ("thickness_mm", 3)}


def with_own_thickness(table: dict[str, Any], layer: str, own: str) -> dict[str, Any]:
    """The table of a layer with the thickness in the unit of its parameter: value, range and prior.

    Parameters
    ----------
    table
        The layer's table in the file.
    layer
        Its name.
    own
        Key of the parameter: ``thickness_mm`` of a clear layer, ``thickness_um`` of a scattering one.

    Raises
    ------
    InputRefusedError
        If both keys are present, or the other one has a tie or a unit that is not its own.
    """
    other, power = _OTHER[own]
    if other not in table:
        return table
    if own in table:
        raise InputRefusedError(f"layer '{layer}' has both {own} and {other}; remove one of them.")
    given = table[other]
    unit, own_unit = other.rpartition("_")[2], own.rpartition("_")[2]
    if isinstance(given, dict):
        if "tie" in given:
            raise InputRefusedError(
                f"{layer}.{other} has a tie, but the parameter is {layer}.{own}, in {own_unit}; write "
                f'{own} = {{ tie = "..." }} with an expression in this unit.'
            )
        if given.get("unit", unit) != unit:
            raise InputRefusedError(
                f"{layer}.{other} has unit = {given['unit']!r}; the unit must be {unit}, as in its name."
            )
        given = {key: value for key, value in given.items() if key != "unit"}
    return {key: value for key, value in table.items() if key != other} | {own: _scaled(given, power)}


def _scaled(given: Any, power: int) -> Any:
    """Numbers times a power of ten, also in lists and tables; anything else is left to the checks."""
    if isinstance(given, dict):
        return {key: _scaled(value, power) for key, value in given.items()}
    if isinstance(given, list):
        return [_scaled(value, power) for value in given]
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        return given
    # In decimals: 0.07 mm are 70 um, not 70.00000000000001.
    return float(Decimal(str(given)).scaleb(power))
