"""Geometries in which a colour is seen, by the names of CIE 15 or by their angles."""

import dataclasses
import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.measurement import QUANTITIES, Readings

# A hemisphere with the specular component unless it says otherwise, as most instruments have it.
_NAMED = {
    "45:0": "R_45_0",
    "0:45": "R_0_45",
    "8:di": "R_total",
    "8:d": "R_total",
    "8:de": "R_diffuse",
    "di:8": "R_di_8",
    "d:8": "R_di_8",
    "de:8": "R_de_8",
}
_NUMBER = r"(\d+(?:\.\d+)?)"
_ANGLES = re.compile(rf"(T )?{_NUMBER}:{_NUMBER}(?::(-?\d+(?:\.\d+)?))?")
_BEHIND_DEG = 180.0


@dataclasses.dataclass(frozen=True)
class Geometry:
    """Illumination and view of a colour.

    Parameters
    ----------
    name
        For people.
    quantity
        Name of `jaxink.measurement.readings.QUANTITIES`; None for a pair of directions through the sample.
    theta_i_deg, theta_o_deg, phi_deg
        Angles as in `jaxink.GonioData`; nan for a hemisphere.
    """

    name: str
    quantity: str | None
    theta_i_deg: float
    theta_o_deg: float
    phi_deg: float

    @classmethod
    def of(cls, text: "str | Geometry") -> "Geometry":
        """The geometry that a text names.

        Parameters
        ----------
        text
            ``45:0``, ``0:45``, ``8:di``, ``8:de``, ``di:8`` or ``de:8`` (``8:d`` and ``d:8`` include the
            specular component); a quantity of readings, such as ``T_total``; or the angles of incidence and
            view of a goniometer, ``30:15``, with an azimuth ``30:15:90`` (180, the specular side, if left
            out), and with ``T`` and a space in front for the far side.

        Raises
        ------
        InputRefusedError
            If it names none.
        """
        if isinstance(text, Geometry):
            return text
        name = " ".join(text.split())
        quantity = _NAMED.get(name, name if name in QUANTITIES else None)
        if quantity is not None:
            kind = QUANTITIES[quantity]
            theta_i, theta_o = (
                np.nan if angle is None else angle for angle in (kind.theta_i_deg, kind.theta_o_deg)
            )
            return cls(name, quantity, theta_i, theta_o, _BEHIND_DEG if kind.has_azimuth else np.nan)
        found = _ANGLES.fullmatch(name)
        if found is None:
            raise InputRefusedError(
                f"the geometry is {text!r}; it must be one of {', '.join(_NAMED)}, a quantity of readings "
                "such as T_total, or angles of incidence and view such as 30:15, 30:15:90 or 'T 0:20'."
            )
        behind, incidence, view, azimuth = found.groups()
        theta_i, theta_o = float(incidence), float(view)
        phi = _BEHIND_DEG if azimuth is None else float(azimuth)
        for angle, words in ((theta_i, "incidence"), (theta_o, "view")):
            if not angle < 90:
                raise InputRefusedError(
                    f"the angle of {words} of '{name}' is {angle:g}; it must be below 90."
                )
        if not -180 < phi <= 180:
            raise InputRefusedError(
                f"the azimuth of '{name}' is {phi:g}; it must be above -180, at most 180."
            )
        return cls(name, None if behind else "R_45_0", theta_i, theta_o, phi)

    @property
    def is_transmission(self) -> bool:
        """Whether light is seen that passed the sample."""
        return self.quantity is None or QUANTITIES[self.quantity].is_transmission


def readings_at(
    geometries: Sequence[Geometry], wavelength_nm: Float[np.ndarray, " wavelengths"]
) -> Readings | None:
    """Readings, of value 0, of those geometries that have a quantity, one after the other; None if none has.

    Parameters
    ----------
    geometries
        The geometries.
    wavelength_nm
        Wavelengths of each.
    """
    read = [g for g in geometries if g.quantity is not None]
    if not read:
        return None
    size = len(wavelength_nm)
    quantity, theta_i, theta_o, phi = (np.repeat([getattr(g, key) for g in read], size) for key in _COLUMNS)
    wave = np.tile(wavelength_nm, len(read))
    return Readings(quantity, theta_i, theta_o, phi, wave, np.zeros(len(wave)))


_COLUMNS = ("quantity", "theta_i_deg", "theta_o_deg", "phi_deg")
