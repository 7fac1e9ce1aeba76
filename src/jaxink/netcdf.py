"""Datasets as netCDF 4 files, written whole or not at all."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from jaxink.errors import InputRefusedError
from jaxink.output import written_whole

if TYPE_CHECKING:
    import xarray


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
    if not path.parent.is_dir():
        raise InputRefusedError(f"{path}: the folder does not exist; create it first.")
    try:
        with written_whole(path) as part:
            part.write_bytes(netcdf_bytes(dataset))
    except OSError as problem:
        raise InputRefusedError(
            f"{path}: cannot be written ({problem.strerror or problem}); choose another folder."
        ) from None
    return path


def netcdf_bytes(dataset: "xarray.Dataset") -> memoryview:
    """A Dataset as the bytes of a netCDF 4 file, without fill values: NaN is a value like any other.

    HDF5 never meets the disk: one that is full would leave it with files that it cannot close, and end the
    process.

    Parameters
    ----------
    dataset
        The Dataset.

    Returns
    -------
    memoryview
    """
    content = BytesIO()
    encoding = {name: {"_FillValue": None} for name in dataset.variables}
    dataset.to_netcdf(content, engine="h5netcdf", encoding=encoding)
    return content.getbuffer()


def read_dataset(path: Path) -> "xarray.Dataset":
    """Read a Dataset into memory.

    Parameters
    ----------
    path
        An existing file.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    InputRefusedError
        If it is no netCDF 4 file.
    """
    import xarray

    try:
        with xarray.open_dataset(path, engine="h5netcdf") as opened:
            return opened.load()
    except (OSError, ValueError) as problem:
        raise InputRefusedError(f"{path}: is not a readable netCDF 4 file.") from problem
