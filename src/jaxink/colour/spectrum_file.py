"""Files with the spectrum of an illuminant, or with the reflectance of a card."""

from pathlib import Path

from jaxink.colour.viewing import Illuminant
from jaxink.measurement.spectrum_file import read_spectrum


def read_illuminant(path: str | Path) -> Illuminant:
    """The illuminant in a file with the columns ``wavelength_nm`` and ``power``."""
    path = Path(path)
    return Illuminant(path.stem, *read_spectrum(path, "power"))


def read_card(path: str | Path) -> dict[float, float]:
    """Reflectance by wavelength of a card, from the columns ``wavelength_nm`` and ``reflectance``."""
    wave, value = read_spectrum(path, "reflectance")
    return dict(zip(wave.tolist(), value.tolist(), strict=True))
