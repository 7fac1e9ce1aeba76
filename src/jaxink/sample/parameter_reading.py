"""Reading the numbers of a sample file: parameters, dispersions, materials, columns of spectra."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.materials import material
from jaxink.measurement import read_spectrum
from jaxink.sample.dispersion import Dispersion, read_dispersion
from jaxink.sample.entries import (
    is_list_of_numbers,
    missing,
    parameter_entry,
    parameter_of,
    smoothness_of,
    true_or_false,
)
from jaxink.sample.parameters import Parameter
from jaxink.sample.schema import Quantity
from jaxink.sample.ties import at_wavelength, whole_names

# Quantities that are the same in light of any wavelength.
_WITHOUT_SPECTRUM = (
    *("thickness_mm", "thickness_um", "radius_nm", "radius_variance_ln", "volume_fraction"),
    *("beam_diameter_mm", "detector_diameter_mm"),
)
_K = ("particle_absorption_index",)
# 4 pi k / wavelength, in 1/mm for wavelengths in nm.
_BULK = ("absorption_per_mm", "binder_absorption_per_mm")
_NM_PER_MM = 1e6


class ParameterReader:
    """Collects the parameters and dispersions of a file.

    Parameters
    ----------
    wavelengths_nm
        Wavelengths of the file, ascending.
    folder
        Folder of files of spectra; None: the working folder.
    """

    def __init__(self, wavelengths_nm: tuple[float, ...], folder: Path | None = None):
        self.wavelengths_nm = wavelengths_nm
        self.folder = folder or Path()
        self.dispersions: list[Dispersion] = []
        self._parameters: list[Parameter] = []
        # Ties of values at the wavelengths, whose names are completed when all are known.
        self._wavelength_of: dict[str, float] = {}

    @property
    def parameters(self) -> list[Parameter]:
        """All that were read; the tie of a value at a wavelength names the values at this wavelength."""
        names = {p.name for p in self._parameters}
        self._require_no_formula()
        return [
            dataclasses.replace(p, tie=at_wavelength(p.tie, self._wavelength_of[p.name], names))
            if p.tie is not None and p.name in self._wavelength_of
            else p
            for p in self._parameters
        ]

    def is_by_wavelength(self, name: str) -> bool:
        """Whether a quantity that was read has a value at each wavelength."""
        return any(p.name.startswith(f"{name}@") for p in self._parameters)

    def _require_no_formula(self) -> None:
        """Reject ties to a quantity by formula, which is no parameter."""
        formulas = {dispersion.name: dispersion for dispersion in self.dispersions}
        for p in self._parameters:
            for name in sorted(whole_names(p.tie or "") & formulas.keys()):
                coefficients = ", ".join(f"{name}.{key}" for key in formulas[name].coefficients)
                raise InputRefusedError(
                    f"{p.name}: the tie '{p.tie}' names {name}, which follows a formula; tie to its "
                    f"coefficients instead: {coefficients}."
                )

    def read(self, owner: str, quantities: dict[str, Quantity], table: dict[str, Any]) -> None:
        """Read the numbers of one table; ``owner`` is the first part of their names."""
        for key, quantity in quantities.items():
            self._read_one(f"{owner}.{key}", key, quantity, table)

    def _read_one(self, name: str, key: str, quantity: Quantity, table: dict[str, Any]) -> None:
        given = table.get(key, quantity.default)
        if given is None:
            raise missing(name, key, quantity)
        if isinstance(given, dict) and given.keys() & {"material", "file"}:
            given = with_spectrum(name, key, given, quantity, self.wavelengths_nm, self.folder)
        if isinstance(given, dict) and given.keys() & {"dispersion", "law"}:
            dispersion, coefficients = read_dispersion(name, given, quantity)
            self.dispersions.append(dispersion)
            self._parameters.extend(coefficients)
            return
        entry = parameter_entry(given, name, quantity)
        if isinstance(entry.get("tie"), list):
            raise InputRefusedError(
                f"{name} has a list of ties; a tie is one expression. For values in fixed ratios at the "
                "wavelengths, write shape = [...] with one number for each, and free or tie for their mean."
            )
        by_wavelength = true_or_false(entry, "per_wavelength", False, f"{name}: per_wavelength")
        if "smoothness" in entry and not by_wavelength:
            raise InputRefusedError(
                f"{name} has a smoothness, but no values by wavelength; write per_wavelength = true, or "
                "remove the smoothness."
            )
        if "shape" in entry:
            self._parameters += self._in_fixed_ratios(name, key, entry, quantity)
        elif by_wavelength:
            self._parameters += self._at_each_wavelength(name, entry, quantity)
            self._wavelength_of |= {f"{name}@{wave:g}": wave for wave in self.wavelengths_nm}
        else:
            self._parameters.append(parameter_of(name, entry, quantity))

    def _in_fixed_ratios(
        self, name: str, key: str, entry: dict[str, Any], quantity: Quantity
    ) -> list[Parameter]:
        """The mean over the wavelengths, and the values at them, tied to it."""
        if key in _WITHOUT_SPECTRUM:
            raise InputRefusedError(f"{name} has a shape, but is the same at every wavelength; remove it.")
        self._require_wavelengths(name, "a shape")
        shape, n = entry["shape"], len(self.wavelengths_nm)
        if not is_list_of_numbers(shape) or len(shape) != n or min(shape) < 0 or max(shape) == 0:
            raise InputRefusedError(
                f"{name}: shape must be a list of {n} numbers, one for each wavelength in ascending order, "
                "none negative and not all 0."
            )
        if "per_wavelength" in entry or isinstance(entry.get("value"), list):
            raise InputRefusedError(
                f"{name} has a shape, which gives the ratios of the values at the wavelengths; write value = "
                "<their mean>, without per_wavelength."
            )
        mean = parameter_of(name, {k: v for k, v in entry.items() if k != "shape"}, quantity)
        factors = [float(one) * n / math.fsum(shape) for one in shape]
        if mean.tie is None:
            _require_possible(mean, factors, quantity)
        limits = quantity.lowest, quantity.highest, quantity.unit
        return [
            dataclasses.replace(mean, shape=tuple(map(float, shape))),
            *(
                Parameter(f"{name}@{wavelength:g}", math.nan, False, *limits, f"{factor!r} * {name}")
                for wavelength, factor in zip(self.wavelengths_nm, factors, strict=True)
            ),
        ]

    def _require_wavelengths(self, name: str, what: str) -> None:
        if not self.wavelengths_nm:
            raise InputRefusedError(
                f"{name} has {what}, but the file gives no wavelengths; write "
                "wavelength_nm = [...] at the top."
            )

    def _at_each_wavelength(self, name: str, entry: dict[str, Any], quantity: Quantity) -> list[Parameter]:
        self._require_wavelengths(name, "per_wavelength = true")
        wavelengths, values = self.wavelengths_nm, entry.get("value")
        values = values if isinstance(values, list) else [values] * len(wavelengths)
        if len(values) != len(wavelengths):
            raise InputRefusedError(
                f"{name} has {len(values)} values for {len(wavelengths)} wavelengths; give one for each in "
                "ascending order of wavelength, or a single one."
            )
        smoothness = smoothness_of(name, entry)
        common = {k: v for k, v in entry.items() if k not in ("per_wavelength", "value", "smoothness")}
        each = [common if value is None else common | {"value": value} for value in values]
        if isinstance(entry.get("free"), list):
            each = self._free_at_some(name, each, entry["free"], smoothness)
        pairs = zip(wavelengths, each, strict=True)
        return [
            dataclasses.replace(parameter_of(f"{name}@{wavelength:g}", one, quantity), smoothness=smoothness)
            for wavelength, one in pairs
        ]

    def _free_at_some(self, name: str, each: list[dict], free: list, smoothness) -> list[dict]:
        """Entries at each wavelength, some of which are free."""
        if len(free) != len(each) or not all(isinstance(one, bool) for one in free):
            raise InputRefusedError(
                f"{name}: free must be true, false, or a list of {len(each)} of them, one for each "
                "wavelength in ascending order."
            )
        if smoothness is not None or any("prior" in one for one in each):
            raise InputRefusedError(
                f"{name} is free at some wavelengths only, so it can have no smoothness and no prior; write "
                "free = true, or remove them."
            )
        return [entry | {"free": one} for entry, one in zip(each, free, strict=True)]


def _require_possible(mean: Parameter, factors: list[float], quantity: Quantity) -> None:
    """Reject a mean whose values at the wavelengths may be impossible, at the start or in a fit."""
    for value in (mean.minimum, mean.maximum) if mean.free else (mean.value,):
        for factor in (min(factors), max(factors)):
            if not quantity.lowest <= factor * value <= quantity.highest:
                raise InputRefusedError(
                    f"{mean.name}: with its shape, a mean of {value:g} gives {factor * value:g} at a "
                    f"wavelength; it must lie between {quantity.lowest:g} and {quantity.highest:g}."
                )


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
        k
        for k in ("material", "file", "value", "dispersion", "law", "tie", "shape")
        if k in given and k != source
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
