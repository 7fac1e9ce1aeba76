"""Quantities of a sample file that name a material, or a column of a file, in place of their values."""

from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.materials import material
from jaxink.measurement.spectrum_file import read_spectrum
from jaxink.sample.quantity import Quantity

_K = ("particle_absorption_index",)
# 4 pi k / wavelength, in 1/mm for wavelengths in nm.
_BULK = ("absorption_per_mm", "binder_absorption_per_mm")
_NM_PER_MM = 1e6


def with_spectrum(
    name: str,
    key: str,
    given: dict[str, Any],
    quantity: Quantity,
    wavelengths_nm: tuple[float, ...],
    folder: Path,
) -> dict[str, Any]:
    """The table of a quantity with values in the place of the material or file that it names.

    Parameters
    ----------
    name, key
        Dotted name, and key in the file.
    given
        With ``material``, a name of `jaxink.materials`, or ``file``, a CSV file with the columns
        ``wavelength_nm`` and ``column`` (by default the key). A refractive index becomes a table of its
        dispersion, any other quantity one value for each of the wavelengths of the sample, to which free,
        min, max and the like apply.
    quantity
        What it is.
    wavelengths_nm
        Of the sample.
    folder
        Of the file.

    Raises
    ------
    InputRefusedError
        If it names both, the material is unknown or not known at a wavelength, or values are given, too.
    """
    source = "material" if "material" in given else "file"
    wrong = [
        k for k in ("material", "file", "value", "dispersion", "tie", "shape") if k in given and k != source
    ]
    if wrong:
        raise InputRefusedError(
            f"{name} has {source} and {wrong[0]}, which both give its values; keep one of them."
        )
    column = given.get("column", key)
    if not isinstance(given[source], str) or not isinstance(column, str):
        raise InputRefusedError(f'{name}: {source} must be text, such as {source} = "{_example(source)}".')
    rest = {k: v for k, v in given.items() if k not in (source, "column", "per_wavelength")}
    if quantity.dispersive and (source == "material" or not wavelengths_nm or not rest):
        wave, value = _table(given[source], column, source, folder)
        return {"dispersion": "table", "wavelength_nm": wave.tolist(), "value": value.tolist()} | rest
    if not wavelengths_nm:
        raise InputRefusedError(
            f"{name} has a {source}, but the sample has no wavelengths; write wavelength_nm = [...] "
            "at the top."
        )
    at = np.array(wavelengths_nm)
    if source == "material":
        values = _of_material(name, key, given[source], at)
    else:
        wave, value = read_spectrum(folder / given[source], column)
        if at[0] < wave[0] or at[-1] > wave[-1]:
            raise InputRefusedError(
                f"{name}: {given[source]} reaches from {wave[0]:g} to {wave[-1]:g} nm; it must reach from "
                f"{at[0]:g} to {at[-1]:g} nm."
            )
        values = np.interp(at, wave, value)
    return {"per_wavelength": True, "value": values.tolist()} | rest


def _example(source: str) -> str:
    return "rutile" if source == "material" else "spectrum.csv"


def _table(given: str, column: str, source: str, folder: Path):
    """Wavelengths and refractive indices."""
    if source == "file":
        return read_spectrum(folder / given, column)
    found = material(given)
    return found.wavelength_nm, found.index


def _of_material(name: str, key: str, given: str, at: np.ndarray) -> np.ndarray:
    found = material(given)
    if key in _K:
        return found.k(at)
    if key in _BULK:
        return 4 * np.pi * found.k(at) / at * _NM_PER_MM
    raise InputRefusedError(
        f"{name} cannot be that of a material; refractive indices, {_K[0]} and {', '.join(_BULK)} can."
    )
