"""Datasets as netCDF 4 files of a stated schema, written whole or not at all."""

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from io import SEEK_END, BytesIO
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded, shown_path
from jaxink.files.writing import written_whole

if TYPE_CHECKING:
    import xarray

_LARGEST_BYTES = 4_000_000_000
# What jaxink writes is not compressed; others may have done so.
_MOST_PACKED = 100
_ALWAYS_ALLOWED_BYTES = 16_000_000
_CHECKSUM = b"jaxink sha256 "


class Variable(NamedTuple):
    """A variable of a file, and the field of an object whose values it holds."""

    name: str
    dims: tuple[str, ...]
    units: str
    meaning: str
    field: str


@dataclass(frozen=True)
class Schema:
    """A kind of file, as the attributes of its Dataset state it.

    Parameters
    ----------
    name, version
        Which jaxink writes, and the only ones that it reads.
    what
        How a sentence calls it.
    conventions
        What a reader without jaxink has to know.
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
        """Refuse a Dataset of another schema or version.

        Parameters
        ----------
        dataset
            The Dataset.
        called
            How to call it in the sentence.

        Raises
        ------
        InputRefusedError
            With what jaxink reads.
        """
        if str(dataset.attrs.get("schema")) != self.name:
            raise InputRefusedError(f"{called}: is not {self.what}: attribute schema must be {self.name}.")
        version = dataset.attrs.get("schema_version")
        if not isinstance(version, Integral) or version != self.version:
            raise InputRefusedError(
                f"{called}: has schema_version {version}; this jaxink reads version {self.version}."
            )


def described(holder: Any, variables: Iterable[Variable]) -> dict[str, tuple]:
    """Copies of an object's fields as variables of a Dataset; fields that are None are left out.

    Parameters
    ----------
    holder
        The object.
    variables
        What to take from it.
    """
    return {
        v.name: (v.dims, getattr(holder, v.field).copy(), {"units": v.units, "long_name": v.meaning})
        for v in variables
        if getattr(holder, v.field) is not None
    }


def values_of(
    dataset: "xarray.Dataset", name: str, dims: tuple[str, ...], called: str, kinds: str = "f"
) -> np.ndarray:
    """Values of a variable of a Dataset that somebody else may have made.

    Parameters
    ----------
    dataset
        The Dataset.
    name, dims
        Of the variable.
    called
        How to call the Dataset in an error.
    kinds
        Kinds of numpy types that it may have.

    Returns
    -------
    np.ndarray
        Axes in the order of ``dims``.

    Raises
    ------
    InputRefusedError
        If there is no such variable, or it is of other dimensions or of another type.
    """
    if name not in dataset.variables:
        raise InputRefusedError(f"{called}: variable {name} is missing; write the file anew.")
    variable = dataset[name]
    if set(variable.dims) != set(dims):
        raise InputRefusedError(f"{called}: variable {name} must have the dimensions {', '.join(dims)}.")
    if variable.dtype.kind not in kinds:
        raise InputRefusedError(
            f"{called}: variable {name} is of type {variable.dtype}; that is not what it holds."
        )
    return variable.transpose(*dims).values


def write_dataset(dataset: "xarray.Dataset", path: str | Path) -> Path:
    """Write a Dataset, see `netcdf_bytes`.

    Parameters
    ----------
    dataset
        The Dataset.
    path
        The file, suffix .nc; one that exists is replaced.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InputRefusedError
        If the suffix is another, the folder does not exist, or it cannot be written to.
    """
    path = Path(path)
    if path.suffix != ".nc":
        raise InputRefusedError(f"{path}: a netCDF file needs the suffix .nc.")
    with written_whole(path) as part:
        part.write_bytes(netcdf_bytes(dataset))
    return path


def netcdf_bytes(dataset: "xarray.Dataset") -> memoryview:
    """A Dataset as the bytes of a netCDF 4 file, without fill values: NaN is a value like any other.

    HDF5 never meets the disk: one that is full would leave it with files that it cannot close, and end the
    process. Nor shall it meet bytes that were changed, with some of which it never ends: behind the content,
    where no reader of HDF5 looks, stands a checksum.
    """
    content = BytesIO()
    encoding = {name: {"_FillValue": None} for name in dataset.variables}
    dataset.to_netcdf(content, engine="h5netcdf", encoding=encoding)
    checksum = _checksum(content.getbuffer())
    content.seek(0, SEEK_END)
    content.write(checksum)
    return content.getbuffer()


def read_dataset(
    path: Path, largest_bytes: int = _LARGEST_BYTES, what: str = "netCDF file"
) -> "xarray.Dataset":
    """Read a Dataset into memory.

    Parameters
    ----------
    path
        The file.
    largest_bytes, what
        The largest that it may be, and what it should be.

    Raises
    ------
    InputRefusedError
        If it is missing, no ordinary file, no netCDF 4 file, damaged, or claims far more data than it holds.
    """
    import xarray

    content, name = BytesIO(read_bounded(path, largest_bytes, what)), shown_path(path)
    try:
        _require_unchanged(content, name)
        _require_held(content, name)
        with xarray.open_dataset(content, engine="h5netcdf") as opened:
            return opened.load()
    except InputRefusedError:
        raise
    # Where bytes of a file are wrong, the libraries that read it raise whatever they stumble upon.
    except Exception as problem:
        raise InputRefusedError(f"{name}: is not a readable netCDF 4 file.") from problem


def _checksum(content: memoryview) -> bytes:
    return _CHECKSUM + hashlib.sha256(content).hexdigest().encode()


def _require_unchanged(content: BytesIO, name: str) -> None:
    """Refuse a file whose checksum is another; who changes a file by a library leaves none."""
    end = len(_checksum(memoryview(b"")))
    view = content.getbuffer()
    if view[-end:].tobytes().startswith(_CHECKSUM) and view[-end:] != _checksum(view[:-end]):
        raise InputRefusedError(
            f"{name}: is damaged: its checksum is not that of its content; take another copy of it."
        )


def _require_held(content: BytesIO, name: str) -> None:
    """Refuse a file whose variables claim what would not fit into memory."""
    import h5py

    held = content.getbuffer().nbytes
    claimed = 0

    def add(_, item) -> None:
        nonlocal claimed
        if isinstance(item, h5py.Dataset):
            claimed += item.size * item.dtype.itemsize

    with h5py.File(content, "r") as file:
        file.visititems(add)
    if claimed > _MOST_PACKED * held + _ALWAYS_ALLOWED_BYTES:
        raise InputRefusedError(
            f"{name}: its variables claim {claimed / 1e6:,.0f} MB, but the file has {held / 1e6:.3g} MB; it "
            "is damaged, or not of jaxink."
        )
