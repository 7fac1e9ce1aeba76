"""Colours of a fitted sample, with the standard errors of the fit where they hold."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from jaxink.colour import (
    Arrangement,
    ColoursAtPoints,
    FittedColours,
    Geometry,
    Illuminant,
    ParameterCovariance,
    colours_at_points,
    fitted_colours,
    wavelengths_of,
)
from jaxink.errors import InputRefusedError
from jaxink.fitting.fitted_parameters import FittedCovariance, FittedParameters
from jaxink.measurement import GonioData
from jaxink.sample import Sample


def known_of_fit(
    parameters: FittedParameters, covariance: FittedCovariance, errors_hold: bool
) -> tuple[ParameterCovariance | None, str]:
    """Covariance for what follows from a fit, and a sentence without its full stop; None if there is none."""
    lost = [p.name for p in parameters.free if p.standard_error is None and not p.flag.startswith("at ")]
    if not errors_hold:
        return None, "No standard errors: those of the fit are meaningless, as the model does not fit"
    if lost:
        return None, f"No standard errors: the fit does not determine {', '.join(lost)}"
    found = ParameterCovariance(covariance.names, covariance.matrix)
    return found, "Standard errors from the fit's covariance, in units of the last digits"


def colours_of_fit(
    sample: Sample,
    data: GonioData,
    predicted_per_sr: Float[np.ndarray, " used"],
    known: tuple[ParameterCovariance | None, str],
    geometries: Sequence[str | Geometry],
    illuminant: str | Illuminant,
    observer_deg: int,
    arrangement: Arrangement | None,
) -> FittedColours:
    """Colours of a fit; measured against fitted if the ink is arranged as it was measured.

    Parameters
    ----------
    sample, data, predicted_per_sr
        Of the fit.
    known
        Result of `known_of_fit`.
    geometries, illuminant, observer_deg, arrangement
        See `fitted_colours`.
    """
    wave = wavelengths_of(sample, np.unique(data.wavelength_nm[data.used]).tolist())
    at_points: ColoursAtPoints | None = None
    if arrangement is None or arrangement == Arrangement():
        try:
            at_points = colours_at_points(data, predicted_per_sr, illuminant, observer_deg)
        except InputRefusedError:
            # Each wavelength was measured in other directions: only the fit has colours.
            at_points = None
    return fitted_colours(sample, wave, *known, geometries, illuminant, observer_deg, arrangement, at_points)
