"""Ink tables given by formulas, and directions about the ink in one system for all formats.

z points from the inside of the plate (I) to the other side (A). Directions point away from the ink: towards
the source, or along the outgoing light.
"""

import numpy as np

from jaxink.ink import COMPONENTS, InkTable

INDEX_INSIDE = 1.5
CRITICAL_DEG = np.degrees(np.arcsin(1 / INDEX_INSIDE))
LOBE_THETA_DEG, LOBE_PHI_DEG, LOBE_WIDTH_DEG = 50.0, 37.0, 10.0


def vector(side, theta_deg, phi_deg):
    """Unit vector on a side of the ink, polar angle from that side's normal."""
    theta, phi = np.deg2rad(theta_deg), np.deg2rad(phi_deg)
    up = np.cos(theta) * (1 if side == "A" else -1)
    return np.stack(
        np.broadcast_arrays(np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), up), axis=-1
    )


def table_of(function, theta_deg, phi_deg, wavelength_nm=(550.0,), index_inside=INDEX_INSIDE, **fields):
    """Table of ``function(component, wavelength_nm, theta_i, theta_o, phi)``, angles in degrees."""
    theta, phi = np.asarray(theta_deg, float), np.asarray(phi_deg, float)
    grid = np.meshgrid(theta, theta, phi, indexing="ij")
    bsdf = [[function(c, w, *grid) + np.zeros(grid[0].shape) for w in wavelength_nm] for c in COMPONENTS]
    fields = {"regular": np.zeros((4, len(wavelength_nm), len(theta))), **fields}
    ones = np.ones(len(wavelength_nm))
    return InkTable(
        wavelength_nm=np.array(wavelength_nm, float),
        theta_deg=theta,
        phi_deg=phi,
        bsdf_per_sr=np.array(bsdf),
        index_inside=index_inside * ones,
        index_outside=ones,
        attrs={"title": "analytic, for tests"},
        **fields,
    )


# Hemispherical totals; the two transmissions differ by the square of the index.
LAMBERTIAN = {"R_II": 0.5, "T_IA": 0.1, "T_AI": 0.1 * INDEX_INSIDE**2, "R_AA": 0.3}


def lambertian(**fields):
    """Constants, on a grid as uneven as real ones."""
    theta = np.array([0.0, 7, 20, 33, CRITICAL_DEG, 48, 60, 75, 84, 90])
    return table_of(lambda c, w, i, o, p: LAMBERTIAN[c] / np.pi, theta, np.linspace(0, 180, 13), **fields)


def lobe(component, wavelength_nm, theta_i, theta_o, phi):
    """Gaussian about one direction off the plane of incidence, and its mirror image."""
    t, o = np.deg2rad(LOBE_THETA_DEG), np.deg2rad(theta_o)
    cosine = np.cos(t) * np.cos(o) + np.sin(t) * np.sin(o) * np.cos(np.deg2rad(phi - LOBE_PHI_DEG))
    return np.exp(-0.5 * (np.degrees(np.arccos(np.clip(cosine, -1, 1))) / LOBE_WIDTH_DEG) ** 2)


def tilted_lobe():
    """The lobe on a grid that resolves it."""
    return table_of(lobe, np.linspace(0, 90, 31), np.linspace(0, 180, 61))


def smooth(component, wavelength_nm, theta_i, theta_o, phi):
    """Reciprocal, forward and different on each side; longer wavelengths scatter less."""
    i, o = np.deg2rad(theta_i), np.deg2rad(theta_o)
    shape = 1 + 0.5 * np.cos(i) * np.cos(o) - 0.4 * np.sin(i) * np.sin(o) * np.cos(np.deg2rad(phi))
    if component in ("T_IA", "T_AI"):
        # Symmetric in the two polar angles of one ray, whichever end it comes from.
        inside, outside = (i, o) if component == "T_IA" else (o, i)
        shape = 1 + 0.5 * np.cos(inside) + 0.3 * np.cos(outside) ** 2
        shape = shape - 0.4 * np.sin(inside) * np.sin(outside) * np.cos(np.deg2rad(phi))
    return LAMBERTIAN[component] / 2 / np.pi * shape * (550 / wavelength_nm)


def smooth_table(wavelength_nm=(550.0,), **fields):
    """Reciprocal table with the critical angle on its grid."""
    theta = np.unique(np.append(np.linspace(0, 90, 31), CRITICAL_DEG))
    return table_of(smooth, theta, np.linspace(0, 180, 37), wavelength_nm, **fields)
