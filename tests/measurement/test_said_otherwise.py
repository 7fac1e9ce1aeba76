"""Headings, titles and cells that say that a file is not what it would be read as."""

import numpy as np
import pytest

import jaxink
from jaxink.errors import InputRefusedError

PLANE = {"wavelength_nm": 550, "signed_angles": True, "side": "R"}


@pytest.fixture
def read(tmp_path):
    """Reads lines as a file."""

    def reads(*lines, **stated):
        path = tmp_path / "gonio.csv"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return jaxink.read(path, **stated)

    return reads


def headed(angle="Detector angle", value="BRDF", incidence="AOI", row="30,{},0.19"):
    """A table in the plane of incidence."""
    return [f"{incidence},{angle},{value}", *(row.format(k) for k in (-50, -40, 0, 10, 20, 40))]


# Headings that name another quantity, or another unit; what the message has to say.
OTHERWISE = {
    "mrad": ({"angle": "Arm (mrad)"}, "theta_o_deg=Arm (mrad)", ("mrad", "0.18/pi")),
    "from specular": (
        {"angle": "Detector angle from specular (deg)"},
        "theta_o_deg={}",
        ("specular", "normal"),
    ),
    "in brackets": ({"angle": "Detector angle (deg from specular)"}, "", ("specular", "normal")),
    "from the beam": ({"angle": "Detector angle from incident beam (deg)"}, "", ("beam", "normal")),
    "elevation": ({"angle": "Detector elevation (deg)"}, "theta_o_deg={}", ("surface", "normal")),
    "grazing": ({"incidence": "Grazing angle (deg)"}, "theta_i_deg={}", ("surface", "normal")),
    "cosine": ({"value": "CCBRDF (1/sr)"}, "bsdf_per_sr={}", ("cosine", "--cosine-weighted")),
    "times cosine": ({"value": "BRDF*cos (1/sr)"}, "", ("cosine", "--cosine-weighted")),
    "per cent": ({"value": "Value (%/sr)"}, "bsdf_per_sr={}", ("0.01",)),
    "thousandths": ({"value": "BRDF (10^-3 1/sr)"}, "bsdf_per_sr={}", ("1e-3",)),
    "factor": ({"value": "Radiance factor"}, "bsdf_per_sr={}", ("perfect diffuser", "pi")),
    "signal": ({"value": "Signal (V)"}, "bsdf_per_sr={}", ("'V'", "1/sr")),
    "intensity": ({"value": "Radiant intensity"}, "bsdf_per_sr={}", ("intensity", "flux")),
}


@pytest.mark.parametrize("stated", [False, True], ids=["found", "stated"])
@pytest.mark.parametrize("kind", OTHERWISE)
def test_a_heading_of_another_quantity_is_refused(kind, stated, read, told):
    names, columns, words = OTHERWISE[kind]
    heading = next(iter(names.values()))
    if stated and not columns:
        pytest.skip("is found without a statement")
    given = dict([columns.format(heading).split("=", 1)]) if stated else {}
    with pytest.raises(InputRefusedError) as refused:
        read(*headed(**names), columns=given, **PLANE)
    if stated or kind not in ("mrad", "per cent", "signal"):
        told(str(refused.value), heading, *words)


def test_a_remark_in_a_heading_can_be_stated_to_be_one(read, told):
    lines = headed(value="BRDF (mean of 3)")
    with pytest.raises(InputRefusedError) as refused:
        read(*lines, **PLANE)
    told(str(refused.value), '--columns "bsdf_per_sr=BRDF (mean of 3)"')
    assert read(*lines, columns={"bsdf_per_sr": "BRDF (mean of 3)"}, **PLANE).bsdf_per_sr[0] == 0.19


def test_comments_of_a_converter_are_not_taken_for_titles(read, tmp_path):
    data = read(*headed(value="CCBRDF (1/sr)"), cosine_weighted=True, **PLANE)
    jaxink.measurement.write_csv(data, tmp_path / "tidy.csv", data.notes)
    np.testing.assert_allclose(jaxink.read(tmp_path / "tidy.csv").bsdf_per_sr, data.bsdf_per_sr)


