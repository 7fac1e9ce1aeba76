"""Files as other programs write them: each is the plain file, and its notes say what was understood."""

import zipfile

import numpy as np
import pytest

from jaxink.measurement import read, read_csv, read_workbook
from tests.measurement.bad_inputs import GOOD, HEADER, without

NAMES = HEADER.split(",")


@pytest.fixture
def plain(tmp_path):
    path = tmp_path / "plain.csv"
    path.write_text("\n".join(GOOD))
    return read(path)


def with_commas(lines, separator=";"):
    return [
        lines[0].replace(",", separator),
        *(line.replace(",", separator).replace(".", ",") for line in lines[1:]),
    ]


UNITS = "deg,°,degrees,nm,,1/sr,sr^-1"
UNDERSTOOD = {
    "decimal commas": ("\n".join(with_commas(GOOD)), 0, "row 2"),
    "decimal commas and tabs": ("\n".join(with_commas(GOOD, "\t")), 0, "row 2"),
    "row of units": ("\n".join([GOOD[0], UNITS, *GOOD[1:]]), 1, "Row 2"),
    "units in brackets": ("\n".join([GOOD[0], "[deg],[deg],(deg),nm,-,1/sr,-", *GOOD[1:]]), 1, "Row 2"),
    "title": ("\n".join(["White ink", "Lab 7; 3.5.2024, by Ann", "", *GOOD]), 3, "row 4"),
    "title in quotes": ("\n".join(['"White ink on theta_i_deg', *GOOD]), 1, "row 2"),
    "UTF-16": (("\ufeff" + "\r\n".join(GOOD)).encode("utf-16-le"), 0, "UTF-16"),
    "UTF-16, other order": (("\ufeff" + "\n".join(GOOD)).encode("utf-16-be"), 0, "UTF-16"),
    "Latin-1": ("\n".join([GOOD[0], UNITS, *GOOD[1:]]).encode("latin-1"), 1, "row 2"),
    "all at once": (
        ("\ufeff" + "\n".join(["Weiße Farbe", *with_commas([GOOD[0], UNITS, *GOOD[1:]])])).encode("utf-16"),
        2,
        "row 4",
    ),
}


@pytest.mark.parametrize("name", UNDERSTOOD)
def test_understood_and_said(name, plain, tmp_path, told):
    content, shift, named = UNDERSTOOD[name]
    path = tmp_path / "plain.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    data = read(path)
    assert any(named in note for note in data.notes)
    for note in data.notes:
        told(note)
    np.testing.assert_array_equal(data.row, plain.row + shift)
    assert data.replace(notes=(), row=plain.row).equals(plain)


def test_decimal_commas_in_quotes_and_in_other_columns(tmp_path):
    lines = [GOOD[0] + ",time_s,date,place"]
    for line in GOOD[1:]:
        cells = [f'"{cell.replace(".", ",")}"' for cell in line.split(",")]
        lines.append(",".join([*cells, '"1,5"', "3.5.2024", '"B 1,5"']))
    path = tmp_path / "plain.csv"
    path.write_text("\n".join(lines))
    data = read(path)
    np.testing.assert_array_equal(data.bsdf_per_sr, [0.30, 0.29, 0.28, 0.27, 0.21])
    np.testing.assert_array_equal(data.extra["time_s"], 1.5)
    assert set(data.extra["date"]) == {"3.5.2024"}
    assert set(data.extra["place"]) == {"B 1,5"}


def test_text_in_latin1_is_kept(tmp_path):
    path = tmp_path / "plain.csv"
    path.write_bytes(
        "\n".join([GOOD[0] + ",remark", *(f"{line},5 µm" for line in GOOD[1:])]).encode("latin-1")
    )
    assert set(read(path).extra["remark"]) == {"5 µm"}


# A scan through the normal: the peak at +30 degrees, the source at -30 degrees.
SCAN = ["-60,0.1", "-30,0.2", "0,0.3", "30,0.5", "60,0.4"]


def signed(tmp_path, phi=None, theta_i="30"):
    lines = ["theta_i_deg,theta_o_deg,bsdf_per_sr" + ",phi_deg" * (phi is not None)]
    lines += [f"{theta_i},{line}" + (f",{phi}" if phi is not None else "") for line in SCAN]
    path = tmp_path / "signed.csv"
    path.write_text("\n".join(lines))
    return path


