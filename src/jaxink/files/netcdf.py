"""Datasets as netCDF 4 files with a declared schema, written completely or not at all.

A Dataset as HDF5 in the layout of netCDF 4.

Written with h5py alone, in 2 to 3 ms for a dozen short variables: the general way through xarray and
h5netcdf takes 20 ms, a fifth of the time of a short fit. It is for what jaxink's schemas declare: numbers and
text along dimensions of a fixed size, without fill values, compression or groups.
"""

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from io import BytesIO
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded, shown_path
from jaxink.files.writing import written_whole

if TYPE_CHECKING:
    import h5py
    import xarray


_LARGEST_BYTES = 4_000_000_000
# Largest ratio of unpacked to file size: jaxink does not compress, but other programs may.
_MOST_PACKED = 100
_ALWAYS_ALLOWED_BYTES = 16_000_000
# jaxink writes a dozen variables, and one for each further column of a measurement.
_MOST_VARIABLES = 10_000
_NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"
_CHECKSUM = b"jaxink sha256 "
# As the netCDF library names the scale of a dimension that has no values of its own.
_NO_VALUES = "This is a netCDF dimension but not a netCDF variable."


class Variable(NamedTuple):
    """A variable of a file, and the field of the object that holds its values."""

    name: str
    dims: tuple[str, ...]
    units: str
    meaning: str
    field: str


@dataclass(frozen=True)
class Schema:
    """A kind of file, as declared in the attributes of its Dataset.

    Parameters
    ----------
    name, version
        Those that jaxink writes, and the only ones that it reads.
    what
        Name of the kind in messages.
    conventions
        What readers without jaxink need to know.
    """

    name: str
    version: int
    what: str
    conventions: str

    @property
    def attrs(self) -> dict[str, Any]:
        """Attributes of a Dataset."""
        return {"schema": self.name, "schema_version": self.version, "conventions": self.conventions}

    def require(self, dataset: "xarray.Dataset", called: str) -> None:
        """Reject a Dataset, ``called`` so in messages, of another schema or version."""
        if str(dataset.attrs.get("schema")) != self.name:
            raise InputRefusedError(f"{called}: is not {self.what}; attribute schema must be {self.name}.")
        version = dataset.attrs.get("schema_version")
        if not isinstance(version, Integral) or version != self.version:
            raise InputRefusedError(
                f"{called}: has schema_version {version}; this version of jaxink reads {self.version}."
            )


def described(holder: Any, variables: Iterable[Variable]) -> dict[str, tuple]:
    """Copies of an object's fields as variables of a Dataset; fields that are None are omitted."""
    return {
        v.name: (v.dims, getattr(holder, v.field).copy(), {"units": v.units, "long_name": v.meaning})
        for v in variables
        if getattr(holder, v.field) is not None
    }


def values_of(
    dataset: "xarray.Dataset", name: str, dims: tuple[str, ...], called: str, kinds: str = "f"
) -> np.ndarray:
    """Values of a variable of a Dataset from an unknown source, axes in the order of ``dims``.

    Parameters
    ----------
    dataset
        The Dataset.
    name, dims
        Name and dimensions of the variable.
    called
        Name of the Dataset in messages.
    kinds
        Allowed kinds of numpy types.

    Raises
    ------
    InputRefusedError
        If the variable is missing, or has other dimensions or another type.
    """
    if name not in dataset.variables:
        raise InputRefusedError(f"{called}: variable {name} is missing; write the file again.")
    variable = dataset[name]
    if set(variable.dims) != set(dims):
        raise InputRefusedError(f"{called}: variable {name} must have the dimensions {', '.join(dims)}.")
    if variable.dtype.kind not in kinds:
        raise InputRefusedError(
            f"{called}: variable {name} has the wrong type {variable.dtype}; write the file again."
        )
    return variable.transpose(*dims).values


