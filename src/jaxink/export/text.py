"""Numbers and headers of the text formats."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from jaxink.export.guide import media
from jaxink.ink import InkTable

# Relative rounding error below 1e-8.
_DIGITS = "%.9g"
_VALUES = "radiance over irradiance in 1/sr, cosine not included"


def row(values: Iterable[float], separator: str = " ") -> str:
    """Numbers on one line."""
    return separator.join([_DIGITS % value for value in values])


def block(values: np.ndarray) -> str:
    """Rows of a matrix, one per line."""
    return "\n".join([row(line) for line in values.tolist()])


def provenance(table: InkTable, wavelength: int, values: str = _VALUES) -> list[str]:
    """Contents and origin of a file, for its comments; ``values`` is the quantity."""
    inside, outside = media(table)
    lines = [
        f"BSDF by jaxink, {table.wavelength_nm[wavelength]:.10g} nm; I: {inside}, index "
        f"{table.index_inside[wavelength]:.9g}; A: {outside}, index {table.index_outside[wavelength]:.9g}",
        "the surface is the face between I and A; its normal points from I to A",
        f"values: {values}",
    ]
    for key, value in table.attrs.items():
        lines.append(f"{key}: {' '.join(str(value).split())}")
    return lines


def comments(table: InkTable, wavelength: int) -> list[str]:
    """`provenance` as comment lines."""
    return [f"# {line}" for line in provenance(table, wavelength)]


def write_lines(path: Path, lines: Iterable[str]) -> None:
    """Write an ASCII text file."""
    path.write_text("\n".join([*lines, ""]), encoding="ascii", errors="replace")


def stem(table: InkTable, wavelength: int, name: str) -> str:
    """Prefix of a file name: name of the ink and wavelength."""
    return f"{name}_{table.wavelength_nm[wavelength]:.10g}nm"
