"""Materials by name: their complex index, and where it is from."""

import csv
import dataclasses
from functools import cache
from importlib import resources

import numpy as np
from jaxtyping import Float

from jaxink.display.brief import brief_repr
from jaxink.display.card import CardTable
from jaxink.errors import InputRefusedError, no_such_name

_SHOWN_NM = 550.0


@dataclasses.dataclass(frozen=True, eq=False)
class Material:
    """Complex index n + i k of a material, k >= 0.

    Parameters
    ----------
    name
        In sample files.
    what
        In words.
    sources
        Papers, and the database with its licence.
    wavelength_nm
        Of the table, ascending.
    index, absorption_index
        n and k at each; k is nan where the source has none, as where nothing is absorbed.
    """

    __repr__ = brief_repr

    name: str
    what: str
    sources: tuple[str, ...]
    wavelength_nm: Float[np.ndarray, " samples"]
    index: Float[np.ndarray, " samples"]
    absorption_index: Float[np.ndarray, " samples"]

    def n(self, wavelength_nm: Float[np.ndarray, " wavelengths"]) -> Float[np.ndarray, " wavelengths"]:
        """Real part, linear in 1 / wavelength^2 between the wavelengths of the table."""
        wave = self._inside(wavelength_nm)
        return np.interp(-(wave**-2), -(self.wavelength_nm**-2), self.index)

    def k(self, wavelength_nm: Float[np.ndarray, " wavelengths"]) -> Float[np.ndarray, " wavelengths"]:
        """Imaginary part, linear between the wavelengths of the table; 0 if the source has none at all.

        Raises
        ------
        InputRefusedError
            Outside the table, or where the source has no k although it has some elsewhere.
        """
        wave = self._inside(wavelength_nm)
        known = np.isfinite(self.absorption_index)
        if not known.any():
            return np.zeros(wave.shape)
        at, values = self.wavelength_nm[known], self.absorption_index[known]
        if wave.min() < at[0] or wave.max() > at[-1]:
            raise InputRefusedError(
                f"the absorption index of {self.name} is known from {at[0]:g} to {at[-1]:g} nm; "
                f"{wave.min():g} to {wave.max():g} nm are asked for."
            )
        return np.interp(wave, at, values)

    def _inside(self, wavelength_nm) -> np.ndarray:
        wave = np.asarray(wavelength_nm, float)
        low, high = self.wavelength_nm[0], self.wavelength_nm[-1]
        if wave.min() < low or wave.max() > high:
            raise InputRefusedError(
                f"the index of {self.name} is known from {low:g} to {high:g} nm; "
                f"{wave.min():g} to {wave.max():g} nm are asked for."
            )
        return wave


def names() -> tuple[str, ...]:
    """Names of all materials."""
    return tuple(sorted(file.name.removesuffix(".csv") for file in _folder().iterdir()))


def _folder():
    return resources.files("jaxink.materials").joinpath("tables")


@cache
def material(name: str) -> Material:
    """A material by its name.

    Raises
    ------
    InputRefusedError
        If there is none of that name.
    """
    if name not in names():
        raise InputRefusedError(f"the material is {name!r}, {no_such_name(names())}")
    lines = _folder().joinpath(f"{name}.csv").read_text(encoding="utf-8").splitlines()
    what, *sources = (line.removeprefix("#").strip() for line in lines if line.startswith("#"))
    _, *rows = csv.reader(line for line in lines if not line.startswith("#"))
    wave, n, k = np.array([[float(cell or "nan") for cell in row] for row in rows]).T
    return Material(name, what, tuple(sources), wave, n, k)


def listing() -> str:
    """All materials: what they are, range, index at 550 nm, and sources."""
    rows, sources = [], []
    for one in map(material, names()):
        at = np.array([_SHOWN_NM])
        low, high = one.wavelength_nm[0], one.wavelength_nm[-1]
        rows.append(
            [one.name, one.what, f"{low:g} to {high:g}", f"{one.n(at)[0]:.4g}", f"{one.k(at)[0]:.3g}"]
        )
        sources += [f"{one.name}: {source}" for source in one.sources]
    heads = ["material", "what", "nm", f"n at {_SHOWN_NM:g} nm", "k there"]
    return "\n".join([*CardTable(heads, rows, (0, 1)).lines(), "", "Sources", *sources])
