"""Points of a measurement, every distinct pair of directions; whether a sample can be predicted there."""

from collections.abc import Iterable, Mapping

import equinox as eqx
import numpy as np
from jaxtyping import Int

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError
from jaxink.model.instrument import ConeRays, Cones, cone_rays
from jaxink.model.volume import check_phase_table
from jaxink.numerics.validity import require
from jaxink.sample import Sample

_NOT_NEGATIVE = ("scattering_per_mm", "absorption_per_mm", "thickness_mm", "thickness_um")


class Points(eqx.Module):
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


def points_of(cones: Cones, theta_i_deg, theta_o_deg, phi_deg, wavelength_nm, is_transmission) -> Points:
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
    return Points(cones, tuple(wavelengths.tolist()), rays, wavelength_of_point, pair_of_point)


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


def require_not_negative(sample: Sample, values: Mapping) -> None:
    """Reject a negative coefficient or thickness; one that is traced or tied passes.

    Parameters
    ----------
    sample
        The sample.
    values
        Values by name, in place of those of the sample's table.
    """
    for name, parameter in sample.parameters.items():
        if parameter.tie is None and name.split("@")[0].rpartition(".")[2] in _NOT_NEGATIVE:
            require(name, values.get(name, parameter.value), lambda v: v >= 0, "be at least 0")


def require_predictable(sample: Sample, points: Points) -> None:
    """Reject a sample that does not determine the BSDF at every point.

    Raises
    ------
    InputRefusedError
        With what is wrong and what would be right.
    """
    if sample.effects:
        names = ", ".join(effect.name for effect in sample.effects)
        raise InputRefusedError(
            f"the sample declares effects ({names}), which a ForwardModel does not know; use "
            "jaxink.forward_model(sample, data) instead."
        )
    require_determined(sample, points.wavelengths_nm, bool(points.rays.directions.is_transmission.any()))


def require_determined(sample: Sample, wavelengths_nm: tuple[float, ...], is_transmitted: bool) -> None:
    """Reject a sample that does not determine its stacks.

    Parameters
    ----------
    sample
        The sample.
    wavelengths_nm
        Wavelengths of the measurement.
    is_transmitted
        Whether some of it is transmission.
    """
    _check_wavelengths(sample, wavelengths_nm)
    backing = sample.backing
    if backing is not None and backing.side == "both" and is_transmitted:
        raise InputRefusedError(
            'the measurement has rows of side T, but an opaque backing with side = "both" transmits nothing; '
            'write side = "R" if it was removed for them.'
        )
    for layer in sample.layers:
        check_phase_table(layer)
    require_not_negative(sample, {})


def wavelengths_without_values(sample: Sample, wavelengths_nm: Iterable[float]) -> list[float]:
    """Those of some wavelengths at which parameters that are given by wavelength have no value."""
    named = _named_wavelengths(sample)
    return [wavelength for wavelength in wavelengths_nm if named and f"{wavelength:g}" not in named]


def _named_wavelengths(sample: Sample) -> set[str]:
    return {n.split("@")[1] for n in sample.parameters if "@" in n}


def _check_wavelengths(sample: Sample, wavelengths_nm: tuple[float, ...]) -> None:
    for wavelength in wavelengths_without_values(sample, wavelengths_nm):
        named = sorted(_named_wavelengths(sample), key=float)
        raise InputRefusedError(
            f"the measurement has rows at {wavelength:g} nm, but the sample gives its per-wavelength "
            f"parameters at {', '.join(named)} nm only; list {wavelength:g} in wavelength_nm of the sample "
            "file, and fit again if a fit gave them."
        )
    for dispersion in sample.dispersions:
        dispersion.check(sample.parameters, wavelengths_nm)
