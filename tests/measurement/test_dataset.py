import dataclasses
import pickle

import numpy as np
import pytest

from jaxink.files.netcdf import write_dataset
from jaxink.measurement import GonioData, MaskLimits, Scan, read, read_netcdf
from tests.measurement.bad_inputs import HEADER


def fields(**changes):
    values = {
        "theta_i_deg": [30.0, 0.0, 30.0, 30.0],
        "theta_o_deg": [10.0, 20.0, 1 / 3, 90.0],
        "phi_deg": [180.0, 0.0, -90.0, 1e-17],
        "wavelength_nm": [550.0, 550.0, 632.8, 550.0],
        "is_transmission": [False, False, False, True],
        "bsdf_per_sr": [0.1, 0.2, -1e-300, np.pi],
    }
    return values | changes


def full_data() -> GonioData:
    return GonioData(
        **fields(),
        sigma_per_sr=[0.1, np.nextafter(0.1, 1), 5e-324, 2.0],
        extra={
            "time [s]": [1.5, np.nan, np.inf, -0.0],
            "operator": ["Ann", "", "Åsa, 'a' \"b\"", "Bo\n"],
            "time/s": [1, 2, 3, 4],
        },
        row=[5, 4, 9, 2],
        mask=[0, 1, 33, 0],
        source="a b.csv",
        notes=("One thing was handled.", "Ünd another."),
        attrs={"sample": "z307", "aperture_deg": 0.1, "readings": 3},
    )


@pytest.mark.parametrize("data", [full_data(), GonioData(**fields())], ids=["full", "bare"])
def test_fields_are_of_their_types_whatever_was_given(data):
    containers = ("extra", "notes", "attrs")
    fields_of_one_type = [field for field in dataclasses.fields(data) if field.name not in containers]
    assert all(isinstance(getattr(data, field.name), field.type) for field in fields_of_one_type)


def test_arrays_are_frozen_copies():
    angles = np.array([30.0, 0.0, 30.0, 30.0])
    data = GonioData(**fields(theta_i_deg=angles))
    angles[0] = 5
    assert data.theta_i_deg[0] == 30
    for values in (data.bsdf_per_sr, data.mask, full_data().extra["operator"]):
        with pytest.raises(ValueError, match="read-only"):
            values[0] = values[1]
    with pytest.raises(AttributeError):
        data.source = "other"
    with pytest.raises(TypeError):
        data.extra["x"] = 1


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"phi_deg": [0.0]}, "phi_deg"),
        ({name: [] for name in fields()}, ""),
        ({"bsdf_per_sr": [1, 2, np.nan, 4]}, "bsdf_per_sr"),
        ({"theta_o_deg": [1, 2, 3, 90.5]}, "theta_o_deg"),
        ({"phi_deg": [0, -180, 0, 0]}, "phi_deg"),
        ({"wavelength_nm": [0, 1, 1, 1]}, "wavelength_nm"),
        ({"wavelength_nm": [550, 550, 0.55, 550]}, "wavelength_nm[2]"),
        ({"wavelength_nm": [550, 1e6, 550, 550]}, "wavelength_nm[1]"),
        ({"bsdf_per_sr": [1, 2, 2147483648, 4]}, "bsdf_per_sr[2]"),
        ({"bsdf_per_sr": [1, -5e9, 3, 4]}, "bsdf_per_sr[1]"),
        ({"sigma_per_sr": [1, 1, 1, 0]}, "sigma_per_sr"),
        ({"sigma_per_sr": [1, 1, 1, 1e9]}, "sigma_per_sr[3]"),
        ({"extra": {"t": [1, 2]}}, "2"),
    ],
)
def test_invariants(changes, named, refused):
    with refused(named):
        GonioData(**fields(**changes))


def test_absurd_values_of_a_netcdf_file_are_refused(tmp_path, refused):
    dataset = full_data().to_dataset()
    dataset["bsdf_per_sr"][1] = 5e9
    write_dataset(dataset, tmp_path / "data.nc")
    with refused("data.nc", "bsdf_per_sr[1]"):
        read_netcdf(tmp_path / "data.nc")


def test_values_divided_by_a_tiny_cosine_are_refused_by_their_row(tmp_path, refused):
    rows = ["30,20,180,550,R,0.2,0.01", "30,89.9999,180,550,R,500,0.01"]
    path = tmp_path / "horizon.csv"
    path.write_text("\n".join([HEADER, *rows]))
    with refused("row 3", "bsdf_per_sr"):
        read(path, cosine_weighted=True)


def test_scans():
    data = full_data()
    assert data.scans == (
        Scan(0, "R", 550.0, 0.0, 1, 0),
        Scan(1, "R", 550.0, 30.0, 1, 1),
        Scan(2, "R", 632.8, 30.0, 1, 0),
        Scan(3, "T", 550.0, 30.0, 1, 1),
    )
    np.testing.assert_array_equal(data.scan_index, [1, 0, 2, 3])
    kept = data.replace(mask=[0, 1, 0, 0])
    np.testing.assert_array_equal(kept.used_scan_index, [0, 1, 2])
    np.testing.assert_array_equal(data.side, ["R", "R", "R", "T"])
    np.testing.assert_array_equal(data.used, [True, False, False, True])


