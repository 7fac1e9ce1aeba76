"""Numbers and heads of the text formats."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from jaxink.ink.table import InkTable

# Nine digits: a value comes back to better than 1e-8 of itself.
_DIGITS = "%.9g"


def row(values: Iterable[float], separator: str = " ") -> str:
    """Numbers on one line."""
    return separator.join([_DIGITS % value for value in values])


def block(values: np.ndarray) -> str:
    """Rows of a matrix, one a line."""
    return "\n".join([row(line) for line in values.tolist()])


def provenance(table: InkTable, wavelength: int) -> list[str]:
    """Lines that say what a file holds and where it comes from, for its comments."""
    lines = [
        f"BSDF by jaxink, {table.wavelength_nm[wavelength]:.10g} nm; I: inside of the plate, index "
        f"{table.index_inside[wavelength]:.9g}; A: other side, index {table.index_outside[wavelength]:.9g}",
        "values: radiance over irradiance in 1/sr, cosine not included",
    ]
    for key, value in table.attrs.items():
        lines.append(f"{key}: {' '.join(str(value).split())}")
    return lines


def comments(table: InkTable, wavelength: int) -> list[str]:
    """`provenance` as lines that programs pass over."""
    return [f"# {line}" for line in provenance(table, wavelength)]


def write_lines(path: Path, lines: Iterable[str]) -> None:
    """Write a text file for programs that know ASCII only."""
    path.write_text("\n".join([*lines, ""]), encoding="ascii", errors="replace")


def stem(table: InkTable, wavelength: int, name: str) -> str:
    """First part of a file's name: that of the ink and the wavelength."""
    return f"{name}_{table.wavelength_nm[wavelength]:.10g}nm"
