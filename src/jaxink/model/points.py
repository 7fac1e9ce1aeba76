"""Points of a measurement: every pair of directions once, at every wavelength."""

import equinox as eqx
import numpy as np
from jaxtyping import Int

from jaxink.errors import InputRefusedError
from jaxink.model.instrument import ConeRays, Cones, cone_rays


class Points(eqx.Module):
    """Every wavelength is predicted at the same pairs of directions, so that one batch serves the spectrum.

    Parameters
    ----------
    cones
        Of the instrument.
    wavelengths_nm
        Wavelengths, ascending.
    rays
        Of the pairs.
    wavelength_of_point, pair_of_point
        Position of each point's wavelength and pair.
    """

    cones: Cones = eqx.field(static=True)
    wavelengths_nm: tuple[float, ...] = eqx.field(static=True)
    rays: ConeRays
    wavelength_of_point: Int[np.ndarray, " points"]
    pair_of_point: Int[np.ndarray, " points"]


def points_of(cones: Cones, theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission) -> Points:
    """Points of a measurement.

    Parameters
    ----------
    cones
        Of the instrument.
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission
        Shape ``(points,)``.

    Raises
    ------
    InputRefusedError
        If the columns differ in length, or a polar angle is not 0 ... 90.
    """
    *columns, wavelength_nm = _columns(
        theta_i_deg=theta_i_deg,
        theta_o_deg=theta_o_deg,
        phi_deg=phi_deg,
        is_transmission=is_transmission,
        wavelength_nm=wavelength_nm,
    )
    pairs, pair_of_point = np.unique(np.column_stack(columns), axis=0, return_inverse=True)
    wavelengths, wavelength_of_point = np.unique(wavelength_nm, return_inverse=True)
    rays = cone_rays(cones, *pairs[:, :3].T, pairs[:, 3] > 0.5)
    return Points(cones, tuple(wavelengths.tolist()), rays, wavelength_of_point, pair_of_point)


def _columns(**given) -> list[np.ndarray]:
    """Columns of one length, with polar angles of one hemisphere: others would become NaN in silence."""
    points = {name: np.asarray(column, float) for name, column in given.items()}
    length = points["theta_i_deg"].shape
    for name, column in points.items():
        if column.ndim != 1 or column.shape != length:
            raise InputRefusedError(
                f"{name} has shape {column.shape}; all columns must have the shape (points,), here {length}."
            )
    for name in ("theta_i_deg", "theta_o_deg"):
        outside = ~((points[name] >= 0) & (points[name] <= 90))
        if outside.any():
            raise InputRefusedError(f"{name} is {points[name][outside][0]:g}; it must lie in 0 ... 90.")
    return list(points.values())