def test_a_product_with_the_cosine_is_found_by_its_name(read):
    data = read(*headed(value="CCBRDF (1/sr)"), cosine_weighted=True, **PLANE)
    np.testing.assert_allclose(data.bsdf_per_sr, 0.19 / np.cos(np.deg2rad(data.theta_o_deg)))


MATRIX = ["Detector angle (deg),AOI 0 deg,AOI 30 deg", "-40,0.14,0.15", "0,0.15,0.16", "40,0.14,0.15"]


@pytest.mark.parametrize("title", ["Reflectance factor (%)", "CCBRDF (1/sr)", "Radiant intensity (1/sr)"])
def test_a_title_of_a_matrix_says_what_its_values_are(title, read, told):
    assert len(read("BRDF (1/sr)", *MATRIX, **PLANE)) == 6
    with pytest.raises(InputRefusedError) as refused:
        read(title, *MATRIX, **PLANE)
    told(str(refused.value), "row 1", title)


def test_a_title_of_a_table_may_say_that_it_contains_a_cosine(read, told):
    lines = ["All values cosine corrected (BRDF*cos)", *headed()]
    with pytest.raises(InputRefusedError) as refused:
        read(*lines, **PLANE)
    told(str(refused.value), "row 1", "--cosine-weighted", "remove these words")
    assert len(read(*lines, cosine_weighted=True, **PLANE)) == 6


@pytest.mark.parametrize("mark", ["999", "9999.0000", "9.99900E+03", "99.999", "65535", "1e6", "-999"])
def test_marks_of_missing_values_are_no_readings(mark, read, told):
    lines = [*headed(), f"30,30,{mark}"]
    if mark.startswith("-"):
        assert read(*lines, **PLANE).used.sum() == 6
        return
    with pytest.raises(InputRefusedError) as refused:
        read(*lines, **PLANE)
    told(str(refused.value), "row 8", "missing")
    written = str(refused.value).partition("or write ")[2].split()[0]
    found = read(*lines[:-1], f"30,30,{written}", **PLANE).bsdf_per_sr[-1]
    assert found == pytest.approx(float(mark), rel=2e-5)


def test_a_mark_is_found_below_a_peak(read, refused):
    with refused("row 9", "missing"):
        read(*headed(), "30,30,20000", "30,-45,9999", **PLANE)


def test_large_values_of_nines_within_a_peak_are_readings(read):
    assert read(*headed(), "30,29,750", "30,30,999", **PLANE).bsdf_per_sr[-1] == 999


AZIMUTHS = [
    "AOI,Exit angle,{},BRDF",
    "30,20,0,0.28",
    "30,30,0,2.19",
    "30,20,180,0.19",
    "30,30,180,0.19",
    "30,60,90,0.2",
]


def test_a_peak_on_the_side_of_the_source_is_asked_about(read, told):
    lines = ["\n".join(AZIMUTHS).format("Azimuth (deg)")]
    with pytest.raises(InputRefusedError) as refused:
        read(*lines, wavelength_nm=550, side="R")
    told(str(refused.value), "Azimuth (deg)", "row 3", "source", "180", "--columns")
    for other in (lines[0].replace("Azimuth", "phi"), lines[0].replace("BRDF", "BTDF")):
        with pytest.raises(InputRefusedError, match="side of the source"):
            read(other, wavelength_nm=550, **({} if "BTDF" in other else {"side": "R"}))
    stated = read(*lines, wavelength_nm=550, side="R", columns={"phi_deg": "Azimuth (deg)"})
    assert stated.phi_deg[1] == 0
    # The name that this file format has for it says what it is.
    assert read("\n".join(AZIMUTHS).format("phi_deg"), wavelength_nm=550, side="R").phi_deg[1] == 0
    turned = [line.replace(",0,", ",x,").replace(",180,", ",0,").replace(",x,", ",180,") for line in AZIMUTHS]
    assert read("\n".join(turned).format("Azimuth (deg)"), wavelength_nm=550, side="R").phi_deg[1] == 180


