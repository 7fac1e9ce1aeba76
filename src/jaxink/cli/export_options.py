"""Options of the commands that write files for ray tracers."""

from pathlib import Path
from typing import Annotated, Any

import typer

Format = Annotated[
    str,
    typer.Option(metavar="zemax|lighttools|speos|integra|radiance|mitsuba|csv|netcdf", help="Output format."),
]
Files = Annotated[Path, typer.Option(metavar="DIR", help="Folder for the files.")]
Name = Annotated[str, typer.Option(metavar="NAME", help="Prefix of the file names.")]
AllowLoss = Annotated[
    str,
    typer.Option(
        metavar="LOSS,...",
        help="What may be lost if the format cannot represent it: regular, beyond_critical, narrow_lobes, "
        "standard_errors, index_step.",
    ),
]
RegularBinDeg = Annotated[
    float | None,
    typer.Option(
        metavar="DEG",
        help="Spread the regular part over cones of this full width at half maximum.",
    ),
]
Basis = Annotated[str, typer.Option(metavar="klems|tensor_tree", help="Angular basis of Radiance files.")]


InterpolationError = Annotated[
    float,
    typer.Option(
        metavar="X",
        help="Largest error of linear interpolation, over the largest BSDF of an incidence, that leaving out "
        "angles may cause in Mitsuba's files.",
    ),
]


def choices_of(
    name: str, allow_loss: str, regular_bin_deg: float | None, basis: str, interpolation_error: float
) -> dict[str, Any]:
    """Fields of `ExportOptions`."""
    drop = tuple(loss.strip() for loss in allow_loss.split(",") if loss.strip())
    return {
        "name": name,
        "drop": drop,
        "regular_bin_deg": regular_bin_deg,
        "basis": basis,
        "interpolation_error": interpolation_error,
    }


def given_of(choices: dict[str, Any], name: str, quiet: bool, debug: bool) -> dict[str, Any]:
    """Options of `_choices` as they are typed; ``name`` is the default of the name."""
    return {
        "--name": choices["name"] if choices["name"] != name else None,
        "--allow-loss": ",".join(choices["drop"]) or None,
        "--regular-bin-deg": choices["regular_bin_deg"],
        "--basis": choices["basis"] if choices["basis"] != "klems" else None,
        "--interpolation-error": error if (error := choices["interpolation_error"]) != 0.005 else None,
        "--quiet": quiet,
        "--debug": debug,
    }
