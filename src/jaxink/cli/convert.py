"""``jaxink convert``."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from jaxink.cli.session import ExitCode
from jaxink.errors import InputRefusedError
from jaxink.files.reading import shown_path
from jaxink.files.version import installed_version
from jaxink.files.writing import require_file
from jaxink.measurement import read, refuse_other_samples, wavelength_words, write_csv

if TYPE_CHECKING:
    from jaxink import GonioData


def run_convert(data_files: Sequence[Path], out: Path, columns: dict[str, Any], quiet: bool) -> ExitCode:
    """Read the files, with what ``columns`` states for `jaxink.read`, and write them as one CSV file."""
    if out.suffix.lower() != ".csv":
        raise InputRefusedError(f"{shown_path(out)}: the suffix is '{out.suffix}'; it must be .csv.")
    require_file(out)
    if any(file.exists() and out.exists() and file.samefile(out) for file in data_files):
        raise InputRefusedError(f"{shown_path(out)}: is read, too; give another name for the result.")
    data = read(data_files, **columns)
    refuse_other_samples(data, "Convert the files of different samples one by one", within_files=False)
    names = ", ".join(file.name for file in data_files)
    write_csv(data, out, [f"Converted by jaxink {installed_version()} from {names}.", *data.notes])
    if not quiet:
        typer.echo("\n".join([_headline(data), *data.notes, f"Written: {out}"]))
    return ExitCode.FITTED


def _headline(data: "GonioData") -> str:
    sides = " and ".join(sorted(set(data.side.tolist())))
    at = wavelength_words(sorted(set(data.wavelength_nm.tolist())))
    incidences = len(set(data.theta_i_deg.tolist()))
    angles = "1 angle" if incidences == 1 else f"{incidences} angles"
    return f"{len(data)} values of {data.source}: {sides} at {at}, {angles} of incidence."
