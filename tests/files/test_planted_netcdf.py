"""A netCDF file has inside all that is read from it; what it borrows from elsewhere is refused."""

from io import BytesIO

import h5py
import numpy as np
import pytest

from jaxink.files.netcdf import hdf5_bytes, read_dataset
from jaxink.measurement import GonioData, read
from tests.files.test_netcdf_layout import DATASET

POINTS = 4
SECRET = np.array([0.1, 0.2, 0.3, 0.4])


@pytest.fixture
def planted(tmp_path):
    """A measurement, changed below the library that wrote it, beside a file with other values."""

    def make(change):
        path = tmp_path / "points.nc"
        angles = {name: np.full(POINTS, 30.0) for name in ("theta_i_deg", "theta_o_deg", "phi_deg")}
        GonioData(
            **angles,
            wavelength_nm=np.full(POINTS, 550.0),
            is_transmission=np.zeros(POINTS, bool),
            bsdf_per_sr=np.full(POINTS, 0.5),
        ).to_netcdf(path)
        with h5py.File(path, "r+") as file:
            # Without the checksum, as from another program.
            change(file, tmp_path)
        return path

    return make


def put(file, make):
    """A value of another origin in the place of the BSDF, with its dimension."""
    del file["bsdf_per_sr"]
    make("bsdf_per_sr")
    if isinstance(file.get("bsdf_per_sr", getlink=True), h5py.HardLink):
        file["bsdf_per_sr"].dims[0].attach_scale(file["point"])


def raw_file(file, folder):
    (folder / "secret").write_bytes(SECRET.tobytes())
    where = [(str(folder / "secret"), 0, SECRET.nbytes)]
    put(file, lambda name: file.create_dataset(name, (POINTS,), "f8", external=where))


def virtual(file, folder):
    source = h5py.VirtualSource(folder / "missing.h5", "x", shape=(POINTS,))
    layout = h5py.VirtualLayout((POINTS,), "f8")
    layout[:] = source
    put(file, lambda name: file.create_virtual_dataset(name, layout))


def virtual_of_itself(file, folder):
    layout = h5py.VirtualLayout((POINTS,), "f8")
    layout[:] = h5py.VirtualSource(".", "theta_i_deg", shape=(POINTS,))
    put(file, lambda name: file.create_virtual_dataset(name, layout))


def external_link(file, folder):
    with h5py.File(folder / "other.h5", "w") as other:
        other["x"] = SECRET
    put(file, lambda name: file.__setitem__(name, h5py.ExternalLink(str(folder / "other.h5"), "x")))


def soft_link(file, folder):
    put(file, lambda name: file.__setitem__(name, h5py.SoftLink("/theta_i_deg")))


def dangling_link(file, folder):
    file["extra_0_time"] = h5py.SoftLink("/nowhere")


def never_written(file, folder):
    put(file, lambda name: file.create_dataset(name, (POINTS,), "f8"))


def written_in_part(file, folder):
    put(file, lambda name: file.create_dataset(name, (POINTS,), "f8", chunks=(1,)))
    file["bsdf_per_sr"][0] = 0.5


def empty(file, folder):
    del file["bsdf_per_sr"]
    file["bsdf_per_sr"] = h5py.Empty("f8")


def named_type(file, folder):
    file["bsdf_type"] = np.dtype("f8")


def nested(file, folder):
    for _ in range(5000):
        file = file.create_group("inner")


def circle(file, folder):
    file["itself"] = file


def many(file, folder):
    for number in range(10_001):
        file[f"link_{number}"] = h5py.SoftLink("/row")


def one_large_chunk(file, folder):
    of_zeros = {"chunks": (10**8,), "maxshape": (None,), "compression": "gzip"}
    put(file, lambda name: file.create_dataset(name, (POINTS,), "f8", **of_zeros))


REFUSED = {
    raw_file: "bsdf_per_sr",
    virtual: "bsdf_per_sr",
    virtual_of_itself: "bsdf_per_sr",
    external_link: "bsdf_per_sr",
    soft_link: "bsdf_per_sr",
    dangling_link: "extra_0_time",
    never_written: "bsdf_per_sr",
    written_in_part: "bsdf_per_sr",
    empty: "points.nc",
    named_type: "bsdf_type",
    nested: "inner",
    circle: "itself",
    many: "at most 10000",
    one_large_chunk: "800 MB",
}


@pytest.mark.parametrize("change", REFUSED, ids=lambda change: change.__name__)
def test_values_from_elsewhere_are_refused(change, planted, refused):
    path = planted(change)
    # The size of the file itself depends on the library that wrote it.
    with refused("points.nc", REFUSED[change], numbers=change is not one_large_chunk):
        read(path)


def chunked(file, folder):
    """As other programs write it: in chunks and packed, but whole."""
    packed = {"chunks": (3,), "compression": "gzip", "shuffle": True}
    put(file, lambda name: file.create_dataset(name, data=SECRET, **packed))


def test_complete_files_of_other_programs_are_read(planted, tmp_path):
    np.testing.assert_array_equal(read(planted(chunked)).bsdf_per_sr, SECRET)
    theirs = tmp_path / "theirs.nc"
    DATASET.to_netcdf(theirs, engine="h5netcdf", encoding={"value": {"zlib": True}})
    assert read_dataset(theirs).equals(DATASET)


def test_dimensions_without_values_are_no_missing_values(tmp_path):
    with h5py.File(BytesIO(hdf5_bytes(DATASET))) as file:
        assert file["point"].id.get_storage_size() == 0
    (tmp_path / "mine.nc").write_bytes(hdf5_bytes(DATASET))
    assert read_dataset(tmp_path / "mine.nc").equals(DATASET)
