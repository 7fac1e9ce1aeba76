"""Points of a measurement as the rays of every distinct pair of directions."""

import equinox as eqx
import numpy as np
from jaxtyping import Int

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.model.instrument import ConeRays, Cones, cone_rays


class PredictedPoints(eqx.Module):
    """Points of a measurement; one batch predicts all pairs of directions at all wavelengths.

    Parameters
    ----------
    cones
        Cones of the instrument.
    wavelengths_nm
        Wavelengths, ascending.
    rays
        Rays of the distinct pairs of directions.
    wavelength_of_point, pair_of_point
        Position of each point's wavelength and pair of directions.
    """

    __repr__ = brief_repr

    cones: Cones = eqx.field(static=True)
    wavelengths_nm: tuple[float, ...] = eqx.field(static=True)
    rays: ConeRays
    wavelength_of_point: Int[np.ndarray, " points"]
    pair_of_point: Int[np.ndarray, " points"]


def points_of(
    cones: Cones, theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission
) -> PredictedPoints:
    """Points of a measurement.

    Parameters
    ----------
    cones
        Cones of the instrument.
    theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission
        Columns of the measurement, shape ``(points,)``.

    Raises
    ------
    InputRefusedError
        If the columns differ in length or a polar angle is not between 0 and 90 degrees.
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
    theta_i_deg, theta_o_deg, phi_deg, side = pairs.T
    rays = cone_rays(cones, theta_i_deg, theta_o_deg, phi_deg, side > 0.5)
    return PredictedPoints(cones, tuple(wavelengths.tolist()), rays, wavelength_of_point, pair_of_point)


def _columns(**given) -> list[np.ndarray]:
    """Columns of equal length; polar angles outside 0 to 90 would silently become NaN."""
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
            raise InputRefusedError(f"{name} is {points[name][outside][0]:g}; it must be between 0 and 90.")
    return list(points.values())
