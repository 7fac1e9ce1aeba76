"""A spectrum in two columns of a CSV file."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from jaxink.measurement.checks import WAVELENGTH_RANGE_NM, numbers
from jaxink.measurement.table import refusal
from jaxink.measurement.text_file import read_table


def read_spectrum(
    path: str | Path, column: str
) -> tuple[Float[np.ndarray, " samples"], Float[np.ndarray, " samples"]]:
    """Wavelengths in nm, ascending, and the values of one column.

    Parameters
    ----------
    path
        CSV file with a header.
    column
        Name of the column of values beside ``wavelength_nm``.

    Raises
    ------
    InputRefusedError
        If the file is invalid, the wavelengths do not ascend, or a value is negative; the message names row
        and column.
    """
    table = read_table(Path(path))
    columns = []
    for name in ("wavelength_nm", column):
        if name not in table.names:
            text = f"is missing; a spectrum has the columns wavelength_nm and {column}"
            raise refusal(table.source, text, table.header_line, name)
        columns.append(numbers(table, table.names.index(name), name))
    wave, value = columns
    lines = np.asarray(table.lines)
    if len(wave) < 2:
        raise refusal(table.source, "has one row; a spectrum needs two or more")
    low, high = WAVELENGTH_RANGE_NM
    for k in range(len(wave)):
        if not low <= wave[k] <= high:
            text = f"is {wave[k]:g}; it must be between {low:g} and {high:g} nm"
            raise refusal(table.source, text, int(lines[k]), "wavelength_nm")
        if k and not wave[k] > wave[k - 1]:
            text = f"is {wave[k]:g} after {wave[k - 1]:g}; wavelengths must ascend"
            raise refusal(table.source, text, int(lines[k]), "wavelength_nm")
        if not value[k] >= 0:
            raise refusal(table.source, f"is {value[k]:g}; it must be at least 0", int(lines[k]), column)
    return wave, value
