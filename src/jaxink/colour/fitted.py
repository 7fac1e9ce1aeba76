"""Colours of a fitted ink, in any arrangement, with the standard errors of the fit."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from jaxink.colour.arrangement import Arrangement, arranged_names, thickness_name
from jaxink.colour.at_points import ColoursAtPoints
from jaxink.colour.coordinates import HEADS, Colour
from jaxink.colour.geometry import Geometry
from jaxink.colour.of_sample import GEOMETRIES, ParameterCovariance, SampleSpectra, wavelengths_of
from jaxink.colour.viewing import Illuminant
from jaxink.display.card import Card, CardTable, Presented
from jaxink.sample import Sample


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class FittedColours(Presented):
    """Colours of a fitted sample in some geometries.

    Parameters
    ----------
    colours
        One for each geometry.
    arrangement
        How the ink is arranged.
    errors
        Where the standard errors come from, or why there are none.
    at_points
        Measured against fitted colours; None in another arrangement than that measured, or if no direction
        was measured at all wavelengths.
    """

    colours: tuple[Colour, ...]
    arrangement: Arrangement
    errors: str
    at_points: ColoursAtPoints | None = None

    def __getitem__(self, geometry: str) -> Colour:
        return {colour.name: colour for colour in self.colours}[geometry]

    def to_dict(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "light": self.colours[0].viewing.sentence,
            "arrangement": self.arrangement.words or "as measured",
            "standard_errors": self.errors,
            "colours": [colour.to_dict() for colour in self.colours],
            "ciede2000_measured_against_fitted": None if self.at_points is None else self.at_points.to_dict(),
        }

    def card(self) -> Card:
        """Light, numbers in each geometry, and differences from the measurement."""
        rows = [colour.row() for colour in self.colours]
        tables = [CardTable(HEADS, rows, (0, len(HEADS) - 1))]
        if self.at_points is not None:
            tables += self.at_points.card().tables
        title = f"Colours of the ink, {self.arrangement.words or 'as it was measured'}"
        return Card(title, [self.colours[0].viewing.sentence], tables, [f"{self.errors}."])


def arranged_covariance(
    arrangement: Arrangement, sample: Sample, known: ParameterCovariance
) -> ParameterCovariance:
    """Covariance of the parameters of a fit, by their names in an arrangement and without what it states."""
    thickness = None
    if arrangement.thickness_um is not None:
        thickness = thickness_name(sample, arrangement.layer)
    names = arranged_names(arrangement, known.names, thickness)
    keep = [i for i, name in enumerate(names) if name is not None]
    return ParameterCovariance(tuple(n for n in names if n is not None), known.matrix[np.ix_(keep, keep)])


def fitted_colours(
    sample: Sample,
    wavelength_nm: Sequence[float],
    known: ParameterCovariance | None,
    errors: str,
    geometries: Sequence[str | Geometry] = GEOMETRIES,
    illuminant: str | Illuminant = "D65",
    observer_deg: int = 2,
    arrangement: Arrangement | None = None,
    at_points: ColoursAtPoints | None = None,
) -> FittedColours:
    """Colours of a sample with fitted values.

    Parameters
    ----------
    sample
        With the fitted values.
    wavelength_nm
        Wavelengths that were fitted, ascending.
    known, errors
        Covariance of the parameters, and a sentence on it; None for no standard errors.
    geometries
        See `Geometry.of`.
    illuminant, observer_deg
        See `jaxink.colour.Viewing.of`.
    arrangement
        How the ink is arranged; None: as measured.
    at_points
        Measured against fitted colours.
    """
    arrangement = Arrangement() if arrangement is None else arrangement
    arranged = dataclasses.replace(sample, wavelengths_nm=tuple(wavelength_nm))
    spectra = SampleSpectra(arrangement.of(arranged), geometries, wavelength_nm)
    if known is not None:
        known = arranged_covariance(arrangement, sample, known)
    colours = spectra.colours(illuminant, observer_deg, known)
    return FittedColours(colours, arrangement, errors, at_points)


def colours_of_sample(
    sample: Sample,
    geometries: Sequence[str | Geometry] = GEOMETRIES,
    illuminant: str | Illuminant = "D65",
    observer_deg: int = 2,
    arrangement: Arrangement | None = None,
    known_nm: Sequence[float] = (),
) -> FittedColours:
    """Colours of a sample with the values of its table, without standard errors.

    Parameters
    ----------
    sample
        The sample.
    geometries, illuminant, observer_deg, arrangement
        As for `fitted_colours`.
    known_nm
        Wavelengths of its measurement, for a sample that lists none.
    """
    seen = geometries, illuminant, observer_deg, arrangement
    said = "No standard errors: a sample by itself has no covariance"
    return fitted_colours(sample, wavelengths_of(sample, known_nm), None, said, *seen)
