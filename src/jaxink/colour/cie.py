"""Illuminants and observers of the CIE, as tabulated by the package colour-science."""

import warnings
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError, require_one_of

ILLUMINANTS = ("D65", "D50", "A", "E")
OBSERVERS = {2: "CIE 1931 2 Degree Standard Observer", 10: "CIE 1964 10 Degree Standard Observer"}
# Ends of what all illuminants and observers tabulate, nm.
VISIBLE_NM = (360.0, 780.0)


@cache
def science() -> Any:
    """The package colour-science, which puts an object in the place of its module.

    Raises
    ------
    InputRefusedError
        If it is not installed.
    """
    try:
        # Its import sets how numpy writes numbers, with 12 digits; that is for the user to choose.
        with warnings.catch_warnings(), np.printoptions():
            # It says which of its other features lack a package.
            warnings.simplefilter("ignore")
            import colour
    except ImportError:
        raise InputRefusedError(
            "colours need the package colour-science, which is not installed; run "
            "`pip install 'jaxink[colour]'`."
        ) from None
    return colour


@cache
def matching_functions(
    observer_deg: int,
) -> tuple[Float[np.ndarray, " wavelengths"], Float[np.ndarray, "3 wavelengths"]]:
    """Wavelengths in nm and colour-matching functions of a standard observer.

    Parameters
    ----------
    observer_deg
        2 (CIE 1931) or 10 (CIE 1964).
    """
    if observer_deg not in OBSERVERS:
        raise InputRefusedError(f"the observer is {observer_deg!r} degrees; it must be 2 or 10.")
    table = science().MSDS_CMFS[OBSERVERS[observer_deg]]
    return np.asarray(table.wavelengths, float), np.asarray(table.values, float).T


@cache
def illuminant_spectrum(
    name: str,
) -> tuple[Float[np.ndarray, " wavelengths"], Float[np.ndarray, " wavelengths"]]:
    """Wavelengths in nm and relative power of a standard illuminant, one of `ILLUMINANTS`."""
    require_one_of("the illuminant", name, ILLUMINANTS)
    table = science().SDS_ILLUMINANTS[name]
    return np.asarray(table.wavelengths, float), np.asarray(table.values, float)


def lab_of(
    xyz: Float[np.ndarray, "*colours 3"], white: Float[np.ndarray, " 3"]
) -> Float[np.ndarray, "*colours 3"]:
    """CIELAB of tristimulus values, relative to a white that reflects everything."""
    colour = science()
    # The library takes the white as chromaticity, with Y = 1.
    return colour.XYZ_to_Lab(xyz / white[1], colour.XYZ_to_xy(white))


def difference(one: Float[np.ndarray, "*colours 3"], other: Float[np.ndarray, "*colours 3"]):
    """CIEDE2000 between two colours given as CIELAB."""
    return science().delta_E(one, other, method="CIE 2000")


def display_code(lab: Sequence[float] | Float[np.ndarray, " 3"]) -> str:
    """Colour of a display, such as ``#ad4f32``, of the same CIELAB with D65 as white.

    What a display cannot show is clipped to what it can.
    """
    colour = science()
    white = colour.CCS_ILLUMINANTS[OBSERVERS[2]]["D65"]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        rgb = colour.XYZ_to_sRGB(colour.Lab_to_XYZ(np.asarray(lab, float), white))
    levels = np.round(255 * np.clip(np.nan_to_num(rgb), 0, 1)).astype(int)
    return "#" + "".join(f"{level:02x}" for level in levels.tolist())
