"""What a file format cannot represent of a table, and the refusal to lose it unless the caller allows it."""

import dataclasses
import math
from collections.abc import Collection, Sequence

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.ink import (
    COMPONENTS,
    NEGLIGIBLE,
    SAME_INDEX,
    ExpectedTable,
    InkTable,
    critical_angle_deg,
    diffuse_totals,
    projected_weights,
)

# What may be lost, in words.
_IN_WORDS = {
    "regular": "regular (specular and refracted) light",
    "beyond_critical": "diffuse transmission of light that arrives beyond the critical angle",
    "narrow_lobes": "the lobes of a rough face between the angles of the table",
    "standard_errors": "standard errors",
    "index_step": "refractive indices, as every ray is traced in a medium of index 1",
}
LOSSES = tuple(_IN_WORDS)
# Error of lobes between the entries that is accepted, over the largest BSDF of an incidence.
_NEGLIGIBLE_LOBES = 0.01
_LARGEST_ERROR = 0.1
WIDEST_BIN_DEG = 30


@dataclasses.dataclass(frozen=True)
class Loss:
    """Part of a table that a format cannot represent.

    Parameters
    ----------
    name
        Member of `LOSSES`.
    amount
        How much it is, in words.
    """

    name: str
    amount: str

    def __str__(self) -> str:
        return f"{_IN_WORDS[self.name]} ({self.amount})"


def losses_of(table: InkTable, limits: Collection[str]) -> list[Loss]:
    """What a format with these limits, members of `LOSSES`, loses of a table."""
    found = {name: _MEASURED[name](table) for name in limits}
    return [Loss(name, amount) for name, amount in found.items() if amount is not None]


def expected_losses(table: ExpectedTable, limits: Collection[str]) -> list[Loss]:
    """What a format with these limits may lose of a table that is still to be computed."""
    inside, outside = table.index_inside[0], table.index_outside[0]
    has_step = abs(inside - outside) > SAME_INDEX
    found = {}
    if table.has_regular:
        found["regular"] = "smooth faces reflect and transmit it"
        if inside > outside + SAME_INDEX:
            found["regular"] += (
                f", all that the plate guides beyond {_critical_deg(inside, outside):.4g} degrees"
            )
    if has_step:
        side = "inside" if inside > outside else "outside"
        found["beyond_critical"] = f"{_critical_deg(inside, outside):.4g} degrees {side}"
        found["index_step"] = _both_indices(inside, outside)
    if table.rough_faces:
        found["narrow_lobes"] = f"of {', '.join(table.rough_faces)}"
    if table.has_standard_errors:
        found["standard_errors"] = "of the fit"
    return [Loss(name, found[name]) for name in limits if name in found]


def _critical_deg(inside: float, outside: float) -> float:
    return math.degrees(math.asin(min(inside, outside) / max(inside, outside)))


def _regular(table: InkTable) -> str | None:
    # At grazing incidence, every smooth face reflects everything.
    shares = table.regular[:, :, :-1]
    c, w, i = np.unravel_index(np.argmax(shares), shares.shape)
    if shares[c, w, i] <= NEGLIGIBLE:
        return None
    normal = np.unravel_index(np.argmax(shares[:, :, 0]), shares.shape[:2])
    guided = _guided_regular(table)
    of_guided = "" if guided is None else f"{_share_or_none(guided)} of the light that the plate guides; "
    return (
        f"{of_guided}up to {_percent(shares[*normal, 0])} of the incident power at normal incidence, "
        f"{COMPONENTS[normal[0]]}, and up to {_percent(shares[c, w, i])} elsewhere, {COMPONENTS[c]} at "
        f"{table.theta_deg[i]:.3g} degrees, {table.wavelength_nm[w]:g} nm"
    )


def _guided_regular(table: InkTable) -> float | None:
    """Largest regular share of light beyond the critical angle of side I, diffuse there; None without one."""
    shares = []
    for w in range(len(table.wavelength_nm)):
        beyond = table.theta_deg > critical_angle_deg(table, "T_IA", w)
        weights = projected_weights(table.theta_deg) * beyond
        if weights.sum() > 0:
            shares.append(weights @ table.regular[COMPONENTS.index("R_II"), w] / weights.sum())
    return max(shares, default=None)


def _beyond_critical(table: InkTable) -> str | None:
    totals = diffuse_totals(table)
    most, where = 0.0, ""
    for c, component in enumerate(COMPONENTS):
        for w, wavelength_nm in enumerate(table.wavelength_nm):
            critical = critical_angle_deg(table, component, w)
            beyond = np.where(table.theta_deg > critical + 1e-6, totals[c, w], 0.0)
            if beyond.max() > max(most, NEGLIGIBLE):
                most = beyond.max()
                where = f"{component} beyond {critical:.4g} degrees, {wavelength_nm:g} nm"
    return f"up to {_percent(most)} of the incident power, {where}" if where else None


