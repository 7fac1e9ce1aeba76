"""A table written to netCDF and read again."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import xarray

import jaxink
from jaxink.ink import COMPONENTS, InkTable

ANGLES = np.array([0.0, 40.0, 90.0])
AZIMUTHS = np.array([0.0, 90.0, 180.0])


@pytest.fixture
def table():
    random = np.random.default_rng(5)
    bsdf, error = random.random((2, 4, 2, 3, 3, 3))
    regular, regular_error = random.random((2, 4, 2, 3))
    wavelengths, inside = np.array([450.0, 650.0]), np.array([1.5, 1.49])
    attrs = {"layers": "ink", "accuracy": 1e-4}
    return InkTable(
        wavelengths, ANGLES, AZIMUTHS, bsdf, regular, inside, np.ones(2), error, regular_error, attrs
    )


def equal(a, b):
    for field in dataclasses.fields(InkTable):
        one, other = getattr(a, field.name), getattr(b, field.name)
        assert one == other if isinstance(one, dict) else np.array_equal(one, other), field.name


def test_what_is_read_is_what_was_written(table, tmp_path):
    path = table.to_netcdf(tmp_path / "ink.nc")
    equal(jaxink.read_ink_table(path), table)
    with xarray.open_dataset(path, engine="h5netcdf") as dataset:
        assert dataset["bsdf_per_sr"].dims == ("component", "wavelength", "theta_i", "theta_o", "phi")
        assert tuple(dataset["component"].values) == COMPONENTS
        for name in ("wavelength", "theta_i", "theta_o", "phi", "bsdf_per_sr", "regular"):
            assert dataset[name].attrs["long_name"]
            assert dataset[name].attrs["units"]
        assert "T_IA(i, o) / index_outside^2 = T_AI(o, i) / index_inside^2" in dataset.attrs["conventions"]


def test_without_standard_errors(table, tmp_path):
    plain = dataclasses.replace(table, bsdf_standard_error_per_sr=None, regular_standard_error=None)
    assert jaxink.read_ink_table(plain.to_netcdf(tmp_path / "ink.nc")).regular_standard_error is None


def test_a_failed_write_leaves_the_old_file(table, tmp_path, monkeypatch, refused):
    path = table.to_netcdf(tmp_path / "ink.nc")
    before = path.read_bytes()

    def half(self, content):
        with open(self, "wb") as file:
            file.write(content[: len(content) // 2])
        if self.name == "ink.nc":
            raise OSError("disk full")

    monkeypatch.setattr(Path, "write_bytes", half)
    with refused("disk full"):
        table.to_netcdf(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["ink.nc"]


def test_bad_files_are_refused(table, tmp_path, refused):
    with refused(".nc"):
        table.to_netcdf(tmp_path / "ink.h5")
    with refused("absent.nc"):
        jaxink.read_ink_table(tmp_path / "absent.nc")
    (tmp_path / "text.nc").write_text("not netCDF")
    with refused("text.nc"):
        jaxink.read_ink_table(tmp_path / "text.nc")
    dataset = table.to_dataset()
    for broken, named in (
        (dataset.drop_vars("regular"), "regular"),
        (dataset.assign_attrs(schema="other"), "broken.nc"),
        (dataset.assign_attrs(schema_version=9), "schema_version"),
        (dataset.assign_coords(theta_o=ANGLES / 2), "theta_i"),
    ):
        broken.to_netcdf(tmp_path / "broken.nc", engine="h5netcdf")
        with refused(named):
            jaxink.read_ink_table(tmp_path / "broken.nc")


def test_interpolation_is_linear_and_mirrors_the_azimuth(table):
    at_entry = table.interpolated("T_AI", 40.0, 90.0, [90.0, 270.0, -90.0], wavelength=1)
    assert at_entry == pytest.approx(table.bsdf_per_sr[2, 1, 1, 2, 1])
    between = table.interpolated("R_II", 20.0, 40.0, 0.0)
    assert between == pytest.approx(table.bsdf_per_sr[0, 0, :2, 1, 0].mean())