def write_dataset(dataset: "xarray.Dataset", path: str | Path) -> Path:
    """Write a Dataset to a file with the suffix .nc, replacing an existing one; see `netcdf_bytes`.

    Raises
    ------
    InputRefusedError
        If the suffix is wrong, the folder does not exist, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix != ".nc":
        raise InputRefusedError(f"{path}: a netCDF file must have the suffix .nc.")
    with written_whole(path) as part:
        part.write_bytes(netcdf_bytes(dataset))
    return path


def netcdf_bytes(dataset: "xarray.Dataset") -> bytes:
    """A Dataset as the bytes of a netCDF 4 file, without fill values: NaN is a value like any other.

    HDF5 never writes to the disk itself: on a full disk it could not close its files and would end the
    process. Since some corrupted files make it hang, a checksum is appended after the content, which HDF5
    readers ignore.
    """
    content = hdf5_bytes(dataset)
    return content + _checksum(memoryview(content))


def read_dataset(
    path: Path, largest_bytes: int = _LARGEST_BYTES, what: str = "netCDF file"
) -> "xarray.Dataset":
    """Read a Dataset into memory.

    Parameters
    ----------
    path
        The file.
    largest_bytes, what
        Largest size allowed, and the expected kind of file, for messages.

    Raises
    ------
    InputRefusedError
        If the file is missing, not regular, not netCDF 4, damaged, or claims far more data than it has.
    """
    import xarray

    content, name = read_bounded(path, largest_bytes, what), shown_path(path)
    try:
        _require_unchanged(content, name)
        _require_held(content, name)
        with xarray.open_dataset(BytesIO(content), engine="h5netcdf", phony_dims="access") as opened:
            loaded = opened.load()
        # A damaged list of dimensions can be shorter than the axes, which xarray finds only when it is used.
        if any(len(variable.dims) != len(variable.shape) for variable in loaded.variables.values()):
            raise ValueError("a variable has more axes than dimensions")
        return loaded
    except InputRefusedError:
        raise
    # The libraries raise all sorts of exceptions for corrupted files.
    except Exception as problem:
        raise InputRefusedError(f"{name}: is not a readable netCDF 4 file.") from problem


def _checksum(content: memoryview) -> bytes:
    return _CHECKSUM + hashlib.sha256(content).hexdigest().encode()


def _require_unchanged(content: bytes, name: str) -> None:
    """Reject a file with a wrong checksum; files that another library has rewritten have none."""
    end = len(_checksum(memoryview(b"")))
    view = memoryview(content)
    if view[-end:].tobytes().startswith(_CHECKSUM) and view[-end:] != _checksum(view[:-end]):
        raise InputRefusedError(
            f"{name}: is damaged (its checksum does not match its content); use another copy."
        )


def _require_held(content: bytes, name: str) -> None:
    """Reject a file that has not all values of its variables inside, or claims far more than it can hold.

    HDF5 would fetch values from any file of this machine that the content names, and put zeros in place of
    those that it does not find. Only the top level is looked at, because jaxink has no groups there: to walk
    through thousands of them, one in the other, takes minutes.
    """
    import h5py

    with h5py.File(BytesIO(content), "r") as file:
        variables = _variables(file, name)
        claimed, held = sum(map(_bytes_to_read, variables.values())), len(content)
        if claimed > _MOST_PACKED * held + _ALWAYS_ALLOWED_BYTES:
            raise InputRefusedError(
                f"{name}: its variables claim {claimed / 1e6:,.0f} MB, but the file has {held / 1e6:.3g} MB; "
                "it is damaged or was not written by jaxink."
            )
        for called, variable in variables.items():
            _require_complete(variable, called)


def _variables(file: "h5py.File", name: str) -> dict[str, "h5py.Dataset"]:
    """Variables of a file, by what messages call them."""
    import h5py

    if len(file) > _MOST_VARIABLES:
        raise InputRefusedError(
            f"{name}: has {len(file)} variables; jaxink reads files with at most {_MOST_VARIABLES}."
        )
    variables = {}
    for key in file:
        called = f"{name}: {shown_path(key)}"
        if not isinstance(file.get(key, getlink=True), h5py.HardLink):
            raise InputRefusedError(f"{called} is a link to another place; write the values in its stead.")
        if file.get(key, getclass=True) is not h5py.Dataset:
            raise InputRefusedError(f"{called} is a group or a type; jaxink reads files of variables alone.")
        variables[called] = file[key]
    return variables


def _bytes_to_read(variable: "h5py.Dataset") -> int:
    # To read one value of a chunk, all of it is unpacked.
    return max(variable.size, math.prod(variable.chunks or ())) * variable.dtype.itemsize


def _require_complete(variable: "h5py.Dataset", called: str) -> None:
    """Reject a variable whose values are in other files or nowhere."""
    import h5py

    if variable.external or variable.is_virtual:
        raise InputRefusedError(
            f"{called} has its values in other files, which jaxink does not open; write them into this one."
        )
    if variable.is_scale and h5py.h5ds.get_scale_name(variable.id).startswith(_NO_VARIABLE):
        return
    is_complete = variable.id.get_storage_size() > 0
    if variable.chunks:
        needed = math.prod(-(-n // c) for n, c in zip(variable.shape, variable.chunks, strict=True))
        is_complete = variable.id.get_num_chunks() == needed
    if variable.size and not is_complete:
        raise InputRefusedError(f"{called} has no values in a part of the file; write the file again.")


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
