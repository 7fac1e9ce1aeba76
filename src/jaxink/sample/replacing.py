"""Other values for parameters of a sample, in any unit of their quantity, checked against their ranges."""

import math
import re
from collections.abc import Mapping

from jaxink.errors import InputRefusedError, require_number
from jaxink.sample.hints import unknown_key
from jaxink.sample.parameters import ParameterTable

_ASSIGNMENT = re.compile(r"\s*([^=\s]+)\s*=\s*([-+.,\deE]+)\s*(\S*)\s*")
_LENGTHS_M = {"nm": 1e-9, "um": 1e-6, "\N{MICRO SIGN}m": 1e-6, "\N{GREEK SMALL LETTER MU}m": 1e-6}
_LENGTHS_M |= {"micron": 1e-6, "microns": 1e-6, "mic": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0}
# Of one quantity each, in one unit.
_QUANTITIES = (
    _LENGTHS_M,
    {f"1/{unit}": 1 / size for unit, size in _LENGTHS_M.items()},
    {"deg": 1.0, "rad": 180 / math.pi},
)
# One and a half thousand, or one and a half.
AMBIGUOUS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")


def with_values(table: ParameterTable, values: Mapping[str, float]) -> ParameterTable:
    """The table with other values; what is tied to them follows.

    Parameters
    ----------
    table
        The parameters.
    values
        Value of each parameter that changes, by its name and in its unit.

    Raises
    ------
    InputRefusedError
        For a name that does not exist, a tied parameter, or a value that is no number or out of its range.
    """
    for name, value in values.items():
        if name not in table:
            raise InputRefusedError(f"a value is given for {name}, {_hint(name, table)}")
        parameter = table[name]
        require_number(name, value)
        if parameter.tie is not None:
            raise InputRefusedError(
                f"{name} is tied to '{parameter.tie}', so it cannot be given a value; set what it is tied to."
            )
        if not parameter.minimum <= value <= parameter.maximum:
            raise InputRefusedError(
                f"{name} = {value:g} is out of its range; it must be between {parameter.minimum:g} and "
                f"{parameter.maximum:g}{' ' if parameter.unit else ''}{parameter.unit}."
            )
    return table.at({name: float(value) for name, value in values.items()})


def assigned(table: ParameterTable, texts: list[str]) -> dict[str, float]:
    """Values by name from texts such as ``ink.thickness_um=60`` or ``ink.thickness_um=0.06 mm``.

    Parameters
    ----------
    table
        The parameters, whose units a number without one has; one with another unit is converted.
    texts
        The assignments.

    Raises
    ------
    InputRefusedError
        For a text of another form, a name that does not exist or is given twice, or a unit that does not
        suit.
    """
    values: dict[str, float] = {}
    for text in texts:
        found = _ASSIGNMENT.fullmatch(text)
        if found is None:
            raise InputRefusedError(
                f"--set '{text}': must be NAME=VALUE, such as ink.thickness_um=60, or with a unit, "
                "'ink.thickness_um=0.06 mm'."
            )
        name, number, unit = found.groups()
        if name not in table:
            raise InputRefusedError(f"--set '{text}': names {name}, {_hint(name, table)}")
        if name in values:
            raise InputRefusedError(f"--set '{text}': {name} is set twice; set it once.")
        if AMBIGUOUS.fullmatch(number):
            raise InputRefusedError(
                f"--set '{text}': '{number}' can be {number.replace(',', '')} or {number.replace(',', '.')}; "
                "write a point."
            )
        try:
            value = float(number.replace(",", ".", 1))
        except ValueError:
            raise InputRefusedError(f"--set '{text}': '{number}' is not a number.") from None
        values[name] = _in_own_unit(name, value, unit, table[name].unit) if unit else value
    return values


def _in_own_unit(name: str, value: float, given: str, own: str) -> float:
    found = converted(value, given, own)
    if found is None:
        wanted = f"in {own}" if own else "a pure number"
        raise InputRefusedError(f"--set: {name} is given in {given}; it must be {wanted}.")
    return found


def _hint(name: str, table: ParameterTable) -> str:
    """That a parameter does not exist; near names are those of its wavelengths, if it has some."""
    by_wavelength = [one for one in table if one.partition("@")[0] == name]
    if not by_wavelength:
        return unknown_key(name, table)
    return f"which has one value for each wavelength: {', '.join(by_wavelength)}."


def is_length(unit: str) -> bool:
    """Whether a unit is one of a length."""
    return unit in _LENGTHS_M


def converted(value: float, given: str, own: str) -> float | None:
    """A value in another unit; None if the two are not of one quantity.

    Parameters
    ----------
    value
        The number.
    given, own
        Its unit, in capitals or not, and the wanted one.
    """
    if given == own:
        return value
    given = given.lower()
    for units in _QUANTITIES:
        if given in units and own in units:
            # Of 0.09 mm, 90 um and not 89.99999999999999.
            return float(f"{value * units[given] / units[own]:.12g}")
    return None
