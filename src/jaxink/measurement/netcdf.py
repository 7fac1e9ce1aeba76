"""Measurements as xarray Datasets and netCDF files, and exactly back."""

import json
import re
from pathlib import Path

import numpy as np

from jaxink.files import require_readable
from jaxink.measurement.dataset import GonioData
from jaxink.measurement.masks import MASK_FLAGS
from jaxink.measurement.table import refusal
from jaxink.netcdf import read_dataset, write_dataset

SCHEMA = "jaxink.measurement"
SCHEMA_VERSION = 1
MOST_BYTES = 1_000_000_000

_COORDINATES = {
    "theta_i_deg": ("degree", "polar angle of incidence from the outward normal"),
    "theta_o_deg": ("degree", "polar angle of view from the outward normal of the side of exit"),
    "phi_deg": ("degree", "azimuth of the outgoing direction minus that towards the source"),
    "wavelength_nm": ("nm", "wavelength in vacuum"),
}
_VALUES = {
    "bsdf_per_sr": ("sr-1", "radiance over irradiance, cosine not included"),
    "sigma_per_sr": ("sr-1", "standard deviation of bsdf_per_sr"),
}
_CONVENTIONS = (
    "phi_deg 180 is the half-plane of the specular direction in reflection and of the undeviated beam "
    "in transmission, 0 the half-plane of the source; is_transmission is 0 in reflection, 1 in "
    "transmission; row counts the lines of the source file from 1; a point with mask 0 is used."
)


def to_dataset(data: GonioData):
    """The measurement as an xarray Dataset along dimension ``point``.

    Parameters
    ----------
    data
        The measurement.

    Returns
    -------
    xarray.Dataset
        Coordinates theta_i_deg, theta_o_deg, phi_deg [degree], wavelength_nm [nm], is_transmission,
        row; variables bsdf_per_sr, sigma_per_sr [1/sr] if known, mask, and one variable
        ``extra_<n>_<name>`` for each kept column.
    """
    import xarray

    def variable(values, **attrs):
        return ("point", values.copy(), attrs)

    def described(table):
        return {
            name: variable(getattr(data, name), units=units, long_name=meaning)
            for name, (units, meaning) in table.items()
            if getattr(data, name) is not None
        }

    coordinates = described(_COORDINATES)
    coordinates["is_transmission"] = variable(
        data.is_transmission.astype(np.int8),
        long_name="side of exit",
        flag_values=np.array([0, 1], np.int8),
        flag_meanings="reflection transmission",
    )
    coordinates["row"] = variable(data.row, long_name="row of the source file")
    variables = described(_VALUES)
    variables["mask"] = variable(
        data.mask,
        long_name="why the point is not used",
        flag_masks=np.array([flag.bit for flag in MASK_FLAGS], np.uint32),
        flag_meanings=" ".join(flag.name for flag in MASK_FLAGS),
    )
    for number, (name, values) in enumerate(data.extra.items()):
        plain = re.sub(r"\W+", "_", name)
        is_text = values.dtype.kind == "U"
        kept = values.astype(object) if is_text else values
        variables[f"extra_{number}_{plain}"] = variable(kept, column=name)
    attrs = {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "conventions": _CONVENTIONS,
        "source": data.source,
        "notes": json.dumps(data.notes),
        "attrs": json.dumps(dict(data.attrs)),
    }
    return xarray.Dataset(variables, coordinates, attrs)


def from_dataset(dataset, source: str | None = None) -> GonioData:
    """The measurement of a Dataset that ``to_dataset`` made.

    Parameters
    ----------
    dataset
        The Dataset.
    source
        How to call it in an error, the file for instance.

    Returns
    -------
    GonioData

    Raises
    ------
    InputRefusedError
        The Dataset is not of this schema, of a later version, or lacks a variable.
    """
    called = source or "the Dataset"
    if dataset.attrs.get("schema") != SCHEMA:
        raise refusal(called, f"is not a jaxink measurement: attribute schema must be {SCHEMA}")
    version = int(dataset.attrs.get("schema_version", 0))
    if version != SCHEMA_VERSION:
        text = f"has schema_version {version}; this jaxink reads version {SCHEMA_VERSION}"
        raise refusal(called, text)
    names = [*_COORDINATES, "is_transmission", "row", "bsdf_per_sr", "mask"]
    missing = [name for name in names if name not in dataset.variables]
    if missing:
        raise refusal(called, f"variable {missing[0]} is missing")
    missing = [name for name in ("source", "notes", "attrs") if name not in dataset.attrs]
    if missing:
        raise refusal(called, f"attribute {missing[0]} is missing")
    fields = {name: dataset[name].values for name in names}
    if "sigma_per_sr" in dataset.variables:
        fields["sigma_per_sr"] = dataset["sigma_per_sr"].values
    extra = sorted(
        (name for name in dataset.data_vars if str(name).startswith("extra_")),
        key=lambda name: int(name.split("_")[1]),
    )
    return GonioData(
        **fields,
        extra={dataset[name].attrs["column"]: dataset[name].values for name in extra},
        source=dataset.attrs["source"],
        notes=tuple(json.loads(dataset.attrs["notes"])),
        attrs=json.loads(dataset.attrs["attrs"]),
    )


def write_netcdf(data: GonioData, path):
    """Write the measurement to a netCDF 4 file, whole or not at all.

    Parameters
    ----------
    data
        The measurement.
    path
        The file, suffix .nc; one that exists is replaced.

    Raises
    ------
    InputRefusedError
        The suffix is another, the folder does not exist, or it cannot be written to.
    """
    write_dataset(to_dataset(data), path)


def read_netcdf(path) -> GonioData:
    """Read a measurement that ``write_netcdf`` wrote.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    GonioData
        Equal to what was written, to the last bit.

    Raises
    ------
    InputRefusedError
        The file is missing, no netCDF file, or not of this schema.
    """
    path = Path(path)
    require_readable(path, MOST_BYTES, "measurement file")
    return from_dataset(read_dataset(path), str(path))
