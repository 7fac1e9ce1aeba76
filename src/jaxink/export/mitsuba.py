"""Export to Mitsuba 3: the table, a plug-in that reads it, and an example scene."""

from importlib.resources import files
from pathlib import Path

from jaxink.export.limitations import ExportOptions
from jaxink.files.netcdf import netcdf_bytes
from jaxink.ink.table import InkTable

_PROGRAMS = ("jaxink_table.py", "example_scene.py")


def write_mitsuba(table: InkTable, folder: Path, options: ExportOptions) -> None:
    """Write the netCDF file and the Python files that use it, which do not need jaxink.

    Parameters: see `jaxink.export.formats.Format`.
    """
    (folder / f"{options.name}.nc").write_bytes(netcdf_bytes(table.to_dataset()))
    for name in _PROGRAMS:
        source = files("jaxink.export") / "for_mitsuba" / name
        (folder / name).write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
