import re

import pytest

from jaxink.errors import InputRefusedError
from jaxink.measurement import read, read_csv
from tests.measurement.bad_inputs import BAD_INPUTS, GOOD


@pytest.mark.parametrize("bad", BAD_INPUTS, ids=[bad.name for bad in BAD_INPUTS])
def test_sentence(bad, tmp_path):
    path = tmp_path / "gonio.csv"
    path.write_bytes(bad.content)
    with pytest.raises(InputRefusedError) as caught:
        read(path)
    assert str(caught.value) == f"{path}{bad.sentence}"


def test_good_file_is_accepted(tmp_path):
    path = tmp_path / "gonio.csv"
    path.write_text("\n".join(GOOD))
    assert len(read(path)) == 5


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("gonoi.csv", "there is no such measurement file; did you mean gonio.csv."),
        ("other/file.csv", "there is no such measurement file."),
        (".", "is a directory; give one measurement file."),
        ("gonio.xlsx", "the suffix '.xlsx' is not one of .csv, .txt, .tsv, .nc."),
        ("broken.nc", "is not a readable netCDF 4 file."),
    ],
)
def test_path_sentence(name, sentence, tmp_path):
    (tmp_path / "gonio.csv").write_text("\n".join(GOOD))
    (tmp_path / "broken.nc").write_bytes(b"\x89HDF\r\n\x1a\nbroken")
    if name.endswith("xlsx"):
        (tmp_path / name).write_bytes(b"PK")
    with pytest.raises(InputRefusedError, match=re.escape(sentence) + "$"):
        read(tmp_path / name)


@pytest.mark.parametrize(
    ("overrides", "sentence"),
    [
        (
            {"wavelength_nm": 600},
            "row 2, column wavelength_nm: the file states 550, the caller 600; give one.",
        ),
        ({"wavelength_nm": 0.55}, "read_csv, column wavelength_nm: 0.55 is not a wavelength in nm;"),
        ({"side": "T"}, "row 2, column side: the file states R, the caller T; give one."),
        ({"side": "front"}, "read_csv: side is 'front'; it must be 'R' or 'T'."),
        ({"sample": "a"}, "has no column sample to take 'a' from."),
        ({"columns": {"bsdf": "x"}}, "columns renames 'bsdf', which is none of theta_i_deg,"),
        ({"columns": {"phi_deg": "azimuth"}}, "column azimuth: columns names it for phi_deg, but"),
    ],
)
def test_override_sentence(overrides, sentence, tmp_path):
    path = tmp_path / "gonio.csv"
    path.write_text("\n".join(GOOD))
    with pytest.raises(InputRefusedError, match=re.escape(sentence)):
        read_csv(path, **overrides)


def test_netcdf_takes_no_override(tmp_path):
    path = tmp_path / "gonio.csv"
    path.write_text("\n".join(GOOD))
    read(path).to_netcdf(tmp_path / "gonio.nc")
    with pytest.raises(InputRefusedError, match="a netCDF file is complete and takes no side"):
        read(tmp_path / "gonio.nc", side="R")
