"""Units as people write them with a number, and what each is in another of its quantity."""

import math
import re

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
