"""Guide to the files of an export: the surface, what each file contains, and what was lost."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from jaxink.export.limitations import Loss
from jaxink.ink import InkTable, power_sent_out

# Attributes of a table that users must know, and what they are called.
_REMARKS = {
    "effects_included": "Effects that the files contain",
    "effects_left_out": "Effects of the sample that the files do not contain",
    "effects_of_the_instrument_removed": "Effects of the measurement, which are no part of the ink",
    "fit": "The fit",
    "printed_dots": "Printed dots",
}
# Towards the horizon, the sums of a table are less accurate.
_LARGEST_DEG = 80.0
# Verdicts on a fit that need no warning, those of `FitVerdictCode`: its package would import JAX, which an
# export of a saved table does without.
_GOOD_VERDICTS = ("consistent", "not_judged")


class Guide(NamedTuple):
    """Guide to the files of an export, in lines for people.

    Parameters
    ----------
    surface
        The surface and the media on both sides.
    contents
        What each file contains, by its name.
    losses
        What the files lack, and how much that is.
    use
        How to use the files.
    power
        How much of the power the rows send out, and what becomes of the rest.
    """

    surface: list[str]
    contents: dict[str, str]
    losses: list[str]
    use: str
    power: list[str]

    def lines(self, folder: Path | None = None) -> list[str]:
        """All lines; ``folder`` is put before the names of the files."""
        paths = {str(folder / name) if folder else name: what for name, what in self.contents.items()}
        width = max(map(len, paths))
        files = [f"  {path:<{width}}  {what}" for path, what in paths.items()]
        return [*self.surface, *self.losses, *self.power, self.use, "Files:", *files]


def guide_to(
    table: InkTable, contents: Mapping[str, str], losses: Sequence[Loss], use: str, missing: str = ""
) -> Guide:
    """Guide to the files of a table; ``missing``: what becomes of the power that a row lacks."""
    inside, outside = media(table)
    layers = str(table.attrs.get("layers", "")).split()
    noun = "the layer" if len(layers) == 1 else "the layers"
    included = f"They include {noun} {', '.join(layers)} with all faces: do not model these again."
    surface = [
        f"Side I, from which the ink is seen: {inside}, refractive index {_range(table.index_inside)}.",
        f"Side A, the other side: {outside}, refractive index {_range(table.index_outside)}.",
        "The files describe the face between the two; its normal points from side I to side A.",
        *([included] if layers else []),
        "R: reflection, T: transmission; then the side that the light comes from, and the side that it "
        "leaves to.",
    ]
    for name, what in _REMARKS.items():
        if table.attrs.get(name):
            surface.append(f"{what}: {table.attrs[name]}")
    lines = [f"Lost: {loss}." for loss in losses] or ["Lost: nothing."]
    if "regular" in table.attrs:
        lines.append(f"Regular light: {table.attrs['regular']}.")
    is_lost = any(loss.name == "regular" for loss in losses)
    return Guide(
        surface, dict(contents), lines, use, [*power_lines(table, is_lost), *filter(None, [missing])]
    )


def power_lines(table: InkTable, regular_is_lost: bool) -> list[str]:
    """How much of the power the rows send out, from each side.

    Parameters
    ----------
    table
        The table that is written.
    regular_is_lost
        Whether its regular part is not.
    """
    seen = table.theta_deg <= _LARGEST_DEG
    # The rows include both sides and all faces, so that only layers can take light away; a boundary has none.
    rest = "the ink absorbs the rest" if table.attrs.get("layers") else "the rest is missing"
    if regular_is_lost:
        rest = f"{rest}, apart from the regular light that is lost"
        table = dataclasses.replace(table, regular=np.zeros_like(table.regular))
    lines = []
    for side, power in zip("IA", power_sent_out(table), strict=True):
        low, high = (100 * float(end) for end in (power[:, seen].min(), power[:, seen].max()))
        lines.append(
            f"Light from side {side}: the rows send out {low:.3g} to {high:.3g} per cent of the power, for "
            f"incidence up to {_LARGEST_DEG:g} degrees; {rest}."
        )
    return lines


def media(table: InkTable) -> tuple[str, str]:
    """The media of side I and of side A, in words."""
    named = (table.attrs.get("medium_inside"), table.attrs.get("medium_outside"))
    return named[0] or "the inside of the plate", named[1] or "the outside"


def in_words(component: str) -> str:
    """Contents of a component, such as ``reflection of light from side I``."""
    if component[0] == "R":
        return f"reflection of light from side {component[2]}"
    return f"transmission of light from side {component[2]} to side {component[3]}"


def _range(values: np.ndarray) -> str:
    low, high = f"{values.min():.6g}", f"{values.max():.6g}"
    return low if low == high else f"{low} to {high}"


def warning_of(table: InkTable) -> str | None:
    """The verdict on the fit that a table is from, if it is not good."""
    is_good = table.attrs.get("fit_verdict", _GOOD_VERDICTS[0]) in _GOOD_VERDICTS
    return None if is_good else str(table.attrs["fit"])
