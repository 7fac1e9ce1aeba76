"""A project file with the present measurements and one to be made, and the table to fill in."""

import json
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from jaxink.measurement import GonioData, Readings
from jaxink.planning.menu import Candidate
from jaxink.projects import toml_key, toml_value

_HEAD = "theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr,sigma_per_sr"


# What a measurement states of its sample and its instrument.
_OWN = ("instrument", "specimen", "lit_side", "changes")


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
    base = {} if present else _stated(project, candidate.base)
    lines.append(f"# To be measured: {candidate.words}.")
    if base is None:
        lines.append(f"# As '{candidate.base}' was; add its specimen, instrument, lit_side and changes.")
    elif not present:
        lines.append(
            f"# As '{candidate.base}' was; add what its file states: lit side, specimen, thickness, backing."
        )
    if base and "changes" in base:
        lines.append(
            "# What both change has a value for each; in one [specimens.NAME] instead, it would be common."
        )
    is_readings = isinstance(candidate.measurement.data, Readings)
    keys = {"name": candidate.name, "readings" if is_readings else "data": table} | (base or {})
    if is_readings:
        # Another instrument reads them.
        keys.pop("instrument", None)
    if candidate.lit_side:
        keys["lit_side"] = candidate.lit_side
    kept = keys.pop("changes", {})
    lines += ["[[measurements]]", *(f"{key} = {toml_value(value)}" for key, value in keys.items())]
    lines += [f"{key} = {toml_value(value)}" for key, value in _flat(_without(kept, candidate.changes))]
    lines += [f"{key} = {toml_value(v)}  # as it is when measured" for key, v in _flat(candidate.changes)]
    return {"next.toml": "\n".join(lines) + "\n", table: _table(candidate.measurement.data)}


def _stated(project: str, name: str) -> dict[str, Any] | None:
    """What a measurement of a project file states of its sample; None if there is no such table."""
    tables = tomllib.loads(project).get("measurements", [])
    found = next((table for table in tables if table["name"] == name), None)
    return None if found is None else {key: found[key] for key in _OWN if key in found}


def _flat(changes: Mapping[str, Any], stem: str = "changes") -> Iterator[tuple[str, Any]]:
    """Dotted keys and values: the tables of the sample file, and the keys in them."""
    for key, value in changes.items():
        dotted = f"{stem}.{toml_key(key)}"
        if isinstance(value, Mapping) and stem == "changes":
            yield from _flat(value, dotted)
        else:
            yield dotted, value


def _without(changes: Mapping[str, Any], replaced: Mapping[str, Any]) -> dict[str, Any]:
    """Changes less those that others replace."""
    kept = {}
    for key, value in changes.items():
        other = replaced.get(key)
        if other is None:
            kept[key] = value
        elif isinstance(value, Mapping) and isinstance(other, Mapping):
            kept[key] = {inner: v for inner, v in value.items() if inner not in other}
    return kept


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
