"""Catalogue of the formats, and the call that writes them."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from jaxink.errors import InputRefusedError, require_one_of
from jaxink.export.flat_csv import write_csv
from jaxink.export.lighttools import write_lighttools
from jaxink.export.limitations import ExportOptions, refuse_losses
from jaxink.export.mitsuba import write_mitsuba
from jaxink.export.preparation import regular_in_bins, writable
from jaxink.export.radiance import write_radiance
from jaxink.export.speos import write_speos
from jaxink.export.zemax import write_zemax
from jaxink.files.netcdf import netcdf_bytes
from jaxink.files.writing import whole_folder
from jaxink.ink.table import InkTable


class Format(NamedTuple):
    """A file format.

    Parameters
    ----------
    title
        Name in messages.
    write
        Writes a table into a folder.
    lost
        Members of `LOSSES` that it cannot represent.
    """

    title: str
    write: Callable[[InkTable, Path, ExportOptions], None]
    lost: tuple[str, ...] = ()


def _write_netcdf(table: InkTable, folder: Path, options: ExportOptions) -> None:
    (folder / f"{options.name}.nc").write_bytes(netcdf_bytes(table.to_dataset()))


_FORMATS = {
    "zemax": Format("Zemax .bsdf", write_zemax, ("regular", "beyond_critical", "standard_errors")),
    "lighttools": Format(
        "LightTools .bsdf", write_lighttools, ("regular", "narrow_lobes", "standard_errors")
    ),
    "speos": Format("Speos .anisotropicbsdf", write_speos, ("regular", "narrow_lobes", "standard_errors")),
    "radiance": Format(
        "Radiance XML", write_radiance, ("regular", "narrow_lobes", "index_step", "standard_errors")
    ),
    "mitsuba": Format("Mitsuba 3", write_mitsuba, ("narrow_lobes",)),
    "csv": Format("CSV", write_csv, ("narrow_lobes",)),
    "netcdf": Format("netCDF", _write_netcdf),
}
FORMATS = tuple(_FORMATS)


def require_format(format: str) -> None:
    """Reject an unknown format."""
    require_one_of("format", format, FORMATS)


def write(
    table: InkTable, format: str, directory: str | Path, options: ExportOptions | None = None
) -> list[Path]:
    """Write an ink table for a ray tracer.

    Parameters
    ----------
    table
        The table.
    format
        One of `FORMATS`.
    directory
        An existing folder; files of the same names are replaced, all of them or none.
    options
        Choices; None for the defaults.

    Returns
    -------
    list[Path]
        The files written, sorted by name.

    Raises
    ------
    InputRefusedError
        If the format cannot represent the table, the table is not a BSDF, or the folder cannot be written to.
    """
    require_format(format)
    if not Path(directory).is_dir():
        raise InputRefusedError(f"{directory} is not a folder; create it first.")
    return write_folder(table, format, directory, ExportOptions() if options is None else options)


def write_folder(table: InkTable, format: str, directory: str | Path, options: ExportOptions) -> list[Path]:
    """As `write`, into a folder that is created if it does not exist."""
    chosen = _FORMATS[format]
    table = writable(table)
    refuse_losses(table, chosen.title, chosen.lost, options)
    if options.regular_bin_deg is not None:
        table = regular_in_bins(table, options.regular_bin_deg)
    with whole_folder(directory) as folder:
        chosen.write(table, folder, options)
        names = sorted(file.name for file in folder.iterdir())
    return [Path(directory) / name for name in names]
