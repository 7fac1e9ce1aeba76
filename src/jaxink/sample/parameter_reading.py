"""Reading the numbers of a sample file: parameters, one for each wavelength if needed, and dispersions."""

from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.sample.dispersion import Dispersion, read_dispersion
from jaxink.sample.entries import missing, parameter_entry, parameter_of, true_or_false
from jaxink.sample.parameters import Parameter
from jaxink.sample.quantity import Quantity


class ParameterReader:
    """Collects the parameters and dispersions of a file.

    Parameters
    ----------
    wavelengths_nm
        Wavelengths of the file, ascending.
    """

    def __init__(self, wavelengths_nm: tuple[float, ...]):
        self.wavelengths_nm = wavelengths_nm
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
        if isinstance(given, dict) and "dispersion" in given:
            dispersion, coefficients = read_dispersion(name, given, quantity)
            self.dispersions.append(dispersion)
            self.parameters.extend(coefficients)
            return
        entry = parameter_entry(given, name, quantity)
        if true_or_false(entry, "per_wavelength", False, f"{name}: per_wavelength"):
            self.parameters += self._at_each_wavelength(name, entry, quantity)
        else:
            self.parameters.append(parameter_of(name, entry, quantity))

    def _at_each_wavelength(self, name: str, entry: dict[str, Any], quantity: Quantity) -> list[Parameter]:
        wavelengths, values = self.wavelengths_nm, entry.get("value")
        if not wavelengths:
            raise InputRefusedError(
                f"{name} has per_wavelength = true, but the file gives no wavelengths; write "
                "wavelength_nm = [...] at the top."
            )
        values = values if isinstance(values, list) else [values] * len(wavelengths)
        if len(values) != len(wavelengths):
            raise InputRefusedError(
                f"{name} has {len(values)} values for {len(wavelengths)} wavelengths; give one for each in "
                "ascending order of wavelength, or a single one."
            )
        common = {k: v for k, v in entry.items() if k not in ("per_wavelength", "value")}
        each = [common if value is None else common | {"value": value} for value in values]
        pairs = zip(wavelengths, each, strict=True)
        return [parameter_of(f"{name}@{wavelength:g}", one, quantity) for wavelength, one in pairs]
