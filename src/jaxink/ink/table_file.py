"""Conversion between an ink table and an xarray Dataset, without loss."""

from typing import TYPE_CHECKING, Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.netcdf import Schema, Variable, described, values_of
from jaxink.ink.lobes import COMPONENTS, FacetLobes

if TYPE_CHECKING:
    import xarray

_SCHEMA = Schema(
    "jaxink.ink_table",
    1,
    "an ink table",
    "BSDF = radiance over irradiance, cosine not included, without the regular part. I is the inside of the "
    "plate, A the other side; the first letter after R or T is the side that light comes from, the second "
    "the side that it leaves to. theta_i and theta_o are measured from the normal in the medium of their own "
    "side. phi is the azimuth of the outgoing direction minus that towards the source: 180 is the half-plane "
    "of the specular or refracted direction, 0 that of the source, and 180 to 360 mirrors 0 to 180. "
    "Reciprocity: R(i, o) = R(o, i), T_IA(i, o) / index_outside^2 = T_AI(o, i) / index_inside^2. regular is "
    "the share of power that leaves in the specular or refracted direction. The values at 90 degrees are "
    "those at grazing_theta_deg, if it is given. facet_*, if present: lobes of light that meets one facet of "
    "a rough face and is otherwise regular. They are included in bsdf_per_sr but too narrow for "
    "interpolation: subtract them, interpolate the rest, and add them again, using the microfacet formulas "
    "(Walter et al. 2007, equations 20 and 21) with facet_passage in place of the masking.",
)
_DIMS = ("component", "wavelength", "theta_i", "theta_o", "phi")
_VARIABLES = tuple(
    Variable(name, dims, units, meaning, name)
    for name, dims, units, meaning in (
        ("bsdf_per_sr", _DIMS, "sr-1", "radiance over irradiance, without cosine and regular part"),
        ("regular", _DIMS[:3], "1", "regular reflectance or transmittance"),
        ("index_inside", ("wavelength",), "1", "refractive index of side I"),
        ("index_outside", ("wavelength",), "1", "refractive index of side A"),
        ("bsdf_standard_error_per_sr", _DIMS, "sr-1", "standard error of bsdf_per_sr from the fit"),
        ("regular_standard_error", _DIMS[:3], "1", "standard error of regular from the fit"),
    )
)
_OPTIONAL = ("bsdf_standard_error_per_sr", "regular_standard_error")
_LOBES = tuple(
    Variable(name, dims, "1", meaning, field)
    for field, name, dims, meaning in (
        ("slope", "facet_slope", ("facet_slope",), "slope of facets"),
        (
            "radial_density",
            "facet_radial_density",
            ("face", "wavelength", "facet_slope"),
            "slope times slope density per area of the slope plane",
        ),
        (
            "face_index",
            "facet_index",
            ("side", "face", "wavelength"),
            "refractive index next to a face, towards side I and towards side A",
        ),
        (
            "passage",
            "facet_passage",
            ("side", "face", "wavelength", "theta_i"),
            "share of the light from a side that reaches a face regularly, times Smith's masking",
        ),
    )
)
_COORDINATES = tuple(
    Variable(name, (name,), units, meaning, field)
    for name, field, units, meaning in (
        ("wavelength", "wavelength_nm", "nm", "wavelength in vacuum"),
        ("theta_i", "theta_deg", "degree", "polar angle of incidence in the medium of the side of incidence"),
        ("theta_o", "theta_deg", "degree", "polar angle of outgoing light in the medium of the exit side"),
        ("phi", "phi_deg", "degree", "azimuth of the outgoing direction minus that towards the source"),
    )
)


def dataset_of(table: Any) -> "xarray.Dataset":
    """The Dataset of an `InkTable`, see `InkTable.to_dataset`."""
    import xarray

    coordinates = described(table, _COORDINATES)
    coordinates["component"] = (
        "component",
        np.array(COMPONENTS, object),
        {"long_name": "R or T, side that light comes from, side that it leaves to (I inside, A other)"},
    )
    variables = described(table, _VARIABLES)
    if table.lobes is not None:
        coordinates["side"] = ("side", np.array(("I", "A"), object), {"long_name": "side of the ink"})
        variables |= described(table.lobes, _LOBES)
    return xarray.Dataset(variables, coordinates, {**table.attrs, **_SCHEMA.attrs})


def fields_of(dataset: "xarray.Dataset", called: str) -> dict[str, Any]:
    """Fields of an `InkTable`; parameters and exceptions as for `InkTable.from_dataset`."""
    _SCHEMA.require(dataset, called)

    def read(variables: tuple[Variable, ...]) -> dict[str, np.ndarray]:
        return {
            v.field: values_of(dataset, v.name, v.dims, called, "fiu")
            for v in variables
            if v.name in dataset.variables or v.name not in _OPTIONAL
        }

    fields: dict[str, Any] = read((*_COORDINATES, *_VARIABLES))
    if tuple(values_of(dataset, "component", ("component",), called, "OUT")) != COMPONENTS:
        raise InputRefusedError(f"{called}: component must be {', '.join(COMPONENTS)}, in this order.")
    if not np.array_equal(dataset["theta_i"], dataset["theta_o"]):
        raise InputRefusedError(f"{called}: theta_i and theta_o differ; they must be equal in an ink table.")
    if _LOBES[0].name in dataset.variables:
        fields["lobes"] = FacetLobes(
            theta_deg=fields["theta_deg"],
            index=np.stack([fields["index_inside"], fields["index_outside"]]),
            grazing_theta_deg=float(dataset.attrs.get("grazing_theta_deg", 90.0)),
            **read(_LOBES),
        )
    fields["attrs"] = {
        key: value.item() if isinstance(value, np.generic) else value
        for key, value in dataset.attrs.items()
        if key not in _SCHEMA.attrs
    }
    return fields
