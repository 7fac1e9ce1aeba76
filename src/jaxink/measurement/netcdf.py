"""Measurements as xarray Datasets and netCDF files, and exactly back."""

import json
import re
from numbers import Integral
from pathlib import Path

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.decoding import decode, json_of
from jaxink.files.netcdf import read_dataset, write_dataset
from jaxink.files.reading import require_readable
from jaxink.measurement.dataset import GonioData
from jaxink.measurement.masks import MASK_FLAGS
from jaxink.measurement.table import refusal

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
# Variables that there must be, with the kinds of their types.
_NEEDED = {name: "f" for name in (*_COORDINATES, "bsdf_per_sr")} | {
    "is_transmission": "iub",
    "row": "iu",
    "mask": "iu",
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

    Raises
    ------
    InputRefusedError
        The Dataset is not of this schema, of a later version, or lacks a variable.
    """
    called = source or "the Dataset"
    if str(dataset.attrs.get("schema")) != SCHEMA:
        raise refusal(called, f"is not a jaxink measurement: attribute schema must be {SCHEMA}")
    version = dataset.attrs.get("schema_version")
    if not isinstance(version, Integral) or version != SCHEMA_VERSION:
        text = f"has schema_version {version}; this jaxink reads version {SCHEMA_VERSION}"
        raise refusal(called, text)
    fields = {name: column_of(dataset, name, kinds, called) for name, kinds in _NEEDED.items()}
    if "sigma_per_sr" in dataset.variables:
        fields["sigma_per_sr"] = column_of(dataset, "sigma_per_sr", "f", called)
    try:
        return GonioData(
            **fields,
            extra=_extra(dataset, called),
            source=_attribute(dataset.attrs, "source", str, called),
            notes=_json_attribute(dataset.attrs, "notes", tuple[str, ...], called),
            attrs=_json_attribute(dataset.attrs, "attrs", dict[str, str | int | float], called),
        )
    except InputRefusedError as problem:
        # The measurement itself knows only the name of the file that it once came from.
        raise problem if called in str(problem) else InputRefusedError(f"{called}: {problem}") from None


def column_of(dataset, name: str, kinds: str, called: str) -> np.ndarray:
    """One value for each point, of a Dataset that somebody else may have made.

    Parameters
    ----------
    dataset
        The Dataset.
    name
        Of the variable.
    kinds
        Kinds of numpy types that it may have.
    called
        How to call the Dataset in an error.

    Returns
    -------
    np.ndarray
        Shape ``(points,)``.

    Raises
    ------
    InputRefusedError
        If there is no such variable, or it is of other dimensions or of another type.
    """
    if name not in dataset.variables:
        raise refusal(called, f"variable {name} is missing")
    variable = dataset[name]
    if variable.dims != ("point",):
        text = f"variable {name} has the dimensions {variable.dims}; it must have one value for each point"
        raise refusal(called, text)
    if variable.dtype.kind not in kinds:
        raise refusal(called, f"variable {name} is of type {variable.dtype}; that is not what it holds")
    return variable.values


def _extra(dataset, called: str) -> dict[str, np.ndarray]:
    """Kept columns in their order, by the names that they had."""
    numbered = [(re.match(r"extra_(\d{1,6})_", str(name)), name) for name in dataset.data_vars]
    ordered = sorted((int(found[1]), name) for found, name in numbered if found)
    return {
        _attribute(dataset[name].attrs, "column", str, called): column_of(dataset, name, "fiubOUST", called)
        for _, name in ordered
    }


def _attribute(attrs, name: str, kind, called: str):
    if name not in attrs:
        raise refusal(called, f"attribute {name} is missing")
    return decode(kind, attrs[name], f"{called}: attribute {name}")


def _json_attribute(attrs, name: str, kind, called: str):
    text = _attribute(attrs, name, str, called)
    return decode(kind, json_of(text, f"{called}: attribute {name}"), f"{called}: attribute {name}")


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
