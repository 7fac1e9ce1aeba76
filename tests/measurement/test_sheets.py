"""Several sheets of a workbook are joined, each with its side."""

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.measurement.names import side_in_words
from jaxink.measurement.sheets import chosen
from tests.measurement.layouts import matrix, write_workbook

HEADER = ["Einfallswinkel", "Ausfallswinkel", "Azimut", "Wellenlänge [nm]", "BSDF"]


def table(level, side=None):
    rows = [[30, angle, 180, 550, level + angle / 1000] for angle in (0, 10, 20)]
    if side is None:
        return [HEADER, *rows]
    return [[*HEADER, "Seite"], *([*row, side] for row in rows)]


@pytest.mark.parametrize(
    ("names", "sheet"),
    [
        (("Reflexion", "Transmission"), "Reflexion,Transmission"),
        (("Reflexion", "Transmission"), ["Reflexion", "Transmission"]),
        (("R", "T"), "R,T"),
        (("反射率", "透過率"), "反射率,透過率"),
        (("BRDF 550nm", "BTDF 550nm"), "BRDF 550nm,BTDF 550nm"),
        (("Tab 1", "Tab 2"), "Tab 1=R,Tab 2=T"),
        (("Tab 1", "Tab 2"), {"Tab 1": "R", "Tab 2": "T"}),
        # Without regard to case, where that is unique.
        (("Reflexion", "Transmission"), "reflexion,TRANSMISSION"),
        (("Tab 1", "Tab 2"), "tab 1=R,tab 2=T"),
        # Stated for the sheet, against its name.
        (("Transmission", "Reflexion"), "Transmission=R,Reflexion=T"),
        (("a,b", "c=d"), ["a,b=R", "c=d=T"]),
    ],
)
def test_sheets_are_joined_with_their_sides(names, sheet, tmp_path):
    path = write_workbook(tmp_path / "ink.xlsx", {names[0]: table(0.2), "Log": [["x"]], names[1]: table(0.5)})
    data = jaxink.read(path, sheet=sheet)
    np.testing.assert_array_equal(data.side, [*"RRRTTT"])
    np.testing.assert_allclose(data.bsdf_per_sr, [0.2, 0.21, 0.22, 0.5, 0.51, 0.52])
    assert data.place(4) == f"row 3 of ink.xlsx, sheet {names[1]}"


def test_case_decides_between_names_that_differ_in_nothing_else(tmp_path, refused):
    # A spreadsheet does not allow such names, but a program may write them.
    held = ["Scan", "SCAN"]
    assert chosen(tmp_path / "ink.ods", held, held, held, "SCAN") == [("SCAN", None)]
    with refused("ink.ods", "no sheet 'scan'"):
        chosen(tmp_path / "ink.ods", held, held, held, "scan")


def test_a_column_says_the_side_before_the_name_does(tmp_path):
    path = write_workbook(tmp_path / "ink.xlsx", {"R": table(0.2, "T"), "other": table(0.3, "R")})
    np.testing.assert_array_equal(jaxink.read(path, sheet="R,other").side, [*"TTTRRR"])


def test_one_sheet_has_the_side_of_its_name(tmp_path, refused):
    path = write_workbook(tmp_path / "ink.xlsx", {"Reflexion": table(0.2), "Transmission": table(0.5)})
    assert set(jaxink.read(path, sheet="Transmission").side) == {"T"}
    with refused("ink.xlsx", "--sheet NAME=T"):
        jaxink.read(path, sheet="Reflexion", side="T")


def test_sheets_of_several_files(tmp_path):
    sheets = {"R": table(0.2), "T": table(0.5)}
    paths = []
    for day in ("monday", "tuesday"):
        (tmp_path / day).mkdir()
        paths.append(write_workbook(tmp_path / day / "ink.xlsx", sheets))
    data = jaxink.read(paths, sheet="R,T")
    assert data.place(11) == f"row 4 of {paths[1]}, sheet T"
    np.testing.assert_array_equal(data.side, [*"RRRTTT"] * 2)


def test_sheets_with_matrices(tmp_path):
    rows = matrix("Ausfallswinkel \\ Einfallswinkel")
    path = write_workbook(
        tmp_path / "ink.xlsx", {"BRDF": [["λ", 450], *rows], "BTDF": [["λ", 450], [], *rows]}
    )
    data = jaxink.read(path, sheet="BRDF,BTDF", signed_angles=True)
    assert (len(data), set(data.wavelength_nm)) == (30, {450})
    np.testing.assert_array_equal(data.side, ["R"] * 15 + ["T"] * 15)