def _narrow_lobes(table: InkTable) -> str | None:
    if table.lobes is None:
        return None
    error = max(table.interpolation_error(lobes_apart=False).values())
    if error <= _NEGLIGIBLE_LOBES:
        return None
    return (
        f"error about {_percent(error)} of the largest BSDF of an incidence; larger n_theta and n_phi "
        "reduce it"
    )


def _standard_errors(table: InkTable) -> str | None:
    errors = table.bsdf_standard_error_per_sr
    if errors is None:
        return None if table.regular_standard_error is None else "of the regular part"
    positive = table.bsdf_per_sr > 0
    relative = errors[positive] / table.bsdf_per_sr[positive]
    return f"{_percent(np.median(relative))} of an entry in the median" if relative.size else "of the entries"


def _index_step(table: InkTable) -> str | None:
    if np.allclose(table.index_inside, table.index_outside, rtol=0, atol=SAME_INDEX):
        return None
    return _both_indices(table.index_inside[0], table.index_outside[0])


def _both_indices(inside: float, outside: float) -> str:
    return f"{inside:.4g} inside, {outside:.4g} outside"


def _share_or_none(share: float) -> str:
    return "none" if share <= NEGLIGIBLE else _percent(share)


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


_MEASURED = {
    "regular": _regular,
    "beyond_critical": _beyond_critical,
    "narrow_lobes": _narrow_lobes,
    "standard_errors": _standard_errors,
    "index_step": _index_step,
}


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
        Axes of files of Zemax and Integra around the specular or refracted direction, from 0 to 180; None:
        steps of 0.25 degrees near that direction and of 2.5 degrees elsewhere, and of 5 degrees in azimuth.
    interpolation_error
        Largest error that may arise in Mitsuba's files from leaving out angles of the table, see
        `jaxink.export.mitsuba.thinned`; 0 keeps all angles.
    """

    __repr__ = brief_repr

    name: str = "ink"
    drop: tuple[str, ...] = ()
    regular_bin_deg: float | None = None
    basis: str = "klems"
    radial_deg: Sequence[float] | None = None
    azimuth_deg: Sequence[float] | None = None
    interpolation_error: float = 0.005

    def __post_init__(self):
        for name in self.drop:
            if name not in LOSSES:
                raise InputRefusedError(
                    f"drop (--allow-loss) contains {name!r}; it may contain {', '.join(LOSSES)}."
                )
        require_one_of("basis", self.basis, ("klems", "tensor_tree"))
        if not self.name or any(sign in self.name for sign in '/\\:*?"<>| \t\n'):
            raise InputRefusedError(
                f"name is {self.name!r}; as a prefix of file names it must not be empty or contain spaces or "
                'any of / \\ : * ? " < > |.'
            )
        width = self.regular_bin_deg
        if width is not None and not 0 < width <= WIDEST_BIN_DEG:
            raise InputRefusedError(
                f"regular_bin_deg (--regular-bin-deg) is {width:g}; it must be between 0 and "
                f"{WIDEST_BIN_DEG} degrees."
            )
        if not 0 <= self.interpolation_error <= _LARGEST_ERROR:
            raise InputRefusedError(
                f"interpolation_error is {self.interpolation_error:g}; it must be between 0 and "
                f"{_LARGEST_ERROR:g}."
            )
        for field in ("radial_deg", "azimuth_deg"):
            axis = getattr(self, field)
            if axis is not None and (axis[0] != 0 or axis[-1] != 180 or np.any(np.diff(axis) <= 0)):
                raise InputRefusedError(f"{field} must ascend from 0 to 180 degrees.")


class LossRefusedError(InputRefusedError):
    """An export would lose something that its options do not allow to be lost.

    Parameters
    ----------
    title
        Format, for the message.
    losses
        What would be lost.
    able
        Formats that lose nothing of it.

    Attributes
    ----------
    reason
        What the format cannot represent, and which formats can, in one sentence.
    losses
        The names of the losses.
    """

    def __init__(self, title: str, losses: Sequence[Loss], able: Sequence[str]):
        self.losses = tuple(loss.name for loss in losses)
        reason = f"{title} cannot represent {', nor '.join(map(str, losses))}"
        self.reason = f"{reason}; formats that can: {', '.join(able)}."
        remedy = f"allow the loss (drop, --allow-loss {','.join(self.losses)})"
        if "regular" in self.losses:
            remedy += ", spread the regular part over cones (regular_bin_deg, --regular-bin-deg)"
        super().__init__(f"{reason}; {remedy}, or choose a format that can: {', '.join(able)}.")
