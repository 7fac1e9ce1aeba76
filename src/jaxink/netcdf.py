"""Datasets as netCDF 4 files, written whole or not at all."""

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from jaxink.errors import InputRefusedError

if TYPE_CHECKING:
    import xarray


def write_dataset(dataset: "xarray.Dataset", path: str | Path) -> Path:
    """Write a Dataset, without fill values: NaN is a value like any other.

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
    encoding = {name: {"_FillValue": None} for name in dataset.variables}
    try:
        # Beside the target, so that the final step is a rename within one file system.
        with tempfile.TemporaryDirectory(prefix=".jaxink-", dir=path.parent) as folder:
            part = Path(folder) / path.name
            dataset.to_netcdf(part, engine="h5netcdf", encoding=encoding)
            os.replace(part, path)
    except OSError as problem:
        raise InputRefusedError(
            f"{path}: cannot be written ({problem.strerror or problem}); choose another folder."
        ) from problem
    return path


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
