"""The points of an exchange file, and the measurement that they are."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxink.measurement import checks
from jaxink.measurement.conditions import refuse_several_conditions
from jaxink.measurement.dataset import GonioData
from jaxink.measurement.formats.exchange_options import ExchangeOptions
from jaxink.measurement.masks import value_bits, value_notes
from jaxink.measurement.table import TextTable, refusal

# Closer to 90 degrees, values times the cosine do not tell the BSDF.
_HORIZON_DEG = 1e-6
# Largest difference between the stated and the integrated total that passes without a note.
TOTAL_TOLERANCE = 0.02


@dataclass(frozen=True)
class FilePoints:
    """Values of a file by direction, in the conventions of `GonioData`.

    Azimuths may be beyond (-180, 180]; polar angles are already those of the side on which the light leaves.
    """

    theta_i_deg: Float[np.ndarray, " points"]
    theta_o_deg: Float[np.ndarray, " points"]
    phi_deg: Float[np.ndarray, " points"]
    wavelength_nm: Float[np.ndarray, " points"]
    is_transmission: Bool[np.ndarray, " points"]
    bsdf_per_sr: Float[np.ndarray, " points"]
    row: Int[np.ndarray, " points"]
    extra: dict[str, np.ndarray] = field(default_factory=dict)

    def at(self, keep: Bool[np.ndarray, " points"]) -> "FilePoints":
        """Some of the points."""
        arrays = {name: value[keep] for name, value in vars(self).items() if name != "extra"}
        return FilePoints(**arrays, extra={name: values[keep] for name, values in self.extra.items()})


def joined(parts: list[FilePoints]) -> FilePoints:
    """All points of several parts with the same extra columns."""
    names = [name for name in vars(parts[0]) if name != "extra"]
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    extra = {name: np.concatenate([part.extra[name] for part in parts]) for name in parts[0].extra}
    return FilePoints(**arrays, extra=extra)


def without_cosine(points: FilePoints, notes: list[str]) -> FilePoints:
    """The BSDF of values that are the BSDF times cos(theta_o); along the horizon it is unknown."""
    horizon = points.theta_o_deg > 90 - _HORIZON_DEG
    if horizon.any():
        notes.append(
            f"{int(horizon.sum())} values at theta_o_deg = 90 were left out: times the cosine, which is 0 "
            "there, they do not tell the BSDF."
        )
    points = points.at(~horizon)
    return replace(points, bsdf_per_sr=points.bsdf_per_sr / np.cos(np.deg2rad(points.theta_o_deg)))


def divided_as_requested(points: FilePoints, notes: list[str]) -> FilePoints:
    """The BSDF of values of which the caller says that they hold the cosine."""
    notes.append("The values were divided by cos(theta_o), as requested by the caller.")
    return without_cosine(points, notes)


def one_side(points: FilePoints, source: str, side: str | None, notes: list[str]) -> FilePoints:
    """The points of the side that the caller wants; a file without it is rejected."""
    if side is None:
        return points
    keep = points.is_transmission == (side == "T")
    if not keep.any():
        raise refusal(source, f"the file has only {'TR'[side == 'T']}, but the caller gives {side}")
    if not keep.all():
        notes.append(f"The file has R and T; only {side} was read, as requested by the caller.")
    return points.at(keep)


def one_wavelength(
    points: FilePoints, source: str, wavelength_nm: float | None, notes: list[str]
) -> FilePoints:
    """The points of the wavelength that the caller wants; a file without it is rejected."""
    if wavelength_nm is None:
        return points
    keep = np.abs(points.wavelength_nm - wavelength_nm) < 1e-6
    if not keep.any():
        held = ", ".join(f"{nm:g}" for nm in np.unique(points.wavelength_nm))
        raise refusal(source, f"wavelength_nm is {wavelength_nm:g}; the file has {held} nm")
    if not keep.all():
        notes.append(f"Only {wavelength_nm:g} nm was read, as requested by the caller.")
    return points.at(keep)


def totals_note(axis: str, totals: Sequence[tuple[float, float, float]]) -> list[str]:
    """Note on totals that are not those stated: angle, integrated and stated total of each incidence."""
    other = [each for each in totals if abs(each[1] - each[2]) > TOTAL_TOLERANCE]
    if not other:
        return []
    angle, found, stated = max(other, key=lambda each: abs(each[1] - each[2]))
    return [
        f"At {len(other)} of {len(totals)} incidences the values do not scatter the stated TIS (at {axis} "
        f"{angle:g}: {found:.3g} instead of {stated:.3g} of the incident power); the values were kept."
    ]


def measurement(points: FilePoints, source: str, choices: ExchangeOptions, notes: list[str]) -> GonioData:
    """The measurement of the points, checked as one that was read from a table.

    Raises
    ------
    InputRefusedError
        If there is no point, or an angle, a wavelength or a value is out of range.
    """
    points = one_side(points, source, choices.side, notes)
    if not points.row.size:
        raise refusal(source, "contains no direction on the side where the light leaves")
    table = TextTable(source, (), (), points.row, 0, ())
    theta_i, theta_o = (
        checks.polar_angles(table, _rounded(getattr(points, name)), name)
        for name in ("theta_i_deg", "theta_o_deg")
    )
    bsdf = checks.magnitudes(table, points.bsdf_per_sr, "bsdf_per_sr")
    checks.refuse_unwrapped(source, points.phi_deg, points.row)
    directions = (
        theta_i,
        theta_o,
        wrapped_deg(points.phi_deg),
        checks.wavelengths(source, points.wavelength_nm, points.row),
        points.is_transmission,
    )
    data = GonioData(
        *directions,
        bsdf_per_sr=bsdf,
        extra=points.extra,
        row=points.row,
        mask=value_bits(directions, bsdf),
        source=Path(source).name,
    )
    checks.refuse_nothing_or_excess(table, directions, bsdf, data.scan_index, data.mask)
    refuse_several_conditions(data, source)
    notes += value_notes(data.mask, directions, data.row)
    return data.replace(notes=notes)


def _rounded(angle_deg: np.ndarray) -> np.ndarray:
    """Polar angles without the rounding errors of a rotation, which may put them beyond their range."""
    angle_deg = np.round(angle_deg, 9)
    near = np.clip(angle_deg, 0, 90)
    return np.where(np.abs(angle_deg - near) < 1e-6, near, angle_deg)


def wrapped_deg(phi_deg: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Azimuths in (-180, 180]; rounding does not move one across 180."""
    phi = np.round(np.mod(phi_deg, 360.0), 9) % 360
    return np.where(phi > 180, phi - 360, phi) + 0.0
