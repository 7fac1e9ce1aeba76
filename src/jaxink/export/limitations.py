"""Rejects an export that would lose part of a table, unless the caller allows the loss."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.ink.hemispherical_totals import critical_angle_deg, diffuse_totals
from jaxink.ink.table import COMPONENTS, InkTable

LOSSES = ("regular", "beyond_critical", "narrow_lobes", "standard_errors", "index_step")
# Share of the incident power that is treated as nothing.
_NEGLIGIBLE = 1e-6
# Error of lobes between the entries that is accepted, over the largest BSDF of an incidence.
_NEGLIGIBLE_LOBES = 0.01


@dataclasses.dataclass(frozen=True)
class ExportOptions:
    """Options of an export.

    Parameters
    ----------
    name
        Prefix of the file names.
    drop
        Members of `LOSSES` that may be lost.
    regular_bin_deg
        Full width at half maximum of the cone over which the regular part is spread if a format cannot store
        it separately; None: it is not spread.
    basis
        Basis of Radiance files: ``klems`` (145 patches, about 10 degrees wide) or ``tensor_tree`` (64 by 64
        cells).
    radial_deg, azimuth_deg
        Axes of Zemax files around the specular or refracted direction, from 0 to 180; None: steps of 0.25
        degrees near that direction and of 2.5 degrees elsewhere, and of 5 degrees in azimuth.
    """

    __repr__ = brief_repr

    name: str = "ink"
    drop: tuple[str, ...] = ()
    regular_bin_deg: float | None = None
    basis: str = "klems"
    radial_deg: Sequence[float] | None = None
    azimuth_deg: Sequence[float] | None = None

    def __post_init__(self):
        for name in self.drop:
            if name not in LOSSES:
                raise InputRefusedError(f"drop contains {name!r}; it may contain {', '.join(LOSSES)}.")
        require_one_of("basis", self.basis, ("klems", "tensor_tree"))
        if not self.name or any(sign in self.name for sign in '/\\:*?"<>| \t\n'):
            raise InputRefusedError(
                f"name is {self.name!r}; as a prefix of file names it must not be empty or contain spaces or "
                'any of / \\ : * ? " < > |.'
            )
        for field in ("radial_deg", "azimuth_deg"):
            axis = getattr(self, field)
            if axis is not None and (axis[0] != 0 or axis[-1] != 180 or np.any(np.diff(axis) <= 0)):
                raise InputRefusedError(f"{field} must ascend from 0 to 180 degrees.")


def refuse_losses(table: InkTable, title: str, lost: tuple[str, ...], options: ExportOptions) -> None:
    """Reject an export that would lose something that ``options.drop`` does not allow.

    ``title`` and ``lost`` are those of the `Format`.
    """
    if options.regular_bin_deg is not None and "regular" not in lost:
        raise InputRefusedError(f"{title} stores the regular part separately; leave out regular_bin_deg.")
    clauses, names = [], []
    for name in lost:
        folded = name == "regular" and options.regular_bin_deg is not None
        clause = None if name in options.drop or folded else _CLAUSES[name](table)
        if clause is not None:
            clauses.append(clause)
            names.append(name)
    if not clauses:
        return
    remedy = f"allow the loss (drop, --allow-loss {','.join(names)})"
    if "regular" in names:
        remedy += ", spread the regular part over cones (regular_bin_deg, --regular-bin-deg)"
    raise InputRefusedError(
        f"{title} cannot represent {', nor '.join(clauses)}; {remedy}, or choose a format that can: "
        f"{'netcdf' if 'narrow_lobes' in names else 'netcdf, csv, mitsuba'}."
    )


def _regular(table: InkTable) -> str | None:
    c, w, i = np.unravel_index(np.argmax(table.regular[:, :, :-1]), table.regular[:, :, :-1].shape)
    most = table.regular[c, w, i]
    if most <= _NEGLIGIBLE:
        return None
    return (
        f"regular (specular and refracted) light separately, which is up to {most:.3g} of the incident "
        f"power ({COMPONENTS[c]} at {table.theta_deg[i]:.3g} degrees, {table.wavelength_nm[w]:g} nm)"
    )


def _beyond_critical(table: InkTable) -> str | None:
    totals = diffuse_totals(table)
    most, where = 0.0, ""
    for c, component in enumerate(COMPONENTS):
        for w, wavelength_nm in enumerate(table.wavelength_nm):
            critical = critical_angle_deg(table, component, w)
            beyond = np.where(table.theta_deg > critical + 1e-6, totals[c, w], 0.0)
            if beyond.max() > max(most, _NEGLIGIBLE):
                most = beyond.max()
                where = f"{component} beyond {critical:.4g} degrees, {wavelength_nm:g} nm"
    if not where:
        return None
    return (
        "diffuse transmission of light that arrives beyond the critical angle, which is up to "
        f"{most:.3g} of the incident power ({where})"
    )


def _narrow_lobes(table: InkTable) -> str | None:
    if table.lobes is None:
        return None
    error = max(table.interpolation_error(lobes_apart=False).values())
    if error <= _NEGLIGIBLE_LOBES:
        return None
    return (
        "the lobes of a rough face, which are narrower than the steps of the table (error about "
        f"{error:.2g} of the largest BSDF of an incidence; larger n_theta and n_phi reduce it)"
    )


def _standard_errors(table: InkTable) -> str | None:
    known = table.bsdf_standard_error_per_sr is not None or table.regular_standard_error is not None
    return "standard errors" if known else None


def _index_step(table: InkTable) -> str | None:
    if np.allclose(table.index_inside, table.index_outside, rtol=0, atol=1e-9):
        return None
    return (
        f"refractive indices ({table.index_inside[0]:.4g} inside, {table.index_outside[0]:.4g} outside), "
        "because every ray is traced in a medium of index 1"
    )


_CLAUSES = {
    "regular": _regular,
    "beyond_critical": _beyond_critical,
    "narrow_lobes": _narrow_lobes,
    "standard_errors": _standard_errors,
    "index_step": _index_step,
}
