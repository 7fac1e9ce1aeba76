"""Reading the numbers of a sample file: parameters, one for each wavelength if needed, and dispersions."""

import dataclasses
import math
from pathlib import Path
from typing import Any

from jaxink.errors import InputRefusedError
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
from jaxink.sample.quantity import Quantity
from jaxink.sample.spectra import with_spectrum

# Quantities that are the same in light of any wavelength.
_WITHOUT_SPECTRUM = (
    *("thickness_mm", "thickness_um", "radius_nm", "radius_variance_ln", "volume_fraction"),
    *("beam_diameter_mm", "detector_diameter_mm"),
)


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
        self.parameters: list[Parameter] = []
        self.dispersions: list[Dispersion] = []

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
        if isinstance(given, dict) and "dispersion" in given:
            dispersion, coefficients = read_dispersion(name, given, quantity)
            self.dispersions.append(dispersion)
            self.parameters.extend(coefficients)
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
            self.parameters += self._in_fixed_ratios(name, key, entry, quantity)
        elif by_wavelength:
            self.parameters += self._at_each_wavelength(name, entry, quantity)
        else:
            self.parameters.append(parameter_of(name, entry, quantity))

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
