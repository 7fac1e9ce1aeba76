"""Light and observer of a colour: from a spectrum to tristimulus values by one linear map."""

import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float

from jaxink.colour.cie import VISIBLE_NM, illuminant_spectrum, matching_functions
from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.measurement import read_spectrum

# A cubic spline takes four values.
_CUBIC = 4


@dataclasses.dataclass(frozen=True, eq=False)
class Illuminant:
    """Spectrum of the light that is seen reflected.

    Parameters
    ----------
    name
        For people; of a standard illuminant, one of `jaxink.colour.cie.ILLUMINANTS`.
    wavelength_nm, power
        Relative power per nm, interpolated linearly.
    """

    __repr__ = brief_repr

    name: str
    wavelength_nm: Float[np.ndarray, " samples"]
    power: Float[np.ndarray, " samples"]

    @classmethod
    def of(cls, name: "str | Illuminant") -> "Illuminant":
        """A standard illuminant by its name; any other as it is."""
        return name if isinstance(name, Illuminant) else cls(name, *illuminant_spectrum(name))


@dataclasses.dataclass(frozen=True, eq=False)
class Viewing:
    """Illuminant and observer, limited to a band of wavelengths.

    A perfect reflecting diffuser has Y = 100 in that band, so colours of a band are relative to the light in
    it, and compare with no others.

    Parameters
    ----------
    illuminant
        Name of the illuminant.
    observer_deg
        2 or 10.
    wavelength_nm
        Wavelengths at which spectra are known, ascending.
    weights
        From a spectrum of reflectance factors to X, Y and Z.
    """

    __repr__ = brief_repr

    illuminant: str
    observer_deg: int
    wavelength_nm: Float[np.ndarray, " wavelengths"]
    weights: Float[np.ndarray, "3 wavelengths"]

    @classmethod
    def of(
        cls,
        wavelength_nm: Float[np.ndarray, " wavelengths"],
        illuminant: str | Illuminant = "D65",
        observer_deg: int = 2,
    ) -> "Viewing":
        """The map for spectra at some wavelengths.

        Spectra are interpolated by a cubic spline (by straight lines between fewer than four wavelengths)
        and summed in steps of 1 nm from the first wavelength to the last.

        Parameters
        ----------
        wavelength_nm
            Ascending; at least two.
        illuminant
            D65, D50, A, E, or another spectrum.
        observer_deg
            2 (CIE 1931) or 10 (CIE 1964).

        Raises
        ------
        InputRefusedError
            If there are fewer than two wavelengths in the visible, or the illuminant has no power there.

        References
        ----------
        CIE 15:2018, sections 7 and 8 (summation in steps of 1 nm; normalisation to the perfect diffuser).
        """
        wavelength_nm = np.asarray(wavelength_nm, float)
        inside = (wavelength_nm >= VISIBLE_NM[0]) & (wavelength_nm <= VISIBLE_NM[1])
        if inside.sum() < 2:
            raise InputRefusedError(
                f"a colour needs at least two wavelengths from {VISIBLE_NM[0]:g} to {VISIBLE_NM[1]:g} nm; "
                f"there {'is' if inside.sum() == 1 else 'are'} {_listed(wavelength_nm[inside])}."
            )
        known = wavelength_nm[inside]
        # Not before: reading the tables takes most of a second, and many measurements have no colour.
        light = Illuminant.of(illuminant)
        if known[0] < light.wavelength_nm[0] or known[-1] > light.wavelength_nm[-1]:
            raise InputRefusedError(
                f"the illuminant {light.name} is known from {light.wavelength_nm[0]:g} to "
                f"{light.wavelength_nm[-1]:g} nm; it must reach from {known[0]:g} to {known[-1]:g} nm."
            )
        grid = np.linspace(known[0], known[-1], 1 + max(1, round(known[-1] - known[0])))
        at, functions = matching_functions(observer_deg)
        power = np.interp(grid, light.wavelength_nm, light.power)
        seen = power * np.stack([np.interp(grid, at, one) for one in functions])
        if not seen[1].sum() > 0:
            raise InputRefusedError(
                f"the illuminant {light.name} has no visible power from {known[0]:g} to {known[-1]:g} nm."
            )
        # The 10-degree observer has none above 560 nm, and CIELAB divides by that of the white.
        if not seen.sum(axis=1).min() > 0:
            raise InputRefusedError(
                f"the {observer_deg}-degree observer has no blue from {known[0]:g} to {known[-1]:g} nm, so "
                "CIELAB does not exist there; give shorter wavelengths or another observer."
            )
        # Not before: most fits have no colour, and it brings a quarter of a second of other modules.
        from scipy.interpolate import make_interp_spline

        degree = 3 if len(known) >= _CUBIC else 1
        spline = make_interp_spline(known, np.eye(len(known)), k=degree)(grid)
        weights = np.zeros((3, len(wavelength_nm)))
        weights[:, inside] = 100 * seen @ spline / seen[1].sum()
        return cls(light.name, observer_deg, wavelength_nm, weights)

    @property
    def white(self) -> Float[np.ndarray, " 3"]:
        """X, Y and Z of a perfect reflecting diffuser in this band; Y is 100."""
        return self.weights.sum(axis=1)

    @property
    def range_nm(self) -> tuple[float, float]:
        """Ends of the band."""
        used = self.wavelength_nm[(self.weights != 0).any(axis=0)]
        return float(used[0]), float(used[-1])

    @property
    def sentence(self) -> str:
        """Light, observer and band, for people."""
        low, high = self.range_nm
        return (
            f"Illuminant {self.illuminant}, {low:g} to {high:g} nm only and normalised there, "
            f"{self.observer_deg}-degree observer, {len(self.wavelength_nm)} wavelengths."
        )


def _listed(wavelengths_nm: Float[np.ndarray, " wavelengths"]) -> str:
    return ", ".join(f"{wave:g} nm" for wave in wavelengths_nm) or "none"


def read_illuminant(path: str | Path) -> Illuminant:
    """The illuminant in a file with the columns ``wavelength_nm`` and ``power``."""
    path = Path(path)
    return Illuminant(path.stem, *read_spectrum(path, "power"))


def read_card(path: str | Path) -> dict[float, float]:
    """Reflectance by wavelength of a card, from the columns ``wavelength_nm`` and ``reflectance``."""
    wave, value = read_spectrum(path, "reflectance")
    return dict(zip(wave.tolist(), value.tolist(), strict=True))