# Cells, and what they would have to be.
CELLS = {
    "-30,30,0.19": ("theta_i_deg", "30", "-30", "sign"),
    "30,-105,0.03": ("theta_o_deg", "write -75", "side T"),
    "30,255,0.03": ("theta_o_deg", "write -75", "side T"),
    "30,370,0.03": ("theta_o_deg", "write 10"),
    "30,\N{EN DASH}10,0.19": ("dash", "write -10"),
    "30°,10,0.19": ("write 30", "'°'"),
    "30,10,1.7683D-01": ("write 1.7683e-01",),
    "30,10,1.7683 E-1": ("write 1.7683e-1",),
    "30,10,dark": ("'dark'", "remove the row"),
    "End of data": ("1 cell", "remove it"),
    "p-polarised": ("1 cell", "title", "column"),
}


@pytest.mark.parametrize("row", CELLS)
def test_a_cell_that_cannot_be_read_gets_what_it_has_to_be(row, read, told):
    with pytest.raises(InputRefusedError) as refused:
        read(*headed(), row, **PLANE)
    told(str(refused.value), "row 8", *CELLS[row])


def test_minus_signs_and_separators_at_the_end_are_read(read):
    assert read(*headed(), "30,\N{MINUS SIGN}10,0.19", **PLANE).phi_deg[-1] == 0
    data = read(*headed(row="30,{},0.19,"), **PLANE)
    assert len(data) == 6
    assert any("empty cell" in note for note in data.notes)


def test_a_header_is_found_below_titles_by_the_values_below_it(read, told):
    with pytest.raises(InputRefusedError) as refused:
        read("Sample: K50", "Angle (deg),BRDF", "-75,0.18", "0,0.19", **PLANE)
    told(str(refused.value), "Angle (deg), BRDF", "--columns")


def test_two_rows_of_names_are_told(read, told):
    with pytest.raises(InputRefusedError) as refused:
        read(
            ",450 nm,,550 nm,",
            "Detector angle (deg),AOI 0°,AOI 30°,AOI 0°,AOI 30°",
            "-75,.1,.1,.1,.1",
            **PLANE,
        )
    told(str(refused.value), "twice", "row above", "title")


def test_columns_of_an_angle_each_can_be_made_a_matrix(read, told):
    with pytest.raises(InputRefusedError) as refused:
        read("Detector angle,BRDF 0 deg,BRDF 30 deg", "-75,0.18,0.2", **PLANE)
    told(str(refused.value), "2 columns", "AOI 30 deg")
    assert len(read("Detector angle,AOI 0 deg,AOI 30 deg", "-75,0.18,0.2", "0,0.2,0.2", **PLANE)) == 4


BLOCK = ["Detector angle (deg),BRDF (1/sr)", "-40,0.14", "0,0.15", "40,0.16"]


@pytest.mark.parametrize("between", [["", "AOI: 30 deg", BLOCK[0]], ["AOI: 30 deg"], ["AOI: 30 deg,"]])
def test_tables_below_each_other_have_what_their_titles_state(between, read):
    data = read(
        "Sample: K50",
        "AOI: 0 deg",
        *BLOCK,
        *between,
        *BLOCK[1:],
        wavelength_nm=550,
        side="R",
        signed_angles=True,
    )
    np.testing.assert_array_equal(data.theta_i_deg, [0, 0, 0, 30, 30, 30])
    assert any("titles state theta_i_deg: 0, 30" in note for note in data.notes)


def test_a_table_without_the_title_of_the_others_is_refused(read, told):
    with pytest.raises(InputRefusedError) as refused:
        read(*BLOCK, "AOI: 30 deg", *BLOCK[1:], **PLANE)
    told(str(refused.value), "row 2", "theta_i_deg", "title")


