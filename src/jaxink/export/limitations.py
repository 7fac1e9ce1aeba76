"""Options of an export, and the refusal to lose part of a table that the caller does not allow to be lost."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from jaxink.display.brief import brief_repr
from jaxink.errors import InputRefusedError, require_one_of
from jaxink.export.losses import LOSSES, Loss

_LARGEST_ERROR = 0.1
WIDEST_BIN_DEG = 30


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
        `jaxink.export.thinning.thinned`; 0 keeps all angles.
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
                raise InputRefusedError(f"drop contains {name!r}; it may contain {', '.join(LOSSES)}.")
        require_one_of("basis", self.basis, ("klems", "tensor_tree"))
        if not self.name or any(sign in self.name for sign in '/\\:*?"<>| \t\n'):
            raise InputRefusedError(
                f"name is {self.name!r}; as a prefix of file names it must not be empty or contain spaces or "
                'any of / \\ : * ? " < > |.'
            )
        width = self.regular_bin_deg
        if width is not None and not 0 < width <= WIDEST_BIN_DEG:
            raise InputRefusedError(
                f"regular_bin_deg is {width:g}; it must be between 0 and {WIDEST_BIN_DEG} degrees."
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