def test_what_is_noted_of_several_sheets_is_said_once(tmp_path, told):
    tables = {"R": table(0.2), "T": table(0.5), "T2": table(0.6, "T")}
    path = write_workbook(tmp_path / "ink.xlsx", tables)
    data = jaxink.read(path, sheet="R,T,T2")
    assert sum("'Ausfallswinkel'" in note for note in data.notes) == 1
    assert next(note for note in data.notes if "'Azimut'" in note).startswith("All sheets: ")
    told("\n".join(data.notes), "ink.xlsx, sheet T2: Column 'Seite'")
    two = jaxink.read(path, sheet="R,T")
    assert next(note for note in two.notes if "'Azimut'" in note).startswith("Both sheets: ")
    assert not any("The table is sheet" in note for note in two.notes)
    write_workbook(path, {"R": table(0.2), "T": table(0.5), "Z": [HEADER, [30, 0, 180, 550, "0,6"]]})
    mixed = jaxink.read(path, sheet="R=R,T=R,Z=T")
    said = next(note for note in mixed.notes if "not consecutive" in note or "comma" in note)
    assert said.startswith("ink.xlsx, sheet Z: ")


def test_a_note_of_some_sheets_names_them(tmp_path):
    side = [[*HEADER, "Seite"], *([30, angle, 180, 550, 0.3, "T"] for angle in (0, 10))]
    path = write_workbook(tmp_path / "ink.xlsx", {"A": side, "R": table(0.2), "B": side})
    (said,) = (note for note in jaxink.read(path, sheet="A,R,B").notes if "'Seite'" in note)
    assert said.startswith("ink.xlsx, sheets A, B: Column 'Seite'")


def test_a_sheet_without_numbers_is_not_meant(tmp_path):
    path = write_workbook(tmp_path / "ink.xlsx", {"Notes": [["operator", "x"]], "BTDF": table(0.2)})
    data = jaxink.read(path)
    assert set(data.side) == {"T"}
    assert any("Notes" in note for note in data.notes)


BAD = {
    "none is stated": (None, {}, "--sheet"),
    "no such sheet": ("one,three", {}, "three"),
    "an unknown side": ("one=X", {}, "one=R or one=T"),
    "twice": ("one,one", {"side": "R"}, "'one'"),
    "an empty one": ("one,empty", {"side": "R"}, "'empty'"),
    "no side": ("one,two", {}, "--sheet A=R,B=T"),
    "a side for each": ("one,two", {"side": ["R", "T"]}, "--sheet A=R,B=T"),
    "another side": ("one=R", {"side": "T"}, "side"),
    "numbers": ([1, 2], {}, "sheet"),
    "nothing": ("", {}, "one, two, empty"),
}


@pytest.mark.parametrize("name", BAD)
def test_refusals(name, tmp_path, told):
    path = write_workbook(tmp_path / "ink.xlsx", {"one": table(0.2), "two": table(0.3), "empty": []})
    sheet, stated, named = BAD[name]
    with pytest.raises(jaxink.InputRefusedError) as problem:
        jaxink.read(path, sheet=sheet, **stated)
    told(str(problem.value), named)


def test_the_command_joins_sheets(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_workbook(tmp_path / "ink.xlsx", {"Reflexion": table(0.2), "Tab": table(0.5)})
    done = CliRunner().invoke(app, ["convert", "ink.xlsx", "--sheet", "Reflexion,Tab=T", "--out", "tidy.csv"])
    assert done.exit_code == 0, done.stderr
    assert jaxink.read(tmp_path / "tidy.csv").side.tolist() == [*"RRRTTT"]


@pytest.mark.parametrize(
    ("text", "side"),
    [
        ("R", "R"),
        ("t 550 nm", "T"),
        ("Reflexion (30°)", "R"),
        ("white ink, transmission", "T"),
        ("反射率", "R"),
    ]
    + [
        (text, None)
        for text in ("", "Sample R", "T 2", "R1", "R und T", "Reflexion, Transmission", "angle of reflection")
    ],
)
def test_sides_in_words(text, side):
    assert side_in_words(text) == side