@pytest.mark.parametrize("sign", ["", "# "])
def test_tables_below_each_other_whose_titles_differ_otherwise_are_refused(sign, read, told):
    table = headed()
    with pytest.raises(InputRefusedError) as refused:
        read(f"{sign}s-polarised", *table, f"{sign}p-polarised", *table, **PLANE)
    told(str(refused.value), "p-polarised", "s-polarised", "column")
    # What records a run is no condition.
    assert len(read(f"{sign}run a", *table, f"{sign}run b", *table, **PLANE)) == 12


def test_a_remark_between_tables_does_not_disturb_them(read):
    data = read("AOI 15 deg", *BLOCK, "TIS: 0.43", "", "AOI 45 deg", *BLOCK, **PLANE)
    np.testing.assert_array_equal(data.theta_i_deg, [15, 15, 15, 45, 45, 45])


def test_titles_of_tables_may_be_comments(read):
    data = read("# AOI 0 deg", *BLOCK, "# AOI 30 deg", *BLOCK, **PLANE)
    np.testing.assert_array_equal(data.theta_i_deg, [0, 0, 0, 30, 30, 30])


@pytest.mark.parametrize("title", ["AOI: 45 deg", "# theta_i = 45 deg"])
def test_a_title_that_the_caller_contradicts_is_refused(title, read, refused):
    with refused("row 1", "theta_i_deg", "45", "30"):
        read(title, *BLOCK, theta_i_deg=30, **PLANE)
    assert read(title, *BLOCK, theta_i_deg=45, **PLANE).theta_i_deg[0] == 45


ABOVE = ["Sample,White ink", "Wavelength,550 nm", "Mode: Transmission", "Angle of incidence = 30°"]
ALONE = ["Detector angle,BSDF (1/sr)", *(f"{k},0.19" for k in (-50, -40, 0, 10, 20, 40))]


@pytest.mark.parametrize("sign", ["", "# "], ids=["lines", "comments"])
def test_what_stands_alone_above_a_table_is_of_all_its_rows(sign, read):
    data = read(*(f"{sign}{line}" for line in ABOVE), *ALONE, signed_angles=True)
    assert set(data.wavelength_nm) == {550.0}
    assert set(data.theta_i_deg) == {30.0}
    assert data.is_transmission.all()
    for name, row in (("wavelength_nm", 2), ("side", 3), ("theta_i_deg", 4)):
        assert any(f"no column {name}; row {row} above it states" in note for note in data.notes)


@pytest.mark.parametrize(
    ("title", "asked"),
    [
        ("Reference wavelength: 633 nm", "wavelength_nm"),
        ("Wavelength: 633 nm", "wavelength_nm"),
        ("Wavelength: 0.55 um", "wavelength_nm"),
        ("Reflectance standard: Spectralon", "side"),
        ("Mode: Reflection", "side"),
    ],
)
def test_what_is_about_something_else_or_has_two_values_is_asked_for(title, asked, read, refused):
    about = {"wavelength_nm": "Wavelength", "side": "Mode"}[asked]
    # Of two values, the other one is in the block.
    others = ABOVE if title.startswith(about) and "um" not in title else [t for t in ABOVE if about not in t]
    with refused(asked):
        read(title, *others, *ALONE, signed_angles=True)


def test_the_caller_is_asked_where_a_title_says_otherwise(read, refused):
    with refused("row 2", "wavelength_nm = 550", "633"):
        read(*ABOVE, *ALONE, signed_angles=True, wavelength_nm=633)


def test_the_specular_direction_may_be_negative(read, told):
    lines = ["AOI,Detector angle,BRDF", *(f"45,{k},{5 if k == -45 else 0.2}" for k in (-60, -45, 0, 45, 60))]
    with pytest.raises(InputRefusedError) as refused:
        read(*lines, **PLANE)
    told(str(refused.value), "row 3", "--signed-angles --phi-deg 0")
    assert read(*lines, phi_deg=0, **PLANE).phi_deg.tolist() == [180, 180, 0, 0, 0]
    assert read(*lines, phi_deg=180, **PLANE).phi_deg.tolist() == [0, 0, 180, 180, 180]


