"""Tables of an ink as xarray Datasets and netCDF files, and exactly back."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.netcdf import netcdf_bytes, read_dataset, write_dataset
from jaxink.files.reading import require_readable
from jaxink.ink.lobes import FacetLobes
from jaxink.ink.table import COMPONENTS, InkTable

if TYPE_CHECKING:
    import xarray

SCHEMA = "jaxink.ink_table"
SCHEMA_VERSION = 1
_MOST_BYTES = 10_000_000_000
CONVENTIONS = (
    "BSDF = radiance over irradiance, cosine not included, without the regular part. I is the inside of the "
    "plate, A the other side; the first letter after R or T is the side that light comes from, the second "
    "the side that it leaves to. theta_i and theta_o are measured from the normal in the medium of their own "
    "side. phi is the azimuth of the outgoing direction minus that towards the source: 180 is the half-plane "
    "of the specular or refracted direction, 0 that of the source, and 180 to 360 mirrors 0 to 180. "
    "Reciprocity: R(i, o) = R(o, i), T_IA(i, o) / index_outside^2 = T_AI(o, i) / index_inside^2. regular is "
    "the share of power that leaves in the specular or refracted direction. The values at 90 degrees are "
    "those at grazing_theta_deg, where it is given. facet_*, where present: lobes of light that meets one "
    "facet of a rough face and is regular else. They are part of bsdf_per_sr, but too narrow to be read "
    "between its entries: take them off, interpolate the rest, and put them on again by the formulas of "
    "microfacets (Walter et al. 2007, equations 20 and 21) with facet_passage in place of the masking."
)
_DIMS = ("component", "wavelength", "theta_i", "theta_o", "phi")
# Field, dimensions, units, meaning.
_VARIABLES = (
    ("bsdf_per_sr", _DIMS, "sr-1", "radiance over irradiance, cosine not included, regular part apart"),
    ("regular", _DIMS[:3], "1", "regular reflectance or transmittance, power"),
    ("index_inside", ("wavelength",), "1", "refractive index of side I"),
    ("index_outside", ("wavelength",), "1", "refractive index of side A"),
    (
        "bsdf_standard_error_per_sr",
        _DIMS,
        "sr-1",
        "one standard error of bsdf_per_sr by the fit's covariance",
    ),
    ("regular_standard_error", _DIMS[:3], "1", "one standard error of regular by the fit's covariance"),
)
_OPTIONAL = ("bsdf_standard_error_per_sr", "regular_standard_error")
# Field of the lobes, variable, dimensions, meaning.
_LOBES = (
    ("slope", "facet_slope", ("facet_slope",), "slope of facets, tangent of their angle"),
    (
        "radial_density",
        "facet_radial_density",
        ("face", "wavelength", "facet_slope"),
        "slope times density of slopes per area of the slope plane",
    ),
    (
        "face_index",
        "facet_index",
        ("side", "face", "wavelength"),
        "refractive index of the medium of a face towards side I and towards side A",
    ),
    (
        "passage",
        "facet_passage",
        ("side", "face", "wavelength", "theta_i"),
        "share of the light from a side that comes to a face regularly, times Smith's masking",
    ),
)
_COORDINATES = (
    ("wavelength", "wavelength_nm", "nm", "wavelength in vacuum"),
    ("theta_i", "theta_deg", "degree", "polar angle of incidence from the normal, in the medium it is in"),
    (
        "theta_o",
        "theta_deg",
        "degree",
        "polar angle of outgoing light from the normal, in the medium it is in",
    ),
    ("phi", "phi_deg", "degree", "azimuth of the outgoing direction minus that towards the source"),
)


def to_dataset(table: InkTable) -> "xarray.Dataset":
    """The table as an xarray Dataset.

    Parameters
    ----------
    table
        The table.

    Returns
    -------
    xarray.Dataset
        Dimensions component, wavelength, theta_i, theta_o, phi.
    """
    import xarray

    coordinates = {
        name: (name, getattr(table, field).copy(), {"units": units, "long_name": meaning})
        for name, field, units, meaning in _COORDINATES
    }
    coordinates["component"] = (
        "component",
        np.array(COMPONENTS, object),
        {"long_name": "R or T, side that light comes from, side it leaves to (I inside, A other side)"},
    )
    variables = {
        name: (dims, getattr(table, name).copy(), {"units": units, "long_name": meaning})
        for name, dims, units, meaning in _VARIABLES
        if getattr(table, name) is not None
    }
    if table.lobes is not None:
        coordinates["side"] = ("side", np.array(("I", "A"), object), {"long_name": "side of the ink"})
        variables |= {
            variable: (dims, getattr(table.lobes, field).copy(), {"units": "1", "long_name": meaning})
            for field, variable, dims, meaning in _LOBES
        }
    attrs = {**table.attrs, "schema": SCHEMA, "schema_version": SCHEMA_VERSION, "conventions": CONVENTIONS}
    return xarray.Dataset(variables, coordinates, attrs)


def from_dataset(dataset: "xarray.Dataset", source: str = "the Dataset") -> InkTable:
    """The table of a Dataset that `to_dataset` made.

    Parameters
    ----------
    dataset
        The Dataset.
    source
        How to call it in an error.

    Raises
    ------
    InputRefusedError
        If it is not of this schema or lacks a variable.
    """
    if dataset.attrs.get("schema") != SCHEMA:
        raise InputRefusedError(f"{source}: is not an ink table: attribute schema must be {SCHEMA}.")
    version = int(dataset.attrs.get("schema_version", 0))
    if version != SCHEMA_VERSION:
        raise InputRefusedError(
            f"{source}: has schema_version {version}; this jaxink reads tables of version {SCHEMA_VERSION}."
        )
    needed = [row[0] for row in (*_COORDINATES, *_VARIABLES)] + ["component"]
    for name in needed:
        if name not in dataset.variables and name not in _OPTIONAL:
            raise InputRefusedError(f"{source}: variable {name} is missing; write the table anew.")
    if tuple(dataset["component"].values) != COMPONENTS:
        raise InputRefusedError(f"{source}: component must be {', '.join(COMPONENTS)}, in this order.")
    if not np.array_equal(dataset["theta_i"], dataset["theta_o"]):
        raise InputRefusedError(f"{source}: theta_i and theta_o differ; an ink table has the same of both.")
    fields = {field: dataset[name].values for name, field, _, _ in _COORDINATES}
    for name, dims, _, _ in _VARIABLES:
        if name in dataset.variables:
            if set(dataset[name].dims) != set(dims):
                raise InputRefusedError(f"{source}: {name} must have the dimensions {', '.join(dims)}.")
            fields[name] = dataset[name].transpose(*dims).values
    if "facet_slope" in dataset.variables:
        fields["lobes"] = _lobes(dataset, fields, source)
    attrs = {
        key: value.item() if isinstance(value, np.generic) else value
        for key, value in dataset.attrs.items()
        if key not in ("schema", "schema_version", "conventions")
    }
    return InkTable(**fields, attrs=attrs)


def _lobes(dataset: "xarray.Dataset", fields: dict, source: str) -> FacetLobes:
    """Lobes of a Dataset that has some."""
    found = {}
    for field, variable, dims, _ in _LOBES:
        if variable not in dataset.variables:
            raise InputRefusedError(f"{source}: variable {variable} is missing; write the table anew.")
        if set(dataset[variable].dims) != set(dims):
            raise InputRefusedError(f"{source}: {variable} must have the dimensions {', '.join(dims)}.")
        found[field] = dataset[variable].transpose(*dims).values
    index = np.stack([fields["index_inside"], fields["index_outside"]])
    grazing = float(dataset.attrs.get("grazing_theta_deg", 90.0))
    return FacetLobes(theta_deg=fields["theta_deg"], index=index, grazing_theta_deg=grazing, **found)


def write_netcdf(table: InkTable, path: str | Path) -> Path:
    """Write a table to a netCDF 4 file, whole or not at all.

    Parameters
    ----------
    table
        The table.
    path
        The file, suffix .nc; one that exists is replaced.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InputRefusedError
        If the suffix is another or the folder cannot be written to.
    """
    return write_dataset(to_dataset(table), path)


def table_bytes(table: InkTable) -> memoryview:
    """Content of the file that `write_netcdf` writes."""
    return netcdf_bytes(to_dataset(table))


def read_ink_table(path: str | Path) -> InkTable:
    """Read a table that `InkTable.to_netcdf` wrote.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    InkTable
        Equal to what was written, to the last bit.

    Raises
    ------
    InputRefusedError
        If it is missing, no netCDF file, or not an ink table.
    """
    path = Path(path)
    require_readable(path, _MOST_BYTES, "ink table")
    return from_dataset(read_dataset(path), str(path))
