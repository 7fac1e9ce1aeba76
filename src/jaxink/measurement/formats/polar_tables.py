"""Tables over a polar angle and an azimuth: their directions, each once, and their total."""

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.measurement.formats.points import FilePoints

# Angles of files are printed with fewer digits.
_SAME_DEG = 1e-6
# Tables with angles that resolve their lobes have no such step between one value and the next smaller one.
_LONE_STEP = 100
# Of the steps of a table, for its total.
_PARTS = 8


def distinct(
    polar_deg: Float[np.ndarray, " polar"],
    azimuth_deg: Float[np.ndarray, " azimuth"],
    values: Float[np.ndarray, "polar azimuth"],
) -> tuple[Float[np.ndarray, "polar azimuth"], Bool[np.ndarray, "polar azimuth"]]:
    """Values, and which of them to keep so that each direction occurs once.

    All azimuths at the pole are one direction, of which the mean is kept at the first azimuth; an azimuth of
    360 degrees is that of 0.
    """
    keep = np.ones(values.shape, bool)
    turns = np.round(azimuth_deg, 6) % 360
    _, first = np.unique(turns, return_index=True)
    keep[:, ~np.isin(np.arange(turns.size), first)] = False
    pole = np.abs(np.sin(np.deg2rad(polar_deg))) < np.deg2rad(_SAME_DEG)
    keep[pole, 1:] = False
    values = values.copy()
    values[pole, 0] = values[pole][:, np.sort(first)].mean(axis=1)
    return values, keep


def from_specular(
    specular_deg: float, radial_deg: Float[np.ndarray, "..."], azimuth_deg: Float[np.ndarray, "..."]
) -> tuple[Float[np.ndarray, "..."], Float[np.ndarray, "..."]]:
    """Polar angle and azimuth about the normal, of scatter angles about the specular direction.

    Scatter azimuth 0 points from the specular direction to the normal. The azimuth returned is 0 towards the
    source and 180 towards the specular direction; polar angles above 90 degrees are below the horizon.
    """
    r, a, t = np.deg2rad(radial_deg), np.deg2rad(azimuth_deg), np.deg2rad(specular_deg)
    specular = np.array([-np.sin(t), 0.0, np.cos(t)])
    uphill = np.array([np.cos(t), 0.0, np.sin(t)])
    along, up, across = np.cos(r), np.sin(r) * np.cos(a), np.sin(r) * np.sin(a)
    x, z = (along * specular[k] + up * uphill[k] for k in (0, 2))
    # Rounding must not put the horizon below itself, nor give the normal an azimuth.
    x, across, z = (np.where(np.abs(part) < 1e-12, 0.0, part) for part in (x, across, z))
    return np.rad2deg(np.arccos(np.clip(z, -1, 1))), np.rad2deg(np.arctan2(across, x))


def points_about_specular(
    specular_deg: float,
    theta_i_deg: float,
    polar_deg: Float[np.ndarray, " polar"],
    azimuth_deg: Float[np.ndarray, " azimuth"],
    values: Float[np.ndarray, "polar azimuth"],
    rows: Int[np.ndarray, "polar azimuth"],
    wavelength_nm: float,
    is_transmission: bool,
) -> FilePoints:
    """One incidence of a file whose scatter angles are about the specular or refracted direction."""
    values, keep = distinct(polar_deg, azimuth_deg, values)
    theta_o_deg, phi_deg = from_specular(specular_deg, polar_deg[:, None], azimuth_deg)
    n = int(keep.sum())
    return FilePoints(
        theta_i_deg=np.full(n, theta_i_deg),
        theta_o_deg=theta_o_deg[keep],
        phi_deg=phi_deg[keep],
        wavelength_nm=np.full(n, wavelength_nm),
        is_transmission=np.full(n, is_transmission),
        bsdf_per_sr=values[keep],
        row=rows[keep],
    )


def total(
    polar_deg: Float[np.ndarray, " polar"],
    azimuth_deg: Float[np.ndarray, " azimuth"],
    values: Float[np.ndarray, "polar azimuth"],
    specular_deg: float = 0.0,
    is_weighted: bool = False,
) -> float:
    """Integral of the values times the cosine from the normal, over the directions above the horizon.

    The polar angle is that from the specular direction; the values, which hold the cosine if they are
    weighted, are linear between the entries.
    """
    polar, azimuth = _divided(polar_deg), _divided(azimuth_deg)
    between = np.array([np.interp(polar, polar_deg, column) for column in values.T]).T
    between = np.array([np.interp(azimuth, azimuth_deg, line) for line in between])
    theta, _ = from_specular(specular_deg, polar[:, None], azimuth)
    cosine = np.cos(np.deg2rad(theta))
    weight = (cosine > 0).astype(float) if is_weighted else np.maximum(cosine, 0)
    power = between * weight * np.sin(np.deg2rad(polar))[:, None]
    return float(np.trapezoid(np.trapezoid(power, np.deg2rad(azimuth), axis=1), np.deg2rad(polar)))


def lone_values(values: Float[np.ndarray, "*table"]) -> Int[np.ndarray, " lone"]:
    """Places, in the flattened table, of a few values above 100 times every other one, and all others in sum.

    On such values, typing errors for the most part, a table must not be scaled. A few are up to 1 % of the
    table; values of 0 do not count.
    """
    size = np.abs(values).ravel()
    order = np.argsort(size)[::-1]
    larger, few = size[order], max(1, size.size // 100)
    above, below, sums = larger[:few], larger[1 : few + 1], np.cumsum(larger)
    steps = np.flatnonzero((below > 0) & (above[: below.size] > _LONE_STEP * below))
    dwarfing = steps[sums[steps] > sums[-1] - sums[steps]]
    return order[: dwarfing[0] + 1] if dwarfing.size else order[:0]


def _divided(axis: np.ndarray) -> np.ndarray:
    """The axis with every step divided."""
    n = len(axis) - 1
    return np.interp(np.arange(_PARTS * n + 1) / _PARTS, np.arange(n + 1), axis)
