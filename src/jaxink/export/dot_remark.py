"""The size from which on a sheet is enough for a printed dot, in words, where the rule for it was tested."""

import itertools
import math
from collections.abc import Sequence

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.export.dot_size import WideLayer, sheet_error
from jaxink.export.medium import Medium, medium_of
from jaxink.ink import SURROUNDINGS, InkLayers, apart_from_the_ink

# What the rule was tested for: extinction times thickness, albedo, g, indices of ink and plate.
_THICKNESSES, _LEAST_ALBEDO, _ASYMMETRIES, _INDICES = (1.5, 40.0), 0.92, (0.5, 0.85), (1.45, 1.6)
# Share of the light that is scattered into air, and diameter over thickness, below which no number is stated.
_LEAST_SENT_OUT, _LEAST_RATIO = 0.03, 10.0
_AIR = 1e-3


def remark_on_dots(ink: InkLayers, wavelengths_nm: Sequence[float]) -> str | None:
    """The size at which the sheet of an ink errs by 1 % as a printed dot, in words.

    Parameters
    ----------
    ink
        From `jaxink.ink.find_ink`.
    wavelengths_nm
        Wavelengths; the largest size of all is stated.

    Returns
    -------
    str or None
        None where the rule was not tested: the ink is not one scattering layer with smooth faces between a
        plate and air, declares effects of its own, or has other numbers than the inks that were tried.
    """
    try:
        medium = medium_of(ink, wavelengths_nm)
    except InputRefusedError:
        return None
    if not (_is_open_and_smooth(ink, medium) and _is_like_the_tested(medium)):
        return None
    layers = [WideLayer.of(medium, w) for w in range(len(medium.wavelength_nm))]
    errors = [sheet_error(layer) for layer in layers]
    returned = 100 * max(error.returned for error in errors)
    into_plate = f"in the light that returns into the plate when its diameter is {_size(returned, medium)}"
    into_air = "; light that it sends into air is too little to judge"
    if min(layer.scattered[1] for layer in layers) >= _LEAST_SENT_OUT:
        sent_out = 100 * max(-error.sent_out for error in errors)
        into_air = f", and in the light that it sends into air when that is {_size(sent_out, medium)}"
    return (
        f"as a sheet, a round dot errs by 1 % {into_plate}{into_air}. The error is inverse to the diameter; "
        "the rim faces air, and light arrives from all directions in the plate."
    )


def _size(ratio: float, medium: Medium) -> str:
    """A diameter by its ratio to the thickness, in words."""
    about = "about" if ratio >= _LEAST_RATIO else "less than"
    ratio = max(ratio, _LEAST_RATIO)
    digits = 1 - math.floor(math.log10(ratio))
    diameter_mm = float(f"{ratio * medium.thickness_um / 1000:.2g}")
    return f"{about} {round(ratio, digits):g} times the ink's thickness ({diameter_mm:g} mm)"


def _is_open_and_smooth(ink: InkLayers, medium: Medium) -> bool:
    """Whether the ink alone, with smooth faces, lies between a plate and the air around the sample."""
    sample = ink.sample
    near = sample.layers[max(ink.first - 1, 0) : ink.last + 2]
    return (
        not any(layer.roughness for layer in near)
        and {effect.name for effect in sample.effects} <= set(itertools.chain(*apart_from_the_ink(sample)))
        and ink.media[1] == SURROUNDINGS
        and bool(np.all(np.abs(medium.indices[1] - 1) < _AIR))
    )


def _is_like_the_tested(medium: Medium) -> bool:
    """Whether all numbers of a medium are among those that the rule was tested for."""
    thickness = medium.extinction_per_mm * medium.thickness_um / 1000
    albedo = medium.scattering_per_mm / np.maximum(medium.extinction_per_mm, 1e-300)
    ranges = (
        (thickness, _THICKNESSES),
        (albedo, (_LEAST_ALBEDO, math.inf)),
        (medium.asymmetry, _ASYMMETRIES),
        (medium.refractive_index, _INDICES),
        (medium.indices[0], _INDICES),
    )
    return all(np.all((values >= low) & (values <= high)) for values, (low, high) in ranges)
