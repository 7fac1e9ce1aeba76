import subprocess
import sys

import numpy as np
import pytest

from jaxink.measurement import read, read_csv
from tests.measurement.bad_inputs import GOOD, column

NEEDED = [line.rsplit(",", 1)[0] for line in GOOD]


def written(tmp_path, lines, **overrides):
    path = tmp_path / "gonio.csv"
    path.write_bytes(lines if isinstance(lines, bytes) else "\n".join(lines).encode())
    return read_csv(path, **overrides)


def test_values(tmp_path):
    data = written(tmp_path, GOOD)
    np.testing.assert_array_equal(data.theta_i_deg, [0, 0, 30, 30, 30])
    np.testing.assert_array_equal(data.theta_o_deg, [10, 20, 0, 45, 80])
    np.testing.assert_array_equal(data.phi_deg, [180, 180, 0, -90, 0])
    np.testing.assert_array_equal(data.wavelength_nm, 550)
    np.testing.assert_array_equal(data.bsdf_per_sr, [0.30, 0.29, 0.28, 0.27, 0.21])
    np.testing.assert_array_equal(data.sigma_per_sr, 0.003)
    np.testing.assert_array_equal(data.row, [2, 3, 4, 5, 6])
    assert not data.is_transmission.any()
    assert data.used.all()
    assert data.source == "gonio.csv"
    assert data.notes == ()


def test_sigma_is_optional(tmp_path):
    assert written(tmp_path, NEEDED).sigma_per_sr is None


HANDLED = [
    ("bom", b"\xef\xbb\xbf" + "\n".join(GOOD).encode(), ""),
    ("semicolon", [line.replace(",", ";") for line in GOOD], ""),
    ("tab", [line.replace(",", "\t") for line in GOOD], ""),
    ("comment", ["# by hand", *GOOD], "'#'"),
    ("blank_line", [*GOOD[:3], "", *GOOD[3:]], ""),
    ("case", [GOOD[0].upper(), *GOOD[1:]], "theta_i_deg"),
    ("bracket", [GOOD[0].replace("phi_deg", "phi [deg]"), *GOOD[1:]], "phi [deg]"),
    ("words", [line.replace("R", "reflection") for line in GOOD], "'reflection'"),
    ("lower_case", [line.replace(",R,", ",r,") for line in GOOD], "'r'"),
    ("azimuth_360", [line.replace("-90", "270") for line in GOOD], "360"),
    ("azimuth_minus_180", [line.replace(",180,", ",-180,") for line in GOOD], "-180"),
    ("unnamed_column", [line + "," for line in GOOD], "8"),
    ("windows_lines", "\r\n".join(GOOD).encode(), None),
    ("padded_header", [GOOD[0].replace(",", " , "), *GOOD[1:]], None),
]


@pytest.mark.parametrize(("name", "lines", "note"), HANDLED, ids=[case[0] for case in HANDLED])
def test_handled_and_said(name, lines, note, tmp_path, told):
    plain = written(tmp_path, GOOD)
    data = written(tmp_path, lines)
    assert any(note in said for said in data.notes) if note is not None else data.notes == ()
    for said in data.notes:
        told(said)
    assert data.replace(notes=(), row=plain.row).equals(plain)


def test_rows_are_those_of_the_file(tmp_path):
    data = written(tmp_path, ["# made by hand", *GOOD[:3], "", *GOOD[3:]])
    np.testing.assert_array_equal(data.row, [3, 4, 6, 7, 8])


def test_file_order_is_kept_and_scans_do_not_depend_on_it(tmp_path, told):
    sorted_data = written(tmp_path, GOOD)
    order = [3, 0, 4, 1, 2]
    data = written(tmp_path, [GOOD[0], *(GOOD[1 + i] for i in order)])
    (note,) = data.notes
    told(note)
    np.testing.assert_array_equal(data.bsdf_per_sr, sorted_data.bsdf_per_sr[order])
    np.testing.assert_array_equal(data.scan_index, sorted_data.scan_index[order])
    assert data.scans == sorted_data.scans


def test_repeats_are_kept_and_said(tmp_path, told):
    data = written(tmp_path, [*GOOD, "30,0,90,550,R,0.281,0.003"])
    assert len(data) == 6
    (note,) = data.notes
    told(note, "rows 4 and 7")


def test_copied_rows_are_kept_and_said(tmp_path, told):
    data = written(tmp_path, [*GOOD, GOOD[2]])
    assert len(data) == 6
    told(data.notes[-1], "rows 3 and 7")


