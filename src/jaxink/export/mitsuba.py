"""Export to Mitsuba 3: the table, a plug-in that reads it, and an example scene."""

import dataclasses
from importlib.resources import files
from pathlib import Path

import numpy as np

from jaxink.export.limitations import ExportOptions
from jaxink.export.thinning import thinned
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
    few = thinned(table, options.interpolation_error)
    names = "bsdf_per_sr", "regular"
    # A renderer needs no more digits, and the file has half the size.
    few = dataclasses.replace(few, **{name: getattr(few, name).astype(np.float32) for name in names})
    error = f"{100 * options.interpolation_error:.3g} %"
    few.attrs["resolution"] = (
        f"{len(few.theta_deg)} of {len(table.theta_deg)} polar angles and {len(few.phi_deg)} of "
        f"{len(table.phi_deg)} azimuths of the computed table; linear interpolation differs from that table "
        f"by at most {error} of the largest BSDF of an incidence up to 85 degrees, and totals by {error} of "
        "the incident power"
    )
    name = f"{options.name}.nc"
    (folder / name).write_bytes(netcdf_bytes(few.to_dataset()))
    for program in _PROGRAMS:
        source = files("jaxink.export") / "for_mitsuba" / program
        (folder / program).write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
    return {name: f"the table with all four components ({few.attrs['resolution']})", **_PROGRAMS}
