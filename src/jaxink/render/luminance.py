"""Luminance and chromaticity of a spectrum rendered under D65, over the luminance of the lamp."""

import numpy as np
from jaxtyping import Float

from jaxink.colour import Viewing


def luminance_weights(wavelength_nm: Float[np.ndarray, " wavelengths"]) -> Float[np.ndarray, " wavelengths"]:
    """From a spectrum to luminance; a single wavelength is its own."""
    return np.ones(1) if len(wavelength_nm) == 1 else Viewing.of(wavelength_nm).weights[1] / 100


def tristimulus_weights(
    wavelength_nm: Float[np.ndarray, " wavelengths"],
) -> Float[np.ndarray, "wavelengths 3"] | None:
    """From a spectrum to X, Y, Z; None for a single wavelength, which has no colour.

    Raises
    ------
    InputRefusedError
        If the wavelengths are no band that has a colour.
    """
    return None if len(wavelength_nm) == 1 else Viewing.of(wavelength_nm).weights.T


def chromaticity(xyz: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 2"]:
    """CIE x, y of tristimulus values."""
    return xyz[..., :2] / xyz.sum(axis=-1, keepdims=True)
