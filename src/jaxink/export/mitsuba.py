"""Export to Mitsuba 3: the table, a plug-in that reads it, and an example scene."""

from importlib.resources import files
from pathlib import Path

from jaxink.export.limitations import ExportOptions
from jaxink.files.netcdf import netcdf_bytes
from jaxink.ink.table import InkTable

_PROGRAMS = {
    "jaxink_table.py": "BSDF plug-in `jaxink_table`, which reads the table",
    "example_scene.py": "scene of an edge-lit plate with the ink on its lower face",
}


def write_mitsuba(table: InkTable, folder: Path, options: ExportOptions) -> dict[str, str]:
    """Write the netCDF file and the Python files that use it, which do not need jaxink.

    Parameters and return value: see `jaxink.export.formats.Format`.
    """
    table_file = f"{options.name}.nc"
    (folder / table_file).write_bytes(netcdf_bytes(table.to_dataset()))
    for name in _PROGRAMS:
        source = files("jaxink.export") / "for_mitsuba" / name
        (folder / name).write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    return {table_file: "the table with all four components", **_PROGRAMS}
