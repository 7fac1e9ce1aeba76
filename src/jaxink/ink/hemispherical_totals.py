"""Hemispherical totals, regular directions and power balance of a table."""

import math

import numpy as np
from jaxtyping import Float

from jaxink.ink.table import COMPONENTS, InkTable

# Tolerance for the error of the table's quadrature.
_MOST_POWER = 1.01


def projected_weights(theta_deg: Float[np.ndarray, " angles"]) -> Float[np.ndarray, " angles"]:
    """Weights of the integral over sin(theta) cos(theta) dtheta, exact for piecewise linear functions."""
    theta = np.deg2rad(theta_deg)
    # Antiderivatives of sin cos and of theta sin cos.
    plain = -np.cos(2 * theta) / 4
    moment = -theta * np.cos(2 * theta) / 4 + np.sin(2 * theta) / 8
    step, area, first = np.diff(theta), np.diff(plain), np.diff(moment)
    rising = (first - theta[:-1] * area) / step
    weights = np.zeros_like(theta)
    weights[1:] += rising
    weights[:-1] += area - rising
    return weights


def azimuth_weights(phi_deg: Float[np.ndarray, " azimuths"]) -> Float[np.ndarray, " azimuths"]:
    """Weights of the integral over the full circle of a function that is symmetric about 180 degrees."""
    steps = np.diff(np.deg2rad(phi_deg))
    weights = np.zeros(len(phi_deg))
    weights[1:] += steps
    weights[:-1] += steps
    return weights


def diffuse_totals(table: InkTable) -> Float[np.ndarray, "4 wavelengths angles"]:
    """Share of the incident power that leaves diffusely: the integral of f cos(theta_o).

    Exact for the table as read by `InkTable.interpolated`.
    """
    totals = table.rest_per_sr @ azimuth_weights(table.phi_deg) @ projected_weights(table.theta_deg)
    if table.lobes is not None:
        for c, w in np.ndindex(totals.shape[:2]):
            totals[c, w] += table.lobes.totals(COMPONENTS[c], w)
    return totals


def power_sent_out(table: InkTable) -> Float[np.ndarray, "2 wavelengths angles"]:
    """Share of the power that a table sends out, scattered and regular, of light from side I and from side A.

    It is 1 for an exact table of a boundary that does not absorb.
    """
    each = dict(zip(COMPONENTS, diffuse_totals(table) + table.regular, strict=True))
    return np.stack([each["R_II"] + each["T_IA"], each["T_AI"] + each["R_AA"]])


def excess_of_power(table: InkTable) -> str | None:
    """The largest power sent out, in words, if it is too large for a ray tracer; otherwise None."""
    power = power_sent_out(table)
    side, w, i = np.unravel_index(np.argmax(power), power.shape)
    if power[side, w, i] <= _MOST_POWER:
        return None
    return (
        f"{power[side, w, i]:.4g} times the power that arrives from side {'IA'[side]} at "
        f"{table.theta_deg[i]:.4g} degrees, {table.wavelength_nm[w]:g} nm"
    )


def exit_angles_deg(
    table: InkTable, component: str, wavelength: int, theta_i_deg
) -> Float[np.ndarray, " angles"]:
    """Angle of the specular or refracted direction on the exit side; nan beyond the critical angle."""
    theta = np.asarray(theta_i_deg, float)
    if component[0] == "R":
        return theta
    into, out = (index[wavelength] for index in table.index_of_sides(component))
    sine = into / out * np.sin(np.deg2rad(theta))
    # At the critical angle, rounding may give more than 1.
    sine = np.where(np.abs(sine - 1) < 1e-9, 1.0, sine)
    with np.errstate(invalid="ignore"):
        return np.rad2deg(np.arcsin(sine))


def critical_angle_deg(table: InkTable, component: str, wavelength: int) -> float:
    """Critical angle of incidence, or 90 if there is none."""
    into, out = (float(index[wavelength]) for index in table.index_of_sides(component))
    return math.degrees(math.asin(out / into)) if component[0] == "T" and out < into else 90.0
