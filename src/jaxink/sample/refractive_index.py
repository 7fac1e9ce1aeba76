"""Dispersion: refractive index against wavelength in vacuum, by formula or by table.

The formulae accept numbers, arrays and traced values alike, and are differentiable.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from jaxink.errors import InputRefusedError


def cauchy_index(wavelength_nm, a, b_um2=0.0, c_um4=0.0):
    """Cauchy's formula, n = a + b / wavelength^2 + c / wavelength^4.

    Parameters
    ----------
    wavelength_nm
        Wavelength in vacuum.
    a, b_um2, c_um4
        Coefficients, for wavelengths in micrometres.
    """
    inverse_square = (1000 / wavelength_nm) ** 2
    return a + inverse_square * (b_um2 + c_um4 * inverse_square)


def sellmeier_index(wavelength_nm, strengths: Iterable, resonances_um2: Iterable):
    """Sellmeier's formula, n^2 = 1 + sum of B wavelength^2 / (wavelength^2 - C).

    Parameters
    ----------
    wavelength_nm
        Wavelength in vacuum, away from every resonance.
    strengths, resonances_um2
        B and C of each resonance, for wavelengths in micrometres.
    """
    square = (wavelength_nm / 1000) ** 2
    terms = (b * square / (square - c) for b, c in zip(strengths, resonances_um2, strict=True))
    return (1 + sum(terms)) ** 0.5


def tabulated_index(wavelength_nm: float, table_wavelength_nm: Sequence, table_index: Sequence) -> float:
    """Refractive index from a table, linear in 1 / wavelength^2 like Cauchy's formula with two terms.

    Parameters
    ----------
    wavelength_nm
        Wavelength in vacuum, a known number.
    table_wavelength_nm, table_index
        The table, by ascending wavelength.

    Raises
    ------
    InputRefusedError
        If the wavelength is outside the table.
    """
    lowest, highest = min(table_wavelength_nm), max(table_wavelength_nm)
    if not lowest <= wavelength_nm <= highest:
        raise InputRefusedError(
            f"an index table extends from {lowest:g} to {highest:g} nm, but {wavelength_nm:g} nm is needed; "
            "give a table that covers every wavelength."
        )
    # Interpolation needs ascending abscissae, hence descending wavelengths.
    inverse = [1 / w**2 for w in reversed(table_wavelength_nm)]
    return float(np.interp(1 / wavelength_nm**2, inverse, list(reversed(table_index))))