def test_negative_values_are_masked_and_said(tmp_path, told):
    data = written(tmp_path, column("bsdf_per_sr", [0.3, -0.01, 0.28, 0, 0.21]))
    np.testing.assert_array_equal(data.mask, [0, 1, 0, 0, 0])
    (note,) = data.notes
    told(note, "1 of 5", "row 3")


def test_extra_columns(tmp_path):
    lines = [GOOD[0] + ",time_s,operator,serial"]
    ends = ["1.5,Ann,007", "2e1,Bo,008", ",Cy,009", "-4,,010", ".5,Eve,011"]
    data = written(tmp_path, lines + [f"{a},{b}" for a, b in zip(GOOD[1:], ends, strict=True)])
    np.testing.assert_array_equal(data.extra["time_s"], [1.5, 20, np.nan, -4, 0.5])
    assert data.extra["operator"].tolist() == ["Ann", "Bo", "Cy", "", "Eve"]
    assert data.extra["serial"].tolist() == ["007", "008", "009", "010", "011"]


def test_sample_is_chosen(tmp_path):
    lines = [GOOD[0] + ",sample", *(f"{line},{'ab'[i % 2]}" for i, line in enumerate(GOOD[1:]))]
    data = written(tmp_path, lines, sample="b")
    assert data.attrs == {"sample": "b"}
    np.testing.assert_array_equal(data.row, [3, 5])


def test_columns_are_renamed(tmp_path):
    lines = [GOOD[0].replace("theta_o_deg", "arm"), *GOOD[1:]]
    data = written(tmp_path, lines, columns={"theta_o_deg": "arm"})
    np.testing.assert_array_equal(data.theta_o_deg, [10, 20, 0, 45, 80])


def test_caller_states_wavelength_and_side(tmp_path, told):
    lines = column("wavelength_nm", [""] * 5).replace(b",R,", b",,")
    data = written(tmp_path, lines, wavelength_nm=532, side="T")
    assert data.is_transmission.all()
    np.testing.assert_array_equal(data.wavelength_nm, 532)
    wavelength, side = data.notes
    told(wavelength, "532 nm")
    told(side, "'T'")


def test_small_angles_in_degrees_are_no_radians(tmp_path):
    angles = [f"0,{step / 10:g},180,550,R,0.3" for step in range(1, 31)]
    assert len(written(tmp_path, [NEEDED[0], *angles])) == 30


def test_bright_narrow_peak_is_no_per_cent(tmp_path):
    rows = [f"0,{theta},180,550,T,{1000 * 2.0**-theta + 1e-3}" for theta in range(0, 90, 5)]
    assert len(written(tmp_path, [NEEDED[0], *rows])) == 18


def test_every_simulated_file(shared_data):
    files = sorted((shared_data / "simulated").glob("*.csv"))
    assert len(files) >= 20
    for path in files:
        data = read(path)
        assert data.notes == ()
        assert len(data) == path.read_text().count("\n") - 1
        assert data.sigma_per_sr is not None


@pytest.mark.parametrize(
    ("name", "points", "scans"),
    [
        ("ptfe_nist_germer/brdf_regular.csv", 7296, 24),
        ("paint_z307_black/brdf_inplane.csv", 228, 10),
        ("spectralon_rsg_blacklab/brdf_nadir_view.csv", 209, 187),
    ],
)
def test_measured_files(name, points, scans, shared_data):
    data = read(shared_data / "measured" / name)
    assert (len(data), len(data.scans)) == (points, scans)
    assert not data.is_transmission.any()


def test_diffuser_needs_a_wavelength(shared_data, refused, told):
    path = shared_data / "measured" / "diffuser_eds10_btdf" / "btdf.csv"
    with refused("wavelength_nm"):
        read(path)
    data = read(path, wavelength_nm=550)
    assert len(data) == 3010
    assert data.is_transmission.all()
    # At the normal the seven azimuths are one direction: repeats, which the reader says.
    for note in data.notes:
        told(note)
    assert any("5 " in note for note in data.notes)


@pytest.mark.parametrize(
    ("name", "named"),
    [
        ("ptfe_discs_rt_uzh/rt_vs_thickness.csv", "fraction_pmt_ratio"),
        ("sphere_totals_iad/totals.csv", "sphere_M_R"),
        ("paint_z307_black/black_coatings_spectral_reflectance.csv", "reflectance_factor_field_asd"),
    ],
)
def test_other_quantities_are_refused(name, named, shared_data, refused):
    with refused(named):
        read(shared_data / "measured" / name)


def test_reading_imports_numpy_only():
    code = (
        "import sys, jaxink.measurement; "
        "print(*sorted({'jax', 'xarray', 'scipy', 'matplotlib'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == ""
