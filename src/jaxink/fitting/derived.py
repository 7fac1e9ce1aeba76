"""Optical properties of the layers, which follow from the fitted parameters."""

import dataclasses
from typing import NamedTuple


class OpticalProperty(NamedTuple):
    """What a derived quantity is called, its symbol and its unit."""

    name: str
    symbol: str
    unit: str = ""

    @property
    def words(self) -> str:
        """Name and symbol."""
        return f"{self.name} {self.symbol}".rstrip()


# By the names of the fields of a layer's coefficients.
OPTICAL_PROPERTIES = {
    "scattering_per_mm": OpticalProperty("scattering coefficient", "mu_s", "1/mm"),
    "absorption_per_mm": OpticalProperty("absorption coefficient", "mu_a", "1/mm"),
    "asymmetry_parameter": OpticalProperty("asymmetry parameter", "g"),
    "reduced_scattering_per_mm": OpticalProperty("reduced scattering", "mu_s (1 - g)", "1/mm"),
    "reduced_optical_thickness": OpticalProperty("reduced optical thickness", "mu_s (1 - g) d"),
}


@dataclasses.dataclass(frozen=True)
class DerivedQuantity:
    """A quantity derived from the parameters, for one layer at one wavelength.

    Parameters
    ----------
    layer, wavelength_nm
        The layer and the wavelength.
    quantity
        ``scattering_per_mm``, ``absorption_per_mm``, ``asymmetry_parameter`` g, ``reduced_scattering_per_mm``
        (scattering (1 - g)) or ``reduced_optical_thickness`` (that times the thickness). An opaque layer has
        no coefficients unless it consists of Mie particles.
    value, standard_error
        Value and one standard error from the covariance of the fit, None if unknown.
    """

    layer: str
    wavelength_nm: float
    quantity: str
    value: float
    standard_error: float | None

    @property
    def optical_property(self) -> OpticalProperty:
        """Its words and unit; in a file of a later version, it may be one that is unknown here."""
        return OPTICAL_PROPERTIES.get(self.quantity, OpticalProperty(self.quantity, ""))
