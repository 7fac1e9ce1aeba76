"""A project file with the present measurements and one to be made, and the table to fill in."""

import json
from collections.abc import Mapping

import numpy as np

from jaxink.measurement import GonioData, Readings
from jaxink.planning.menu import Candidate

_HEAD = "theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr,sigma_per_sr"


def next_project(
    candidate: Candidate, present: Mapping[str, str], sample_file: str, project: str = ""
) -> dict[str, str]:
    """Texts of a project file and of the empty table of its new measurement, by file name.

    Parameters
    ----------
    candidate
        The measurement to be made.
    present
        File of each present measurement by its name; empty for a table to be added to a project file that
        there is.
    sample_file
        The common sample file.
    project
        Text of the project file that the measurement is added to; empty for none.
    """
    table = f"{candidate.name}.csv"
    lines = [project.rstrip(), ""] if project else ["# Add this table to the project file."]
    if present:
        lines = ["schema_version = 1", f"sample = {json.dumps(sample_file)}", ""]
    for name, file in present.items():
        lines += ["[[measurements]]", f"name = {json.dumps(name)}", f"data = {json.dumps(file)}", ""]
    is_readings = isinstance(candidate.measurement.data, Readings)
    lines += [
        f"# To be measured: {candidate.words}.",
        "[[measurements]]",
        f"name = {json.dumps(candidate.name)}",
        f"{'readings' if is_readings else 'data'} = {json.dumps(table)}",
    ]
    if candidate.lit_side:
        lines.append(f"lit_side = {json.dumps(candidate.lit_side)}")
    for stem, keys in candidate.changes.items():
        for key, value in keys.items():
            dotted = ".".join(("changes", stem, *([key] if key else [])))
            lines.append(f"{dotted} = {value:g}  # as it is when measured")
    return {"next.toml": "\n".join(lines) + "\n", table: _table(candidate.measurement.data)}


def _table(data: GonioData | Readings) -> str:
    """The rows to be measured, without values."""
    if isinstance(data, Readings):
        rows = [
            f"{q},,,{w:g}" for q, w in zip(data.quantity.tolist(), data.wavelength_nm.tolist(), strict=True)
        ]
        return "\n".join(["quantity,value,sigma,wavelength_nm", *rows]) + "\n"
    side = np.where(data.is_transmission, "T", "R")
    columns = data.theta_i_deg, data.theta_o_deg, data.phi_deg, data.wavelength_nm, side
    rows = [f"{i:g},{o:g},{p:g},{w:g},{s},," for i, o, p, w, s in zip(*columns, strict=True)]
    return "\n".join([_HEAD, *rows]) + "\n"
