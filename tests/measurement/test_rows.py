"""Of a file with several conditions, the rows of one are read."""

import numpy as np
import pytest

import jaxink
from jaxink.measurement.reader import read_conditions
from jaxink.measurement.rows import condition_of, with_rows_of
from jaxink.measurement.text_file import read_table
from tests.measurement.layouts import write_workbook

HEADER = ["theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr"]
VIEWS = (0, 20, 40, 60)
STATES = (("plate", 30), ("ink", 30), ("ink", 75.5))


def table(lit="Lit side", thickness="thickness (um)"):
    """Four directions of each state, each with another level."""
    rows = [
        [30, view, 180, 550, "R", 0.2 + 0.1 * level + view / 1000, side, um]
        for level, (side, um) in enumerate(STATES)
        for view in VIEWS
    ]
    return [[*HEADER, lit, thickness], *rows]


def written(folder, cells, separator=","):
    path = folder / "gonio.csv"
    path.write_text("\n".join(separator.join(map(str, row)) for row in cells))
    return path


def levels(data):
    return np.unique(np.round(data.bsdf_per_sr - data.theta_o_deg / 1000, 6)).tolist()


@pytest.mark.parametrize(
    ("rows", "wanted"),
    [
        ({"Lit side": "plate"}, [0.2]),
        ({"lit_side": " plate "}, [0.2]),
        ({"lit side": "ink", "thickness (um)": "30.0"}, [0.3]),
        ({"lit_side": "ink", "thickness_um": 75.5}, [0.4]),
        ({"thickness_um": 75.5}, [0.4]),
    ],
)
def test_the_rows_of_one_condition_are_read(rows, wanted, tmp_path, told):
    data = jaxink.read(written(tmp_path, table()), rows=rows)
    assert levels(data) == wanted
    told(data.notes[-1])
    assert len(data.attrs) == len(rows)
    assert data.row[0] == 2 + 4 * [0.2, 0.3, 0.4].index(wanted[0])


def test_tables_in_memory_and_sheets(tmp_path):
    head, *body = table()
    frame = {name: [row[k] for row in body] for k, name in enumerate(head)}
    assert levels(jaxink.read(frame, rows={"thickness_um": 75.5})) == [0.4]
    write_workbook(tmp_path / "gonio.xlsx", {"Tab": table()})
    data = jaxink.read(tmp_path / "gonio.xlsx", sheet="Tab", rows={"lit_side": "plate"})
    assert levels(data) == [0.2]


def test_decimal_commas_are_numbers(tmp_path):
    cells = [[str(cell).replace(".", ",") for cell in row] for row in table()]
    data = jaxink.read(written(tmp_path, cells, ";"), rows={"thickness_um": 75.5})
    assert levels(data) == [0.4]


def test_any_column_may_choose(tmp_path):
    head, *body = table()
    cells = [[*head, "polarisation"], *([*row, "sp"[k % 2]] for k, row in enumerate(body))]
    data = jaxink.read(written(tmp_path, cells), rows={"polarisation": "p", "lit_side": "plate"})
    assert data.theta_o_deg.tolist() == [20, 60]


def test_a_sample_is_chosen_by_either_keyword(tmp_path):
    path = written(tmp_path, table(lit="sample"))
    chosen = jaxink.read(path, sample="plate")
    again = jaxink.read(path, rows={"sample": "plate"})
    assert chosen.replace(notes=()).equals(again.replace(notes=()))


BAD = {
    "no column": ({"lamp": "a"}, ("lamp", "Lit side")),
    "no cell": ({"lit_side": "top"}, ("Lit side", "top", "plate, ink")),
    "no number": ({"thickness_um": 31}, ("thickness (um)", "31", "30, 75.5")),
    "never together": ({"lit_side": "plate", "thickness_um": 75.5}, ("lit_side", "thickness_um")),
    "a list": ({"lit_side": ["ink"]}, ("rows", "lit_side")),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_choice_is_refused(case, tmp_path, refused):
    rows, named = BAD[case]
    path = written(tmp_path, table())
    with refused(path, *named):
        jaxink.read(path, rows=rows)


def test_rows_are_given_by_column(tmp_path, refused):
    with refused("gonio.csv", "rows", "lit_side"):
        with_rows_of(read_table(written(tmp_path, table())), "ink", [])


def test_two_columns_of_one_condition_are_refused(tmp_path, refused):
    path = written(tmp_path, table("lit layer", "illuminated side"))
    with refused(path, "lit layer", "illuminated side"):
        jaxink.read(path, rows={"lit_side": "ink"})
    with refused(path, "lit layer", "illuminated side"):
        read_conditions(path)


def test_a_column_of_one_value_does_not_compete(tmp_path):
    head, *body = table("lit layer")
    path = written(tmp_path, [[*head, "illuminated side"], *([*row, "left"] for row in body)])
    (found,) = read_conditions(path)
    assert found.columns["lit_side"].heading == "lit layer"
    assert levels(jaxink.read(path, rows={"lit_side": "plate"})) == [0.2]


def test_files_without_columns_take_no_rows(tmp_path, refused):
    path = written(tmp_path, table())
    jaxink.read(path, rows={"thickness_um": 75.5}).to_netcdf(tmp_path / "ink.nc")
    with refused("ink.nc", "rows"):
        jaxink.read(tmp_path / "ink.nc", rows={"lit_side": "ink"})
    assert read_conditions(tmp_path / "ink.nc") == []


@pytest.mark.parametrize(
    ("heading", "condition"),
    [
        ("lit_side", ("lit_side", "")),
        ("Illuminated Side", ("lit_side", "")),
        ("Specimen", ("sample", "")),
        ("Thickness [µm]", ("thickness_um", "um")),
        ("film_thickness_um", ("thickness_um", "um")),
        ("thickness", ("thickness_um", "")),
        ("thickness, mm", ("thickness_um", "mm")),
        ("card", ("backing", "")),
        ("side", None),
        ("cardinal", None),
    ],
)
def test_headings_of_conditions(heading, condition):
    assert condition_of(heading) == condition


def test_the_conditions_of_a_file(tmp_path):
    (found,) = read_conditions(written(tmp_path, table()), rows={"lit_side": "ink"})
    assert found.kept.tolist() == [False] * 4 + [True] * 8
    assert list(found.columns) == ["lit_side", "thickness_um"]
    assert found.columns["thickness_um"].heading == "thickness (um)"
    assert found.lines[0] == 2
