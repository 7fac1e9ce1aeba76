"""Limits the power that a table sends out to the incident power."""

import dataclasses

import numpy as np

from jaxink.ink.hemispherical_totals import exit_angles_deg, power_sent_out
from jaxink.ink.table import COMPONENTS, InkTable


def within_incident_power(table: InkTable) -> InkTable:
    """Scale down a table for incidences at which it sends out more power than arrives, keeping reciprocity.

    Every direction of either side has one factor, which multiplies the BSDF of light that arrives from it and
    that leaves along it. The attribute ``least_power_factor`` of the result is the square of the smallest.
    """
    factor = np.ones((2, len(table.wavelength_nm), len(table.theta_deg)))
    limited = table
    # Each step at least halves the logarithm of the excess.
    for _ in range(40):
        excess = np.maximum(power_sent_out(limited), 1.0)
        if excess.max() < 1 + 1e-9:
            break
        factor /= np.sqrt(excess)
        limited = _scaled(table, factor)
    attrs = {**table.attrs, "least_power_factor": float(factor.min() ** 2)}
    return dataclasses.replace(limited, attrs=attrs)


def _scaled(table: InkTable, factor: np.ndarray) -> InkTable:
    """Table multiplied by the factors of the incident and of the exit direction."""
    bsdf, regular = table.bsdf_per_sr.copy(), table.regular.copy()
    for c, name in enumerate(COMPONENTS):
        come, leave = (factor["IA".index(side)] for side in name[2:])
        bsdf[c] *= come[:, :, None, None] * leave[:, None, :, None]
        for w in range(len(table.wavelength_nm)):
            exits = np.nan_to_num(exit_angles_deg(table, name, w, table.theta_deg), nan=90.0)
            regular[c, w] *= come[w] * np.interp(exits, table.theta_deg, leave[w])
    return dataclasses.replace(table, bsdf_per_sr=bsdf, regular=regular)
