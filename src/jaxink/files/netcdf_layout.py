"""A Dataset as HDF5 in the layout of netCDF 4.

Written with h5py alone, in 2 to 3 ms for a dozen short variables: the general way through xarray and
h5netcdf takes 20 ms, a fifth of the time of a short fit. It is for what jaxink's schemas declare: numbers and
text along dimensions of a fixed size, without fill values, compression or groups.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray

# As the netCDF library names the scale of a dimension that has no values of its own.
_NO_VALUES = "This is a netCDF dimension but not a netCDF variable."


def hdf5_bytes(dataset: "xarray.Dataset") -> bytes:
    """A Dataset as the bytes of a file.

    Source: NetCDF-4 file format, https://docs.unidata.ucar.edu/netcdf-c/current/file_format_specifications.html
    """
    import h5py
    from xarray.conventions import encode_dataset_coordinates

    variables, attributes = encode_dataset_coordinates(dataset)
    with h5py.File("memory", "w", driver="core", backing_store=False, track_order=True) as file:
        _describe(file, attributes)
        for number, (dimension, size) in enumerate(dataset.sizes.items()):
            if dimension in variables:
                scale, called = _create(file, dimension, variables[dimension]), str(dimension)
            else:
                scale, called = file.create_dataset(dimension, (size,), ">f4"), f"{_NO_VALUES}{size:10d}"
            scale.make_scale(called)
            scale.attrs["_Netcdf4Dimid"] = np.int32(number)
        for name, variable in variables.items():
            if name not in dataset.sizes:
                written = _create(file, name, variable)
                for axis, dimension in enumerate(variable.dims):
                    written.dims[axis].attach_scale(file[dimension])
        file.flush()
        return file.id.get_file_image()


def _create(file: Any, name: Any, variable: "xarray.Variable") -> Any:
    import h5py

    values = variable.values
    kind = h5py.string_dtype() if values.dtype.kind in "OU" else values.dtype
    written = file.create_dataset(name, data=values.astype(kind), track_order=True)
    _describe(written, variable.attrs)
    return written


def _describe(written: Any, attributes: Any) -> None:
    for key, value in attributes.items():
        written.attrs[key] = value if isinstance(value, str) else np.atleast_1d(value)
