"""Lossless conversion between the fields of a measurement and an xarray Dataset."""

import json
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.decoding import decode, json_of
from jaxink.files.netcdf import Schema, Variable, described, values_of
from jaxink.measurement.masks import MASK_FLAGS

if TYPE_CHECKING:
    import xarray

MOST_BYTES = 1_000_000_000
_POINT = ("point",)
_SCHEMA = Schema(
    "jaxink.measurement",
    1,
    "a jaxink measurement",
    "phi_deg 180 is the half-plane of the specular direction in reflection and of the undeviated beam "
    "in transmission, 0 the half-plane of the source; is_transmission is 0 in reflection, 1 in "
    "transmission; row counts the lines of the source file from 1; a point with mask 0 is used.",
)
_COORDINATES = tuple(
    Variable(name, _POINT, units, meaning, name)
    for name, units, meaning in (
        ("theta_i_deg", "degree", "polar angle of incidence from the outward normal"),
        ("theta_o_deg", "degree", "polar angle of view from the outward normal of the side of exit"),
        ("phi_deg", "degree", "azimuth of the outgoing direction minus that towards the source"),
        ("wavelength_nm", "nm", "wavelength in vacuum"),
    )
)
_SIGMA = "sigma_per_sr"
_VALUES = (
    Variable("bsdf_per_sr", _POINT, "sr-1", "radiance over irradiance, cosine not included", "bsdf_per_sr"),
    Variable(_SIGMA, _POINT, "sr-1", "standard deviation of bsdf_per_sr", _SIGMA),
)
# Required variables, with the kinds of their types.
_NEEDED = {v.name: "f" for v in (*_COORDINATES, _VALUES[0])}
_NEEDED |= {"is_transmission": "iub", "row": "iu", "mask": "iu"}


def dataset_of(data: Any) -> "xarray.Dataset":
    """The Dataset of a `GonioData`, see `GonioData.to_dataset`."""
    import xarray

    def variable(values, **attrs):
        return (_POINT, values.copy(), attrs)

    coordinates = described(data, _COORDINATES)
    coordinates["is_transmission"] = variable(
        data.is_transmission.astype(np.int8),
        long_name="side of exit",
        flag_values=np.array([0, 1], np.int8),
        flag_meanings="reflection transmission",
    )
    coordinates["row"] = variable(data.row, long_name="row of the source file")
    variables = described(data, _VALUES)
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
    texts = {"notes": json.dumps(data.notes), "attrs": json.dumps(dict(data.attrs))}
    return xarray.Dataset(variables, coordinates, {**_SCHEMA.attrs, "source": data.source, **texts})


def fields_of(dataset: "xarray.Dataset", called: str) -> dict[str, Any]:
    """Fields of a `GonioData`; arguments and errors as for `GonioData.from_dataset`."""
    _SCHEMA.require(dataset, called)
    names = _NEEDED | ({_SIGMA: "f"} if _SIGMA in dataset.variables else {})
    columns = {name: values_of(dataset, name, _POINT, called, kinds) for name, kinds in names.items()}
    return columns | {
        "extra": _extra(dataset, called),
        "source": _attribute(dataset.attrs, "source", str, called),
        "notes": _json_attribute(dataset.attrs, "notes", tuple[str, ...], called),
        "attrs": _json_attribute(dataset.attrs, "attrs", dict[str, str | int | float], called),
    }


def _extra(dataset: "xarray.Dataset", called: str) -> dict[str, np.ndarray]:
    """Extra columns in their original order, by their original names."""
    numbered = [(re.match(r"extra_(\d{1,6})_", name), name) for name in map(str, dataset.data_vars)]
    ordered = sorted((int(found[1]), name) for found, name in numbered if found)
    return {
        _attribute(dataset[name].attrs, "column", str, called): values_of(
            dataset, name, _POINT, called, "fiubOUST"
        )
        for _, name in ordered
    }


def _attribute(attrs: Mapping[str, Any], name: str, kind: Any, called: str):
    if name not in attrs:
        raise InputRefusedError(f"{called}: attribute {name} is missing.")
    return decode(kind, attrs[name], f"{called}: attribute {name}")


def _json_attribute(attrs: Mapping[str, Any], name: str, kind: Any, called: str):
    text = _attribute(attrs, name, str, called)
    return decode(kind, json_of(text, f"{called}: attribute {name}"), f"{called}: attribute {name}")
