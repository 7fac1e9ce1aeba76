"""Units of columns, as they are written, and factors of those that need a conversion."""

import re
import unicodedata

UNITS = {
    "deg": (
        "deg",
        "degs",
        "degree",
        "degrees",
        "°",
        "\N{MASCULINE ORDINAL INDICATOR}",
        "grad",
        "degre",
        "degres",
    )
    + ("度", "grado", "grados", "gradi"),
    "nm": ("nm", "nanometer", "nanometers", "nanometre", "nanometres", "ナノメートル"),
    "1/sr": (
        "1/sr",
        "/sr",
        "sr-1",
        "sr^-1",
        "sr^{-1}",
        "sr^(-1)",
        "sr**-1",
        "sr⁻¹",
        "persr",
        "per_sr",
        "1/steradian",
    ),
}
UNIT_OF = dict.fromkeys(("theta_i_deg", "theta_o_deg", "phi_deg", "phi_i_deg", "phi_o_deg"), "deg")
UNIT_OF |= {"wavelength_nm": "nm", "bsdf_per_sr": "1/sr", "sigma_per_sr": "1/sr"}
# Units that need a conversion, by the unit of the column.
CONVERSIONS = {
    "deg": {"rad": "180/pi", "radian": "180/pi", "radians": "180/pi", "mrad": "0.18/pi", "gon": "0.9"},
    "nm": {
        **dict.fromkeys(("um", "\N{MICRO SIGN}m", "\N{GREEK SMALL LETTER MU}m", "micron", "microns"), "1000"),
        **{"m": "1e9", "mm": "1e6", "a": "0.1", "å": "0.1", "angstrom": "0.1"},
    },
    "1/sr": {"%": "0.01, if it is per cent of 1/sr", "percent": "0.01, if it is per cent of 1/sr"}
    | {"%/sr": "0.01", "pct": "0.01, if it is per cent of 1/sr"},
}


def plain_unit(cell: str) -> str:
    """A unit in small letters without accents, spaces and brackets."""
    word = re.sub(r"[\s\[\]()]", "", cell).lower().replace("\N{MINUS SIGN}", "-").replace("·", "")
    return "".join(c for c in unicodedata.normalize("NFD", word) if not unicodedata.combining(c))
