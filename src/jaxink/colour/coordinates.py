"""Numbers of one colour, with standard errors from the covariance of its spectrum."""

import dataclasses
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float

from jaxink.colour.cie import difference, display_code, lab_of
from jaxink.colour.viewing import Viewing
from jaxink.display.card import Card, CardTable, Presented
from jaxink.errors import InputRefusedError
from jaxink.numerics.digits import with_uncertainty

NAMES = ("X", "Y", "Z", "x", "y", "L", "a", "b", "C", "h_deg")
# Relative step of a central difference, whose error is its square.
_STEP = 1e-5


def numbers_of(xyz: Float[np.ndarray, " 3"], white: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 10"]:
    """The numbers of `NAMES` of a colour: tristimulus values, chromaticity, CIELAB, chroma and hue."""
    chromaticity = xyz[:2] / xyz.sum()
    lab = lab_of(xyz, white)
    hue = np.rad2deg(np.arctan2(lab[2], lab[1])) % 360
    return np.array([*xyz, *chromaticity, *lab, np.hypot(lab[1], lab[2]), hue])


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Colour(Presented):
    """The colour of one spectrum of reflectance factors, or of transmittances.

    Parameters
    ----------
    name
        What is seen, and how, for people.
    viewing
        Light, observer and band.
    spectrum
        Reflectance factor at each wavelength, 1 of a perfect reflecting diffuser.
    covariance
        Of the spectrum; None if unknown.
    """

    name: str
    viewing: Viewing
    spectrum: Float[np.ndarray, " wavelengths"]
    covariance: Float[np.ndarray, "wavelengths wavelengths"] | None = None

    def __post_init__(self):
        if not self.xyz.sum() > 0:
            raise InputRefusedError(f"{self.name}: is black; a colour needs a spectrum above 0.")

    @property
    def xyz(self) -> Float[np.ndarray, " 3"]:
        """X, Y and Z; Y of a perfect reflecting diffuser is 100."""
        return self.viewing.weights @ self.spectrum

    @cached_property
    def values(self) -> dict[str, float]:
        """The numbers of `NAMES`."""
        found = numbers_of(self.xyz, self.viewing.white)
        return dict(zip(NAMES, found.tolist(), strict=True))

    @property
    def luminance_factor(self) -> float:
        """Y / 100: luminance over that of a perfect reflecting diffuser in the same light."""
        return self.values["Y"] / 100

    @property
    def xy(self) -> Float[np.ndarray, " 2"]:
        """Chromaticity."""
        return np.array([self.values["x"], self.values["y"]])

    @property
    def lab(self) -> Float[np.ndarray, " 3"]:
        """CIELAB relative to a perfect reflecting diffuser in the same light."""
        return np.array([self.values[name] for name in ("L", "a", "b")])

    @property
    def lch(self) -> Float[np.ndarray, " 3"]:
        """Lightness, chroma and hue angle in degrees."""
        return np.array([self.values[name] for name in ("L", "C", "h_deg")])

    @cached_property
    def slopes(self) -> Float[np.ndarray, "10 wavelengths"]:
        """Derivatives of `values` by the spectrum."""
        white, xyz = self.viewing.white, self.xyz
        by_xyz = []
        for step in _STEP * np.diag(white):
            change = numbers_of(xyz + step, white) - numbers_of(xyz - step, white)
            # A hue next to 0 may pass it.
            change[-1] = (change[-1] + 180) % 360 - 180
            by_xyz.append(change / (2 * step.sum()))
        return np.stack(by_xyz, axis=1) @ self.viewing.weights

    @cached_property
    def standard_errors(self) -> dict[str, float] | None:
        """Standard error of each of `values`; None if the covariance of the spectrum is unknown."""
        if self.covariance is None:
            return None
        variance = np.einsum("nw,wv,nv->n", self.slopes, self.covariance, self.slopes)
        return dict(zip(NAMES, np.sqrt(np.maximum(variance, 0.0)).tolist(), strict=True))

    @property
    def display_code(self) -> str:
        """Colour for a display; see `jaxink.colour.cie.display_code`."""
        return display_code(self.lab)

    def difference(self, other: "Colour") -> float:
        """CIEDE2000 to a colour in the same light.

        Raises
        ------
        InputRefusedError
            If the other one is seen in other light, by another observer or in another band.
        """
        if not _is_same(self.viewing, other.viewing):
            raise InputRefusedError(
                f"the colours '{self.name}' and '{other.name}' are seen in different light "
                f"({self.viewing.sentence[:-1]}; {other.viewing.sentence[:-1]}); give them the same "
                "wavelengths, illuminant and observer."
            )
        return float(difference(self.lab, other.lab))

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "name": self.name,
            "illuminant": self.viewing.illuminant,
            "observer_deg": self.viewing.observer_deg,
            "range_nm": list(self.viewing.range_nm),
            "wavelength_nm": self.viewing.wavelength_nm.tolist(),
            "reflectance_factor": self.spectrum.tolist(),
            "luminance_factor": self.luminance_factor,
            **self.values,
            "standard_errors": self.standard_errors,
            "display": self.display_code,
        }

    def row(self) -> list[str]:
        """Cells of a table of colours below `HEADS`."""
        errors = self.standard_errors or dict.fromkeys(NAMES)
        shown = [with_uncertainty(self.values[name], errors[name]) for name in NAMES]
        return [self.name, *shown, self.display_code]

    def card(self) -> Card:
        """Its numbers, and the light."""
        table = CardTable(HEADS, [self.row()], (0, len(HEADS) - 1))
        return Card(f"Colour of {self.name}", [self.viewing.sentence], (table,))


HEADS = ("colour", "X", "Y", "Z", "x", "y", "L*", "a*", "b*", "C*", "h, deg", "display")


def _is_same(one: Viewing, other: Viewing) -> bool:
    return (
        one.observer_deg == other.observer_deg
        and one.weights.shape == other.weights.shape
        and np.allclose(one.weights, other.weights, rtol=1e-9, atol=1e-9)
    )
