"""What jaxink writes as netCDF is what xarray would write."""

from io import BytesIO

import h5py
import numpy as np
import xarray

from jaxink.files.netcdf import hdf5_bytes

DATASET = xarray.Dataset(
    {
        "value": (("kind", "point"), np.array([[1.5, np.nan], [-0.0, 5e-324]]), {"units": "sr-1"}),
        "mask": ("point", np.array([1, 33], np.uint32), {"flags": np.array([1, 2], np.uint32)}),
        "who": ("point", np.array(["Åsa", ""], object)),
        "alone": ((), 2.0),
    },
    {
        "kind": ("kind", np.array(["R", "T"], object), {"long_name": "side"}),
        "row": ("point", np.array([2, 3]), {"factor": 0.5}),
    },
    {"schema": "a test", "version": 3, "text": "", "list": [1.0, 2.0]},
)


def read(content):
    with xarray.open_dataset(BytesIO(content), engine="h5netcdf") as opened:
        return opened.load()


def test_it_reads_as_what_xarray_writes():
    theirs = BytesIO()
    DATASET.to_netcdf(theirs, engine="h5netcdf", encoding={n: {"_FillValue": None} for n in DATASET})
    mine, other = read(hdf5_bytes(DATASET)), read(theirs.getvalue())
    xarray.testing.assert_identical(mine, other)
    assert [mine[name].dtype for name in mine] == [other[name].dtype for name in other]
    assert np.signbit(mine["value"].values[1, 0])


def test_dimensions_are_scales_as_the_format_demands():
    with h5py.File(BytesIO(hdf5_bytes(DATASET))) as file:
        assert {name for name in file if file[name].is_scale} == {"kind", "point"}
        # A dimension without values of its own has a name that says so, and its size.
        assert file["point"].attrs["NAME"].decode().split()[-1] == "2"
        assert [file["value"].dims[axis].keys()[0] for axis in (0, 1)] == [
            "kind",
            file["point"].attrs["NAME"].decode(),
        ]
        assert {file[name].attrs["_Netcdf4Dimid"] for name in ("kind", "point")} == {0, 1}


def test_the_same_content_gives_the_same_bytes():
    assert hdf5_bytes(DATASET) == hdf5_bytes(DATASET)