STATED = {"wavelength_nm": 550, "side": "R", "signed_angles": True}


@pytest.mark.parametrize(
    ("phi", "expected"),
    [
        (None, [0, 0, 180, 180, 180]),
        (180, [0, 0, 180, 180, 180]),
        (0, [180, 180, 0, 0, 0]),
        (90, [-90, -90, 90, 90, 90]),
        (-45, [135, 135, -45, -45, -45]),
    ],
)
def test_signed_angles(phi, expected, tmp_path, told):
    data = read(signed(tmp_path, phi), **STATED)
    np.testing.assert_array_equal(data.theta_o_deg, [60, 30, 0, 30, 60])
    np.testing.assert_array_equal(data.phi_deg, expected)
    for note in data.notes:
        told(note)
    assert any("2 negative" in note and "row 2" in note for note in data.notes)


def test_signed_angles_are_refused_unless_stated(tmp_path, refused):
    with refused("signed.csv", "phi_deg", "--signed-angles"):
        read(signed(tmp_path), wavelength_nm=550, side="R")
    with refused("row 2", "theta_o_deg", "--signed-angles"):
        read(signed(tmp_path, 180), wavelength_nm=550, side="R")


def test_signed_incidence_has_two_meanings(tmp_path, refused):
    with refused("row 2", "theta_i_deg"):
        read(signed(tmp_path, theta_i="-30"), **STATED)


def test_options_of_the_command_are_named(tmp_path, refused):
    path = tmp_path / "plain.csv"
    path.write_bytes(without("side"))
    with refused("--side R"):
        read(path)
    path.write_bytes(without("wavelength_nm"))
    with refused("--wavelength-nm"):
        read(path)


@pytest.mark.parametrize("name", ["old.xls", "table.numbers", "page.pdf", "data", "data.h5"])
def test_files_of_other_kinds_are_to_be_saved_as_csv(name, tmp_path, refused):
    (tmp_path / name).write_bytes(b"something")
    with refused(name, "CSV"):
        read(tmp_path / name)


# Workbooks.


def number(cell):
    try:
        return float(cell)
    except ValueError:
        return cell or None


def workbook(path, sheets):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append([number(cell) for cell in row])
    book.save(path)
    return path


ROWS = [line.split(",") for line in GOOD]


def test_excel_is_the_same_measurement(plain, tmp_path, told):
    path = workbook(tmp_path / "plain.xlsx", {"Data": ROWS, "Sheet2": []})
    data = read(path)
    told("\n".join(data.notes), "Data")
    np.testing.assert_array_equal(data.row, plain.row)
    assert data.replace(notes=(), source=plain.source).equals(plain)


def test_excel_with_title_units_gaps_and_text(plain, tmp_path, told):
    rows = [
        ["White ink"],
        [],
        NAMES,
        ["deg", "deg", "deg", "nm", None, "1/sr", "1/sr"],
        *ROWS[1:3],
        [],
        *ROWS[3:],
    ]
    path = workbook(tmp_path / "plain.xlsx", {"Data": [[cell or "" for cell in row] for row in rows]})
    data = read(path)
    for note in data.notes:
        told(note)
    np.testing.assert_array_equal(data.row, [5, 6, 8, 9, 10])
    assert data.replace(notes=(), source=plain.source, row=plain.row).equals(plain)


OPENDOCUMENT = """<?xml version="1.0" encoding="UTF-8"?>
<office:document-content xmlns:office="urn:oasis:names:tc:opendocument:xmlns:office:1.0"
 xmlns:table="urn:oasis:names:tc:opendocument:xmlns:table:1.0"
 xmlns:text="urn:oasis:names:tc:opendocument:xmlns:text:1.0"><office:body><office:spreadsheet>
<table:table table:name="Data">{}</table:table><table:table table:name="Sheet2">
<table:table-row table:number-rows-repeated="1048576">
<table:table-cell table:number-columns-repeated="16384"/></table:table-row></table:table>
</office:spreadsheet></office:body>
</office:document-content>"""
TEXT = "<table:table-cell><text:p>{}</text:p></table:table-cell>"
VALUE = '<table:table-cell office:value-type="float" office:value="{}"><text:p>~</text:p></table:table-cell>'
ROW = "<table:table-row>{}</table:table-row>"
EMPTY = (
    '<table:table-row table:number-rows-repeated="{0}">'
    '<table:table-cell table:number-columns-repeated="{0}"/></table:table-row>'
)


