"""What a format cannot hold is refused, unless the caller says that it may be lost."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.ink.hemispherical_totals import critical_angle_deg, diffuse_totals
from jaxink.ink.table import COMPONENTS, InkTable

LOSSES = ("regular", "beyond_critical", "narrow_lobes", "standard_errors", "index_step")
# Share of the incident power below which nothing is lost that a file's digits could show.
_NEGLIGIBLE = 1e-6
# Of the largest BSDF of an incidence: what reading lobes between the entries may be wrong by without a word.
_NEGLIGIBLE_LOBES = 0.01


@dataclasses.dataclass(frozen=True)
class ExportOptions:
    """Choices of an export.

    Parameters
    ----------
    name
        First part of the names of the files.
    drop
        What may be lost, of `LOSSES`.
    regular_bin_deg
        Where a format cannot keep the regular part apart: full width at half maximum of the cone over which
        it is spread; None: it is not.
    basis
        Of Radiance files: ``klems`` (145 patches, about 10 degrees wide) or ``tensor_tree`` (64 by 64 cells).
    radial_deg, azimuth_deg
        Axes of Zemax files, about the specular or refracted direction, from 0 to 180; None: 1/4 degree steps
        near that direction, 2.5 degrees elsewhere, and 5 degrees in azimuth.
    """

    name: str = "ink"
    drop: tuple[str, ...] = ()
    regular_bin_deg: float | None = None
    basis: str = "klems"
    radial_deg: Sequence[float] | None = None
    azimuth_deg: Sequence[float] | None = None

    def __post_init__(self):
        for name in self.drop:
            if name not in LOSSES:
                raise InputRefusedError(
                    f"drop names {name!r}; what may be lost is one of: {', '.join(LOSSES)}."
                )
        require_one_of("basis", self.basis, ("klems", "tensor_tree"))
        if not self.name or any(sign in self.name for sign in '/\\:*?"<>| \t\n'):
            raise InputRefusedError(
                f"name is {self.name!r}; it begins the names of files, so it needs letters, no space, slash "
                "or colon."
            )
        for field in ("radial_deg", "azimuth_deg"):
            axis = getattr(self, field)
            if axis is not None and (axis[0] != 0 or axis[-1] != 180 or np.any(np.diff(axis) <= 0)):
                raise InputRefusedError(f"{field} must ascend from 0 to 180 degrees.")


def refuse_losses(table: InkTable, title: str, lost: tuple[str, ...], options: ExportOptions) -> None:
    """Refuse what a format would lose and nobody has allowed.

    Parameters
    ----------
    table
        The table.
    title
        How the format is called.
    lost
        Of `LOSSES`: what the format has no place for.
    options
        What may be lost.

    Raises
    ------
    InputRefusedError
        In one sentence: the format, what it would lose, and what to do.
    """
    if options.regular_bin_deg is not None and "regular" not in lost:
        raise InputRefusedError(
            f"{title} keeps the regular part apart, so regular_bin_deg has no meaning for it; leave it out."
        )
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
        remedy += ", give the regular part a width instead (regular_bin_deg, --regular-bin-deg)"
    raise InputRefusedError(
        f"{title} cannot hold {'; nor '.join(clauses)}: {remedy}, or take a format that holds all: "
        f"{'netcdf' if 'narrow_lobes' in names else 'netcdf, csv, mitsuba'}."
    )


def _regular(table: InkTable) -> str | None:
    c, w, i = np.unravel_index(np.argmax(table.regular[:, :, :-1]), table.regular[:, :, :-1].shape)
    most = table.regular[c, w, i]
    if most <= _NEGLIGIBLE:
        return None
    return (
        f"the regular (specular and refracted) light apart from the diffuse, up to {most:.3g} of the "
        f"incident power ({COMPONENTS[c]} at {table.theta_deg[i]:.3g} degrees, {table.wavelength_nm[w]:g} nm)"
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
        f"diffuse transmission of light beyond the critical angle, up to {most:.3g} of the incident power "
        f"({where}), because its axis of incidence is the refracted angle"
    )


def _narrow_lobes(table: InkTable) -> str | None:
    if table.lobes is None:
        return None
    error = max(table.interpolation_error(lobes_apart=False).values())
    if error <= _NEGLIGIBLE_LOBES:
        return None
    return (
        f"the lobes of a rough face, narrower than its angles (about {error:.2g} of the largest BSDF of an "
        "incidence is lost or gained between them; more n_theta and n_phi help)"
    )


def _standard_errors(table: InkTable) -> str | None:
    if table.bsdf_standard_error_per_sr is None and table.regular_standard_error is None:
        return None
    return "standard errors"


def _index_step(table: InkTable) -> str | None:
    if np.allclose(table.index_inside, table.index_outside, rtol=0, atol=1e-9):
        return None
    return (
        f"refractive indices ({table.index_inside[0]:.4g} inside, {table.index_outside[0]:.4g} outside), as "
        "it traces every ray in a medium of index 1 and refracts none at this surface"
    )


_CLAUSES = {
    "regular": _regular,
    "beyond_critical": _beyond_critical,
    "narrow_lobes": _narrow_lobes,
    "standard_errors": _standard_errors,
    "index_step": _index_step,
}
