"""One call for every format; a folder gets all files of an export or none."""

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.export.flat_csv import write_csv
from jaxink.export.lighttools import write_lighttools
from jaxink.export.losses import ExportOptions, refuse_losses
from jaxink.export.mitsuba import write_mitsuba
from jaxink.export.radiance import write_radiance
from jaxink.export.sampling import regular_in_bins, writable
from jaxink.export.speos import write_speos
from jaxink.export.table import InkTable
from jaxink.export.zemax import write_zemax


class _Format(NamedTuple):
    title: str
    write: Callable[[InkTable, Path, ExportOptions], None]
    # What it has no place for.
    lost: tuple[str, ...] = ()


def _write_netcdf(table: InkTable, folder: Path, options: ExportOptions) -> None:
    table.to_netcdf(folder / f"{options.name}.nc")


_FORMATS = {
    "zemax": _Format("Zemax .bsdf", write_zemax, ("regular", "beyond_critical", "standard_errors")),
    "lighttools": _Format(
        "LightTools .bsdf", write_lighttools, ("regular", "narrow_lobes", "standard_errors")
    ),
    "speos": _Format("Speos .anisotropicbsdf", write_speos, ("regular", "narrow_lobes", "standard_errors")),
    "radiance": _Format(
        "Radiance XML", write_radiance, ("regular", "narrow_lobes", "index_step", "standard_errors")
    ),
    "mitsuba": _Format("Mitsuba 3", write_mitsuba, ("narrow_lobes",)),
    "csv": _Format("CSV", write_csv, ("narrow_lobes",)),
    "netcdf": _Format("netCDF", _write_netcdf),
}
FORMATS = tuple(_FORMATS)


def require_format(format: str) -> None:
    """Refuse a format that there is not.

    Parameters
    ----------
    format
        Its name.

    Raises
    ------
    InputRefusedError
        With those that there are.
    """
    require_one_of("format", format, FORMATS)


def write(
    table: InkTable, format: str, directory: str | Path, options: ExportOptions | None = None
) -> list[Path]:
    """Write the ink for a ray tracer.

    Parameters
    ----------
    table
        The ink.
    format
        One of `FORMATS`.
    directory
        An existing folder; files of the same names are replaced.
    options
        Names, what may be lost, and choices of a format; None for the defaults.

    Returns
    -------
    list[Path]
        The files written, by name.

    Raises
    ------
    InputRefusedError
        If the format cannot hold the table, the table is no BSDF, or the folder cannot be written to.
    """
    require_format(format)
    options = ExportOptions() if options is None else options
    chosen, directory = _FORMATS[format], Path(directory)
    table = writable(table)
    refuse_losses(table, chosen.title, chosen.lost, options)
    if options.regular_bin_deg is not None:
        table = regular_in_bins(table, options.regular_bin_deg)
    if not directory.is_dir():
        raise InputRefusedError(f"{directory}: is not a folder; create it first.")
    try:
        # Beside the targets, so that the last step is a rename within one file system.
        with tempfile.TemporaryDirectory(prefix=".jaxink-", dir=directory) as staging:
            chosen.write(table, Path(staging), options)
            files = sorted(Path(staging).iterdir())
            for file in files:
                os.replace(file, directory / file.name)
    except OSError as problem:
        raise InputRefusedError(
            f"{directory}: the files cannot be written there ({problem.strerror or problem}); choose another "
            "folder."
        ) from None
    return [directory / file.name for file in files]