def opendocument(path, rows):
    """As LibreOffice writes it, with rows and cells that are repeated."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("content.xml", OPENDOCUMENT.format("".join(rows)))
    return path


def cells(line):
    return [(TEXT if cell[:1].isalpha() else VALUE).format(cell) for cell in line.split(",")]


def test_opendocument_is_the_same_measurement(plain, tmp_path, told):
    rows = [ROW.format("".join(cells(line))) for line in GOOD]
    # The title and the gap are repeated cells and rows; the figures displayed are not those stored.
    title = ROW.format(TEXT.format("White <text:span>ink</text:span>"))
    path = opendocument(
        tmp_path / "plain.ods", [title, EMPTY.format(3), *rows[:3], EMPTY.format(2), *rows[3:]]
    )
    data = read(path)
    for note in data.notes:
        told(note)
    np.testing.assert_array_equal(data.row, [6, 7, 10, 11, 12])
    assert data.replace(notes=(), source=plain.source, row=plain.row).equals(plain)


def test_repeated_cells_of_an_opendocument(tmp_path):
    header = ROW.format("".join(cells("theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr")))
    zeros = '<table:table-cell table:number-columns-repeated="3" office:value-type="float" office:value="0"/>'
    row = ROW.format(zeros + "".join(cells("550,R,0.25")))
    twice = row.replace("table-row>", 'table-row table:number-rows-repeated="2">', 1)
    data = read(opendocument(tmp_path / "repeated.ods", [header, twice]))
    np.testing.assert_array_equal(data.row, [2, 3])
    np.testing.assert_array_equal(data.theta_o_deg, 0)


@pytest.mark.parametrize("what", ["rows", "columns"])
@pytest.mark.parametrize("number", ["999999999999", "x"])
def test_absurd_repetitions_of_an_opendocument(what, number, tmp_path, refused):
    row = ROW.format("".join(cells(GOOD[1])))
    tag = {"rows": "table-row", "columns": "table-cell"}[what]
    row = row.replace(f"<table:{tag}", f'<table:{tag} table:number-{what}-repeated="{number}"', 1)
    with refused("absurd.ods"):
        read(opendocument(tmp_path / "absurd.ods", [ROW.format("".join(cells(HEADER))), row]))


SCANS = [(0, 10, 0.3), (0, 20, 0.29), (30, 10, 0.28), (30, 20, 0.27)]


def beside_its_scan(angles, empty):
    """Rows of two scans, whose angle of incidence stands beside the first row of each."""
    header = ["theta_i_deg", "phi_deg", "theta_o_deg", "wavelength_nm", "side", "bsdf_per_sr"]
    firsts = [angles[0], empty, angles[1], empty]
    azimuths = [180, *[empty] * 3]
    return header, [[i, p, o, 550, "R", v] for i, p, (_, o, v) in zip(firsts, azimuths, SCANS, strict=True)]


def test_merged_cells_stand_beside_all_their_rows(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    header, rows = beside_its_scan((0, 30), None)
    book = openpyxl.Workbook()
    book.active.append(["White ink"])
    book.active.merge_cells("A1:F1")
    for row in [header, *rows]:
        book.active.append(row)
    for area in ("A3:A4", "A5:A6", "B3:B6"):
        book.active.merge_cells(area)
    book.save(tmp_path / "merged.xlsx")

    name = '<table:table-cell table:number-rows-spanned="{}" table:number-columns-spanned="1" '
    first = [name.format(n) + VALUE.partition(" ")[2] for n in (2, 4)]
    covered = '<table:covered-table-cell table:number-columns-repeated="2"/>'
    lines = [ROW.format("".join(cells(",".join(header))))]
    for k, (_, _, *rest) in enumerate(rows):
        own = "".join(cells(",".join(map(str, rest))))
        angle = first[0].format(SCANS[k][0])
        above = "<table:covered-table-cell/>"
        lines.append(ROW.format([angle + first[1].format(180), covered, angle + above, covered][k] + own))
    written = opendocument(tmp_path / "merged.ods", lines)

    for path in (tmp_path / "merged.xlsx", written):
        data = read(path)
        got = zip(data.theta_i_deg, data.theta_o_deg, data.bsdf_per_sr, strict=True)
        assert list(got) == SCANS
        assert set(data.phi_deg) == {180.0}


def test_a_value_above_empty_cells_is_asked_for_in_every_row(tmp_path, refused):
    header, rows = beside_its_scan((0, 30), "")
    rows[2][0] = ""
    path = tmp_path / "once.csv"
    path.write_text("\n".join(",".join(map(str, row)) for row in [header, *rows]))
    with refused("once.csv", "row 3", "theta_i_deg", "every row"):
        read(path)


def test_sheet_is_chosen(tmp_path, refused):
    other = [ROWS[0], *([*row[:5], "0.5", "0.01"] for row in ROWS[1:])]
    path = workbook(tmp_path / "two.xlsx", {"first": ROWS, "second": other})
    with refused("first, second", "--sheet"):
        read(path)
    with refused("third", "first, second"):
        read(path, sheet="third")
    assert set(read(path, sheet="second").bsdf_per_sr) == {0.5}


def test_empty_cells_of_a_sheet_have_their_row(tmp_path, refused):
    rows = [list(row) for row in ROWS]
    rows[3][5] = ""
    with refused("row 4", "bsdf_per_sr"):
        read(workbook(tmp_path / "gap.xlsx", {"a": rows}))


@pytest.mark.parametrize("rows", [[], [NAMES], [["x"] * 3, ["1"] * 4]], ids=["empty", "header", "long row"])
def test_bad_sheets(rows, tmp_path, refused):
    with refused("bad.xlsx"):
        read(workbook(tmp_path / "bad.xlsx", {"a": rows}))


def test_damaged_workbooks(tmp_path, refused):
    path = tmp_path / "bad.xlsx"
    path.write_bytes(b"no zip archive")
    with refused("bad.xlsx", "CSV"):
        read(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("[Content_Types].xml", "<broken")
    with refused("bad.xlsx", "CSV"):
        read(path)


def test_a_workbook_that_unpacks_to_too_much(tmp_path, monkeypatch, refused):
    path = workbook(tmp_path / "large.xlsx", {"a": ROWS})
    monkeypatch.setattr("jaxink.measurement.workbook._MOST_UNPACKED_BYTES", 1000)
    with refused("large.xlsx", numbers=False):
        read(path)


def test_a_row_number_beyond_excel_ends(tmp_path, refused):
    """Rows are counted up to the number that the file states."""
    path = workbook(tmp_path / "far.xlsx", {"a": ROWS})
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    sheet = "xl/worksheets/sheet1.xml"
    members[sheet] = (
        members[sheet].replace(b'<row r="6"', b'<row r="999999999999"').replace(b'6"', b'999999999999"')
    )
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    with refused("far.xlsx"):
        read(path)


def test_excel_without_openpyxl(tmp_path, monkeypatch, refused):
    path = workbook(tmp_path / "plain.xlsx", {"a": ROWS})
    monkeypatch.setitem(__import__("sys").modules, "openpyxl", None)
    with refused("plain.xlsx", "openpyxl", "CSV"):
        read_workbook(path)


# Several files.


def files(tmp_path, **contents):
    paths = []
    for name, lines in contents.items():
        paths.append(tmp_path / f"{name}.csv")
        paths[-1].write_text("\n".join(lines))
    return paths


TRANSMITTED = [GOOD[0], *(line.replace(",R,", ",T,") for line in GOOD[1:4])]


def test_rows_of_several_files_are_joined(plain, tmp_path, told):
    paths = files(tmp_path, R=GOOD, T=["# far side", *TRANSMITTED])
    data = read(paths)
    assert (len(data), data.source) == (8, "R.csv + T.csv")
    np.testing.assert_array_equal(data.row, [2, 3, 4, 5, 6, 3, 4, 5])
    np.testing.assert_array_equal(data.is_transmission, [False] * 5 + [True] * 3)
    assert data.extra["source_file"].tolist() == ["R.csv"] * 5 + ["T.csv"] * 3
    assert [data.place(point) for point in (0, 7)] == ["row 2 of R.csv", "row 5 of T.csv"]
    assert (np.diff(data.reading_order) > 0).all()
    for note in data.notes:
        told(note)
    assert any(note.startswith("T.csv: ") for note in data.notes)
    part = data.select(side="R")
    assert part.place(0) == "row 2 of R.csv"
    assert part.replace(source=plain.source, notes=(), extra={}).equals(plain)


def test_one_file_in_a_list_is_that_file(plain, tmp_path):
    assert read([tmp_path / "plain.csv"]).equals(plain)
    assert plain.place(0) == "row 2"
    np.testing.assert_array_equal(plain.reading_order, plain.row)


def test_joined_files_survive_netcdf(tmp_path):
    data = read(files(tmp_path, R=GOOD, T=TRANSMITTED))
    data.to_netcdf(tmp_path / "both.nc")
    again = read(tmp_path / "both.nc")
    assert again.equals(data)
    assert again.place(7) == "row 4 of T.csv"


def test_columns_that_one_file_lacks_are_empty_there(tmp_path):
    reflected = [GOOD[0] + ",time_s,serial", *(f"{line},1.5,007" for line in GOOD[1:])]
    transmitted = [TRANSMITTED[0] + ",serial,remark", *(f"{line},8,x" for line in TRANSMITTED[1:])]
    data = read(files(tmp_path, R=reflected, T=transmitted))
    np.testing.assert_array_equal(data.extra["time_s"], [1.5] * 5 + [np.nan] * 3)
    assert data.extra["serial"].tolist() == ["007"] * 5 + ["8"] * 3
    assert data.extra["remark"].tolist() == [""] * 5 + ["x"] * 3


def test_a_side_for_each_file(tmp_path, refused):
    lines = without("side").decode().splitlines()
    paths = files(tmp_path, R=lines, T=lines)
    np.testing.assert_array_equal(read(paths, side=["R", "T"]).is_transmission, [False] * 5 + [True] * 5)
    with refused("3", "2"):
        read(paths, side=["R", "T", "R"])


def test_directions_of_two_files_are_repeats(tmp_path, told):
    data = read(files(tmp_path, R=GOOD, again=[GOOD[0], GOOD[3].replace("0.28", "0.281")]))
    told(data.notes[-1], "row 4 of R.csv", "row 2 of again.csv")


def test_copies_in_two_files_do_not_look_like_perfect_repeats(tmp_path):
    from jaxink.measurement import estimate_noise

    assert estimate_noise(read(files(tmp_path, R=GOOD, copy=GOOD))).model is None


NEEDED = [line.rsplit(",", 1)[0] for line in GOOD]


def lit(side):
    return [GOOD[0] + ",lit_side", *(f"{line},{side}" for line in GOOD[1:])]


@pytest.mark.parametrize(
    ("one", "other", "named"),
    [
        (GOOD, NEEDED, "two.csv"),
        (lit("ink"), lit("plate"), "row 2 of two.csv"),
        (
            [GOOD[0] + ",sample", *(f"{line},a" for line in GOOD[1:])],
            [TRANSMITTED[0] + ",sample", *(f"{line},b" for line in TRANSMITTED[1:])],
            "sample",
        ),
        (GOOD, [GOOD[0], "0,10,180,550,R,,0.003"], "two.csv, row 2"),
    ],
    ids=["sigma in one", "conditions", "samples", "bad row"],
)
def test_files_that_do_not_belong_together(one, other, named, tmp_path, refused):
    with refused(named):
        read(files(tmp_path, one=one, two=other))


def test_files_of_the_same_name_in_two_folders(tmp_path):
    paths = [tmp_path / day / "scan.csv" for day in ("monday", "tuesday")]
    for path, lines in zip(paths, (GOOD, TRANSMITTED), strict=True):
        path.parent.mkdir()
        path.write_text("\n".join(lines))
    data = read(paths)
    assert data.source == f"{paths[0]} + {paths[1]}"
    assert data.place(7) == f"row 4 of {paths[1]}"


def test_a_file_twice_and_none(tmp_path, refused):
    (path,) = files(tmp_path, R=GOOD)
    with refused("R.csv"):
        read([path, path])
    with refused("file"):
        read([])


def test_a_sheet_of_a_text_file(tmp_path, refused):
    (path,) = files(tmp_path, R=GOOD)
    with refused("sheet"):
        read(path, sheet="a")
    assert len(read_csv(path)) == 5