def test_select():
    data = full_data()
    np.testing.assert_array_equal(data.select(wavelength_nm=550).row, [5, 4, 2])
    np.testing.assert_array_equal(data.select(wavelength_nm=(550, 632.8), side="R").row, [5, 4, 9])
    part = data.select(theta_i_deg=30, side="R")
    np.testing.assert_array_equal(part.sigma_per_sr, data.sigma_per_sr[[0, 2]])
    assert part.extra["operator"].tolist() == ["Ann", "Åsa, 'a' \"b\""]
    np.testing.assert_array_equal(data.select(used_only=True).row, [5, 2])


@pytest.mark.parametrize(
    ("choice", "named"),
    [
        ({"wavelength_nm": 532}, "b.csv"),
        ({"theta_i_deg": (0, 31)}, "b.csv"),
        ({"side": "r"}, "b.csv"),
        (
            {"wavelength_nm": 632.8, "side": "T"},
            "b.csv",
        ),
    ],
)
def test_select_refuses(choice, named, refused):
    with refused(named):
        full_data().select(**choice)


@pytest.mark.parametrize("data", [full_data(), GonioData(**fields())], ids=["full", "bare"])
def test_round_trips_are_exact(data, tmp_path):
    path = tmp_path / "data.nc"
    data.to_netcdf(path)
    assert read_netcdf(path).equals(data)
    assert read(path).equals(data)
    assert GonioData.from_dataset(data.to_dataset()).equals(data)
    assert pickle.loads(pickle.dumps(data)).equals(data)


def test_equals_sees_every_difference():
    data = full_data()
    changes = [
        {"bsdf_per_sr": data.bsdf_per_sr * (1 + 1e-15)},
        {"sigma_per_sr": None},
        {"notes": ()},
        {"attrs": {}},
        {"mask": data.mask ^ 2},
        {"extra": dict(data.extra) | {"operator": ["Ann"] * 4}},
        {"extra": {}},
    ]
    for change in changes:
        assert not data.replace(**change).equals(data)


def test_dataset_describes_itself(told):
    dataset = full_data().with_masks(MaskLimits()).to_dataset()
    assert dataset.sizes == {"point": 4}
    for name in ("theta_i_deg", "theta_o_deg", "phi_deg"):
        assert dataset.coords[name].attrs["units"] == "degree"
    assert dataset.coords["wavelength_nm"].attrs["units"] == "nm"
    assert dataset["bsdf_per_sr"].attrs["units"] == "sr-1"
    assert dataset.attrs["schema_version"] == 1
    told(dataset.attrs["conventions"], 180)
    meanings = dataset["mask"].attrs["flag_meanings"].split()
    assert len(meanings) == len(dataset["mask"].attrs["flag_masks"])


def _without_notes(dataset):
    dataset = dataset.copy()
    del dataset.attrs["notes"]
    return dataset


def test_dataset_refuses(refused):
    dataset = full_data().to_dataset()
    for changed, named in [
        (dataset.assign_attrs(schema="x"), "schema"),
        (dataset.assign_attrs(schema_version=2), "schema_version"),
        (dataset.drop_vars("mask"), "mask"),
        (_without_notes(dataset), "notes"),
    ]:
        with refused(named):
            GonioData.from_dataset(changed)


def test_failed_write_leaves_the_old_file(tmp_path, monkeypatch, refused):
    path = tmp_path / "data.nc"
    full_data().to_netcdf(path)
    before = path.read_bytes()

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full_disk)
    with refused("No space left on device"):
        GonioData(**fields()).to_netcdf(path)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["data.nc"]


@pytest.mark.parametrize(
    ("name", "named"),
    [
        ("data.csv", ".nc"),
        ("absent/data.nc", "absent"),
    ],
)
def test_write_refuses(name, named, tmp_path, refused):
    with refused(named):
        full_data().to_netcdf(tmp_path / name)


@pytest.mark.parametrize(
    "sides",
    [
        ["R", "R", "R", "T"],
        np.array(["R", "R", "R", "T"]),
        [0, 0, 0, 1.0],
        np.array([False] * 3 + [True], object),
    ],
    ids=["letters", "array of letters", "numbers", "objects"],
)
def test_sides_are_booleans_or_letters(sides):
    assert GonioData(**fields(is_transmission=sides)).is_transmission.tolist() == [False] * 3 + [True]


@pytest.mark.parametrize(
    ("sides", "named"),
    [
        (["reflection"] * 4, "'reflection'"),
        (["False"] * 4, "'False'"),
        ([0, 0, 2, 1], "2"),
        ([0.0, np.nan, 1.0, 1.0], "nan"),
        ([None, True, True, True], "None"),
    ],
)
def test_other_sides_are_refused(sides, named, refused):
    with refused(f"is_transmission contains {named}"):
        GonioData(**fields(is_transmission=sides))
