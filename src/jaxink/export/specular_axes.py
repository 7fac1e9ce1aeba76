"""Tables of scattered light about the specular or refracted direction, as fine as an ink's table needs."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from jaxink.errors import InputRefusedError
from jaxink.export.limitations import ExportOptions
from jaxink.ink import COMPONENTS, InkTable, azimuth_weights, diffuse_totals, projected_weights

_RADIAL_DEG = np.concatenate([np.arange(0, 2, 0.25), np.arange(2, 10), np.arange(10, 180.1, 2.5)])
_AZIMUTH_DEG = np.linspace(0, 180, 37)
# Divisions of the steps of axes that are not given, tried one after the other.
_REFINEMENTS = (1, 2, 4)
# Cones of regular light reach one width from their direction, and a step of the table further.
_CONE_WIDTHS = 3
# Largest difference between the hemispherical totals of table and file, over the incident power.
_TOTAL_TOLERANCE = 0.02
# Beyond this incidence, light along the horizon falls between the file's angles: only the total is right.
_GRAZING_DEG = 85.0


class Scattered(NamedTuple):
    """BSDF of each incidence by azimuth and angle about the specular or refracted direction, and totals."""

    azimuth_deg: Float[np.ndarray, " azimuths"]
    radial_deg: Float[np.ndarray, " radial"]
    values_per_sr: Float[np.ndarray, "incidences azimuths radial"]
    totals: Float[np.ndarray, " incidences"]


def scattered(
    title: str,
    table: InkTable,
    component: str,
    w: int,
    incidence_deg: Float[np.ndarray, " incidences"],
    leaving_deg: Float[np.ndarray, " incidences"],
    options: ExportOptions,
) -> Scattered:
    """A component on the coarsest axes that reproduce the table's totals.

    Parameters
    ----------
    title
        Program, for the message.
    table, component, w
        The table, and its component and wavelength.
    incidence_deg, leaving_deg
        Angles of incidence, and of the direction that radial and azimuthal angles refer to.
    options
        Axes that are given; others are refined up to four times. Azimuths are 0 to 180 degrees.

    Raises
    ------
    InputRefusedError
        If the axes are too coarse for the table.
    """
    radial, azimuth = _radial_deg(options), _azimuth_deg(options)
    for refinement in _REFINEMENTS:
        axes = (
            radial if options.radial_deg is not None else _divided(radial, refinement),
            azimuth if options.azimuth_deg is not None else _divided(azimuth, refinement),
        )
        try:
            return _on_axes(title, table, component, w, incidence_deg, leaving_deg, *axes)
        except _CoarseAxesError as problem:
            sentence = str(problem)
            if options.radial_deg is not None and options.azimuth_deg is not None:
                break
    raise InputRefusedError(sentence)


class _CoarseAxesError(Exception):
    """The axes do not reproduce the table's totals."""


def _azimuth_deg(options: ExportOptions) -> Float[np.ndarray, " azimuths"]:
    return np.asarray(_AZIMUTH_DEG if options.azimuth_deg is None else options.azimuth_deg, float)


def _radial_deg(options: ExportOptions) -> Float[np.ndarray, " radial"]:
    """The given axis, or the default one with further angles in cones, twenty in their width."""
    width = options.regular_bin_deg
    if options.radial_deg is not None or width is None:
        return np.asarray(_RADIAL_DEG if options.radial_deg is None else options.radial_deg, float)
    return np.unique(np.append(_RADIAL_DEG, np.arange(0, 20 * _CONE_WIDTHS + 1) * width / 20))


def _on_axes(
    title, table: InkTable, component: str, w: int, incidence, leaving, radial, azimuth
) -> Scattered:
    theta, phi = _outgoing_deg(leaving, radial, azimuth)
    # Nothing is scattered below the horizon.
    above = theta <= 90
    angles = np.broadcast_to(incidence[:, None, None], theta.shape)
    values = np.zeros(theta.shape)
    values[above] = table.interpolated(component, angles[above], theta[above], phi[above], w)
    totals = _totals(table, component, w, incidence)
    arriving = incidence <= _GRAZING_DEG
    sampled = (azimuth, radial, values[arriving])
    _require_resolved(title, table, component, w, leaving[arriving], totals[arriving], sampled)
    return Scattered(azimuth, radial, values, totals)


def _outgoing_deg(leaving_deg, radial_deg, azimuth_deg):
    """Polar angle and azimuth about the normal from scatter angles about the specular direction.

    Shapes ``(incidence, azimuth, radial)``; polar angles above 90 are below the horizon. Scatter azimuth 0
    points from the specular direction to the normal.
    """
    t = np.deg2rad(leaving_deg)[:, None, None]
    a, r = np.deg2rad(azimuth_deg)[:, None], np.deg2rad(radial_deg)
    x = np.sin(r) * np.cos(a) * np.cos(t) - np.cos(r) * np.sin(t)
    y = np.sin(r) * np.sin(a) + 0 * t
    z = np.sin(r) * np.cos(a) * np.sin(t) + np.cos(r) * np.cos(t)
    # Rounding must not put the horizon below itself.
    z = np.where(np.abs(z) < 1e-12, 0.0, np.clip(z, -1, 1))
    return np.rad2deg(np.arccos(z)), np.rad2deg(np.arctan2(y, x))


def _scatter_deg(leaving_deg, theta_deg, phi_deg):
    """Inverse of `_outgoing_deg`: radial angle, and azimuth mirrored to 0 to 180."""
    t, theta, phi = (np.deg2rad(angle) for angle in (leaving_deg, theta_deg, phi_deg))
    x, y, z = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    along = x * np.cos(t) + z * np.sin(t)
    up = z * np.cos(t) - x * np.sin(t)
    return np.rad2deg(np.arccos(np.clip(up, -1, 1))), np.rad2deg(np.arctan2(np.abs(y), along))


def _totals(table: InkTable, component: str, w: int, incidence) -> Float[np.ndarray, " incidences"]:
    """Total integrated scatter, exact for the table as interpolated."""
    return np.interp(incidence, table.theta_deg, diffuse_totals(table)[COMPONENTS.index(component), w])


def _require_resolved(title: str, table: InkTable, component: str, w: int, leaving, totals, file) -> None:
    """Raise `_CoarseAxesError` if the axes do not reproduce the table's totals."""
    from scipy.interpolate import RegularGridInterpolator

    azimuth, radial, values = file
    # The file's values vary between the entries of the table.
    axes = _divided(table.theta_deg, 3), _divided(table.phi_deg, 3)
    theta, phi = np.meshgrid(*axes, indexing="ij")
    weights = np.outer(projected_weights(axes[0]), azimuth_weights(axes[1]))
    for angle, total, rows in zip(leaving, totals, values, strict=True):
        r, a = _scatter_deg(angle, theta, phi)
        back = np.sum(weights * RegularGridInterpolator((azimuth, radial), rows)((a, r)))
        if abs(back - total) > _TOTAL_TOLERANCE:
            raise _CoarseAxesError(
                f"{title}: with {len(azimuth)} azimuths and {len(radial)} radial angles, {component} at "
                f"{table.wavelength_nm[w]:g} nm would scatter {back:.4g} instead of {total:.4g} of the "
                f"incident power around {angle:.4g} degrees; choose finer axes "
                "(radial_deg, azimuth_deg), or more angles of the table (n_theta, n_phi; --n-theta, --n-phi)."
            )


def _divided(axis: np.ndarray, parts: int) -> np.ndarray:
    """The axis with every step divided into equal parts."""
    return np.interp(np.arange(parts * (len(axis) - 1) + 1) / parts, np.arange(len(axis)), axis)