def test_azimuths_of_a_matrix_may_count_from_the_specular_side(read, refused):
    lines = ["theta_i = 45 deg", "{}", "40,7.3,0.2,0.2", "60,0.3,0.2,0.2", "20,0.3,0.2,0.2"]
    plain = {"wavelength_nm": 550, "side": "R"}
    with refused("side of the source", "add 180"):
        read("\n".join(lines).format("theta_r \\ phi,0,90,180"), **plain)
    data = read("\n".join(lines).format("theta_o_deg \\ phi_deg,0,90,180"), **plain)
    assert data.phi_deg[0] == 0


def test_german_tables_below_a_title_with_commas_are_split_at_semicolons(read):
    title = "Messung vom 3.4., Probe 4, 550 nm"
    data = read(title, "Winkel;Wert", "-10;0,21", "0;0,25", theta_i_deg=0, **PLANE, **RENAMED)
    np.testing.assert_array_equal(data.bsdf_per_sr, [0.21, 0.25])


RENAMED = {"columns": {"theta_o_deg": "Winkel", "bsdf_per_sr": "Wert"}}


def test_a_header_that_is_repeated_is_skipped(read):
    rows = headed()
    data = read(*rows[:4], rows[0], *rows[4:], **PLANE)
    assert len(data) == 6
    assert any("header is repeated once" in note for note in data.notes)


def test_values_by_the_number_in_their_brackets_are_no_choice(read, refused):
    with refused("BRDF(0) to BRDF(60)", "AOI 30 deg"):
        read("theta_o,BRDF(0),BRDF(30),BRDF(60)", "10,0.1,0.2,0.3", "20,0.1,0.2,0.3", wavelength_nm=550)


SAVED = ["30 0 0 0.2", "30 30 180 2.1", "30 60 180 0.12", "30 60 0 0.1"]
NAMES = ["theta_i", "theta_o", "phi", "BRDF[1/sr]"]


@pytest.mark.parametrize(
    ("header", "delimiter"),
    [(" ".join(NAMES), " "), ("# " + " ".join(NAMES), " "), ("# " + ",".join(NAMES), " ")]
    + [("# " + ", ".join(NAMES), ", "), ("#" + "\t".join(NAMES), "\t"), ("   ".join(NAMES), "   ")],
)
def test_tables_as_programs_save_them_are_read(header, delimiter, read):
    lines = [line.replace(" ", delimiter) for line in SAVED]
    data = read("# lambda = 550 nm", header, *lines)
    np.testing.assert_array_equal(data.theta_o_deg, [0, 30, 60, 60])
    np.testing.assert_array_equal(data.phi_deg, [0, 180, 180, 0])
    np.testing.assert_array_equal(data.bsdf_per_sr, [0.2, 2.1, 0.12, 0.1])
    assert set(data.wavelength_nm) == {550.0}
    np.testing.assert_array_equal(data.row, [3, 4, 5, 6])


def test_a_comment_that_is_no_header_stays_one(read, refused):
    with refused("row 2", "header"):
        read("# ink, white, thick, dry", *(line.replace(" ", ",") for line in SAVED), wavelength_nm=550)


def test_a_row_of_other_length_is_no_table_of_spaces(read, refused):
    with refused("row 6", "3 words", "commas"):
        read(" ".join(NAMES), *SAVED, "30 60 180", wavelength_nm=550)


def test_azimuths_of_view_are_not_replaced_by_the_sign_of_the_angle(read, refused):
    header = "theta_i,theta_s,phi_s,BRDF"
    rows = ["30,10,0,0.2", "30,30,0,2.1", "30,30,180,0.1"]
    with refused("row 4", "phi_s", "--signed-angles"):
        read(header, *rows, wavelength_nm=550, signed_angles=True)
    data = read(header, *rows[:2], "30,-30,0,0.1", wavelength_nm=550, signed_angles=True)
    np.testing.assert_array_equal(data.phi_deg, [180, 180, 0])
