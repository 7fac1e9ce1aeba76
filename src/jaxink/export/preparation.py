"""Validation of a table for ray tracers, and its regular part as cones."""

import dataclasses
import math

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.export.limitations import WIDEST_BIN_DEG
from jaxink.ink import (
    COMPONENTS,
    InkTable,
    azimuth_weights,
    excess_of_power,
    exit_angles_deg,
    projected_weights,
)

# Negative values smaller than this share of the largest are rounding errors, written as zero.
_ROUNDING = 1e-6
# The coarsest default axes of a table.
_FEWEST_THETA, _FEWEST_PHI = 61, 37


def writable(table: InkTable) -> InkTable:
    """The table without negative rounding errors.

    Raises
    ------
    InputRefusedError
        If a value is not finite or is negative, or if more light leaves than arrives.
    """
    for name in ("bsdf_per_sr", "regular", "index_inside", "index_outside"):
        values = getattr(table, name)
        if not np.all(np.isfinite(values)):
            raise InputRefusedError(
                f"{name} of the ink table contains values that are not finite; compute it again."
            )
        least = values.min()
        if least < -_ROUNDING * max(values.max(), 0.0):
            raise InputRefusedError(
                f"{name} of the ink table is as low as {least:.3g}; it must not be negative, so compute the "
                "table with a higher accuracy."
            )
    excess = excess_of_power(table)
    if excess is not None:
        raise InputRefusedError(
            f"the ink table sends out {excess}; it must not exceed 1, so compute the table with more angles."
        )
    return dataclasses.replace(
        table, bsdf_per_sr=np.maximum(table.bsdf_per_sr, 0.0), regular=np.maximum(table.regular, 0.0)
    )


def regular_in_bins(table: InkTable, width_deg: float) -> InkTable:
    """The table with its regular part spread over cones around the specular or refracted direction.

    Their full width at half maximum is ``width_deg`` in the exit medium; hemispherical totals are kept.

    Raises
    ------
    InputRefusedError
        If the table's angles are too coarse for the cone.
    """
    step = max(np.diff(table.theta_deg).max(), np.diff(table.phi_deg).max())
    if width_deg < step:
        raise InputRefusedError(
            f"regular_bin_deg (--regular-bin-deg) is {width_deg:g}, but the angular steps of the ink "
            f"table are up to {step:.3g} degrees; choose a width of at least that, or a finer table."
        )
    theta, phi = np.deg2rad(table.theta_deg)[:, None], np.deg2rad(table.phi_deg)
    weights = projected_weights(table.theta_deg)[:, None] * azimuth_weights(table.phi_deg)
    bsdf = table.bsdf_per_sr.copy()
    for c, component in enumerate(COMPONENTS):
        for w in range(len(table.wavelength_nm)):
            leaving = np.deg2rad(exit_angles_deg(table, component, w, table.theta_deg))
            for i in np.flatnonzero(table.regular[c, w]):
                if np.isnan(leaving[i]):
                    continue
                cosine = np.cos(theta) * np.cos(leaving[i]) - np.sin(theta) * np.sin(leaving[i]) * np.cos(phi)
                angle = np.rad2deg(np.arccos(np.clip(cosine, -1, 1)))
                cone = np.maximum(1 - angle / width_deg, 0.0)
                bsdf[c, w, i] += table.regular[c, w, i] / np.sum(weights * cone) * cone
    return dataclasses.replace(
        table,
        bsdf_per_sr=bsdf,
        regular=np.zeros_like(table.regular),
        bsdf_standard_error_per_sr=None,
        regular_standard_error=None,
        attrs=table.attrs | {"regular": f"in cones of {width_deg:g} degrees full width at half maximum"},
    )


def least_bin_deg(table: InkTable | None, n_theta: int | None = None, n_phi: int | None = None) -> int | None:
    """Smallest whole width that `regular_in_bins` takes, None if there is none.

    Parameters
    ----------
    table
        The table; None if it is still to be computed.
    n_theta, n_phi
        Numbers of its angles then; None for the defaults.
    """
    if table is not None:
        step = max(np.diff(table.theta_deg).max(), np.diff(table.phi_deg).max())
    else:
        # Of steps that shrink towards both ends of a segment, the largest is pi / 2 times the mean.
        polar = np.pi / 2 * 90 / max((n_theta or _FEWEST_THETA) - 1, 1)
        step = max(polar, 180 / max((n_phi or _FEWEST_PHI) - 1, 1))
    width = math.ceil(step - 1e-9)
    return width if width <= WIDEST_BIN_DEG else None
