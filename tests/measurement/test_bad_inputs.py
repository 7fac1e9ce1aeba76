import pytest

from jaxink.measurement import read, read_csv
from tests.measurement.bad_inputs import BAD_INPUTS, GOOD


@pytest.mark.parametrize("bad", BAD_INPUTS, ids=[bad.name for bad in BAD_INPUTS])
def test_row_and_column_are_named(bad, tmp_path, refused):
    path = tmp_path / "gonio.csv"
    path.write_bytes(bad.content)
    with refused(path, bad.named):
        read(path)


def test_good_file_is_accepted(tmp_path):
    path = tmp_path / "gonio.csv"
    path.write_text("\n".join(GOOD))
    assert len(read(path)) == 5


@pytest.mark.parametrize(
    ("name", "named"),
    [
        ("gonoi.csv", "gonio.csv"),
        ("other/file.csv", "other/file.csv"),
        (".", ""),
        ("gonio.xlsx", ".xlsx"),
        ("broken.nc", "4"),
    ],
)
def test_path_sentence(name, named, tmp_path, refused):
    (tmp_path / "gonio.csv").write_text("\n".join(GOOD))
    (tmp_path / "broken.nc").write_bytes(b"\x89HDF\r\n\x1a\nbroken")
    if name.endswith("xlsx"):
        (tmp_path / name).write_bytes(b"PK")
    with refused(named):
        read(tmp_path / name)


@pytest.mark.parametrize(
    ("overrides", "named"),
    [
        (
            {"wavelength_nm": 600},
            "row 2",
        ),
        ({"wavelength_nm": 0.55}, "wavelength_nm"),
        ({"side": "T"}, "row 2"),
        ({"side": "front"}, "front"),
        ({"sample": "a"}, "a"),
        ({"columns": {"bsdf": "x"}}, "theta_i_deg"),
        ({"columns": {"phi_deg": "azimuth"}}, "phi_deg"),
    ],
)
def test_override_sentence(overrides, named, tmp_path, refused):
    path = tmp_path / "gonio.csv"
    path.write_text("\n".join(GOOD))
    with refused(named):
        read_csv(path, **overrides)


def test_netcdf_takes_no_override(tmp_path, refused):
    path = tmp_path / "gonio.csv"
    path.write_text("\n".join(GOOD))
    read(path).to_netcdf(tmp_path / "gonio.nc")
    with refused("side"):
        read(tmp_path / "gonio.nc", side="R")
