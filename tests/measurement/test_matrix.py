"""Matrices of values, with their angles along two edges, give each value its own directions."""

import re
import shlex

import numpy as np
import pytest
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.measurement.matrix import corner
from jaxink.measurement.titles import edge_cell, facts
from tests.measurement.layouts import (
    EXIT,
    INCIDENCE,
    directions,
    expected,
    matrix,
    value,
    write,
    write_csv,
    write_workbook,
)

OF_ALL = {"wavelength_nm": 550, "side": "R", "signed_angles": True}
OTHER_WAY = matrix("AOI [deg] \\ viewing angle [deg]", INCIDENCE, EXIT, value)
NAMED = {
    "backslash": matrix("theta_o \\ theta_i"),
    "other way round": OTHER_WAY,
    "German": matrix("Ausfallswinkel [°] \\ Einfallswinkel [°]"),
    "Japanese": matrix("受光角\\入射角"),
    "arrows behind": matrix("θo ↓ θi →"),
    "arrows before": matrix("→ θi / ↓ θo"),
    "label above": [["", "angle of incidence"], *matrix("exit angle")],
    "labels above": [["viewing angle", "", "incidence angle (deg)"], *matrix("")],
    "labels aside": [
        ["", "", "Incidence angle [°]"],
        ["", "", *INCIDENCE],
        *(["Exit angle" if k == 2 else "", *row] for k, row in enumerate(matrix("")[1:])),
    ],
    "titles say": [["Series 4"], ["rows: exit angle; columns: incidence angle"], [], *matrix("deg")],
    "titles behind": [["Ausfallswinkel (Zeilen)"], ["Einfallswinkel (Spalten)"], *matrix("")],
    "cells say": [["theta_o", *(f"theta_i = {i}°" for i in INCIDENCE)], *matrix("")[1:]],
    "descending": matrix("theta_o \\ theta_i", EXIT[::-1], INCIDENCE[::-1]),
}


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@pytest.mark.parametrize("name", NAMED)
def test_edges_that_are_named(name, suffix, tmp_path):
    data = jaxink.read(write(tmp_path / f"m{suffix}", NAMED[name]), **OF_ALL)
    assert directions(data) == expected()


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@pytest.mark.parametrize(
    ("corner", "says"),
    [
        ("", "empty"),
        ("angle", "angle"),
        ("theta_o/theta_i", "theta_o/theta_i"),
        ("in x out", "in x out"),
        (0, "0"),
    ],
)
def test_edges_that_are_not_known_are_refused_with_a_command_that_reads_them(
    corner, says, suffix, tmp_path, monkeypatch, told
):
    monkeypatch.chdir(tmp_path)
    file = write(tmp_path / f"m{suffix}", matrix(corner)).name
    options = ["--wavelength-nm", "550", "--side", "R", "--signed-angles"]

    def convert(*more):
        return CliRunner().invoke(app, ["convert", file, "--out", "tidy.csv", *options, *more])

    refused = convert()
    assert refused.exit_code == 5
    told(refused.stderr, file, "row 1", says, "15", numbers=False)
    (option,) = re.findall(r"--matrix [a-z_,]+", refused.stderr)
    done = convert(*shlex.split(option))
    assert done.exit_code == 0, done.stderr
    assert directions(jaxink.read(tmp_path / "tidy.csv")) == expected()


@pytest.mark.parametrize(
    ("corner", "down", "along", "offered"),
    [
        ("", EXIT, INCIDENCE, ["theta_o_deg,theta_i_deg"]),
        # Angles of incidence are not negative.
        ("", INCIDENCE, EXIT, ["theta_i_deg,theta_o_deg"]),
        ("", (0, 30, 60), (0, 15, 40), ["theta_o_deg,theta_i_deg", "theta_i_deg,theta_o_deg"]),
        ("\\ AOI", (0, 30, 60), (0, 15, 40), ["theta_o_deg,theta_i_deg"]),
        ("", (0, 30, 60), (0, 90, 270), ["theta_o_deg,phi_deg"]),
        ("", (0, 30, 60), (400, 500, 600), ["theta_o_deg,wavelength_nm"]),
        ("", (250, 300), (0, 30, 60), ["wavelength_nm,theta_o_deg"]),
        ("", (0, 30, 60), (30000, 50000), []),
    ],
)
def test_only_possible_edges_are_offered(corner, down, along, offered, tmp_path):
    path = write_csv(tmp_path / "m.csv", matrix(corner, down, along, lambda o, i: 0.2))
    with pytest.raises(jaxink.InputRefusedError) as problem:
        jaxink.read(path, side="R")
    assert re.findall(r"--matrix ([a-z_,]+)", str(problem.value)) == offered


def test_only_one_edge_is_named(tmp_path, refused):
    path = write_csv(tmp_path / "m.csv", matrix("exit angle"))
    with refused("row 1", "--matrix theta_o_deg,theta_i_deg"):
        jaxink.read(path, **OF_ALL)
    assert directions(jaxink.read(path, **OF_ALL, matrix="theta_i_deg")) == expected()
    with refused("theta_o_deg", "theta_i_deg"):
        jaxink.read(path, **OF_ALL, matrix="theta_i_deg,theta_o_deg")
    with refused("theta", "wavelength_nm"):
        jaxink.read(path, **OF_ALL, matrix="theta,wavelength_nm")


BLOCKS = {
    "wavelengths": [f"Wavelength: {w} nm, transmission" for w in (450, 550, 650)],
    "one cell each": [["λ [nm]", w, "", "BTDF"] for w in (450, 550, 650)],
    "the side once": ["Transmission at wavelength 450 nm", "wavelength 550 nm", "wavelength = 650"],
}


@pytest.mark.parametrize("suffix", [".csv", ".xlsx"])
@pytest.mark.parametrize("name", BLOCKS)
def test_blocks_with_titles(name, suffix, tmp_path):
    wavelengths = (450.0, 550.0, 650.0)
    rows = [["Measured on Monday"], []]
    for title, w in zip(BLOCKS[name], wavelengths, strict=True):
        rows += [title if isinstance(title, list) else [title]]
        rows += [*matrix("theta_o \\ theta_i", of=lambda o, i, w=w: value(i, o, w)), []]
    data = jaxink.read(write(tmp_path / f"blocks{suffix}", rows), signed_angles=True)
    assert directions(data) == expected(wavelengths, "T")


def test_azimuths_of_incidence_in_titles(tmp_path, refused):
    rows = []
    for azimuth in (0, 90, 180):
        rows += [[f"azimuth of incidence = {azimuth}°"], *matrix("theta_o \\ theta_i", (10, 20, 30))]
    path = write_csv(tmp_path / "blocks.csv", rows)
    with refused("phi_i_deg", "--phi-o-deg"):
        jaxink.read(path, wavelength_nm=550, side="R")
    data = jaxink.read(path, wavelength_nm=550, side="R", phi_o_deg=180)
    assert sorted(set(data.phi_deg)) == [0, 90, 180]
    # The first block has the light at azimuth 0.
    assert set(data.phi_deg[:9]) == {180}


def test_incidences_in_titles_and_azimuths_along(tmp_path):
    rows = []
    for theta_i in (0, 30):
        rows += [[f"Einfallswinkel {theta_i} Grad"]]
        rows += matrix(
            "Ausfallswinkel \\ Azimut", (10, 40), (0, 60, 180), lambda o, p, i=theta_i: 0.1 + i + o + p
        )
        rows += [[]]
    path = write_csv(tmp_path / "blocks.csv", rows, ";")
    data = jaxink.read(path, wavelength_nm=550, side="T")
    np.testing.assert_allclose(data.bsdf_per_sr, 0.1 + data.theta_i_deg + data.theta_o_deg + data.phi_deg)


def test_decimal_commas_and_titles(tmp_path):
    rows = [["BRDF, λ = 632,8 nm"], ["Probe: weiß"], *matrix("Ausfallswinkel\\Einfallswinkel")]
    path = write_csv(tmp_path / "m.csv", rows, ";", comma=True)
    data = jaxink.read(path, signed_angles=True)
    assert set(data.wavelength_nm) == {632.8}
    np.testing.assert_allclose(list(directions(data).values()), list(expected().values()))


@pytest.mark.parametrize("along", [["450 nm", "550 nm"], [450, 550]])
def test_spectra_beside_each_direction(along, tmp_path, refused, told):
    rows = [["theta_i_deg", "theta_o_deg", "phi_deg", "side", *along]]
    rows += [[0, 10, 180, "R", 0.31, 0.32], [30, 20, 0, "T", 0.21, 0.22]]
    path = write_csv(tmp_path / "wide.csv", rows)
    stated = {}
    if along[0] == 450:
        with pytest.raises(jaxink.InputRefusedError) as problem:
            jaxink.read(path)
        told(str(problem.value), "row 1", "450, 550", "--matrix wavelength_nm")
        stated = {"matrix": "wavelength_nm"}
    data = jaxink.read(path, **stated)
    np.testing.assert_array_equal(data.wavelength_nm, [450, 550, 450, 550])
    np.testing.assert_array_equal(data.bsdf_per_sr, [0.31, 0.32, 0.21, 0.22])
    np.testing.assert_array_equal(data.side, ["R", "R", "T", "T"])


def test_a_wide_table_is_one_short_sentence(tmp_path):
    angles = list(range(-90, 91, 5))
    rows = [["theta_i_deg", "wavelength_nm", *angles], *([i, 550, *([0.3] * len(angles))] for i in (0, 30))]
    with pytest.raises(jaxink.InputRefusedError) as problem:
        jaxink.read(write_csv(tmp_path / "wide.csv", rows), side="R")
    assert "-90, -85, -80, ..., 90" in str(problem.value)
    assert len(str(problem.value)) < 350


def changed(row, column, cell):
    rows = matrix("theta_o \\ theta_i")
    rows[row - 1] = [cell if j == column - 1 else old for j, old in enumerate(rows[row - 1])]
    return rows


BAD = {
    "text": (changed(3, 2, "n/a"), "row 3, column 2"),
    "nan": (changed(4, 4, "nan"), "row 4, column 4"),
    "too many": ([*matrix("theta_o \\ theta_i"), [75, 0.1, 0.1, 0.1, 0.1]], "row 7"),
    "stray": ([*matrix("theta_o \\ theta_i"), ["Mean", 0.1, 0.3, 0.2]], "row 7"),
    "twice": (matrix("theta_o \\ theta_o"), "theta_o_deg"),
    "two names": ([["rows: incidence angle"], *matrix("theta_o \\ theta_i")], "row 2"),
    "radians": (matrix("theta_o [rad] \\ theta_i"), "180/pi"),
    "title and edge": ([["theta_i = 5"], *matrix("theta_o \\ theta_i")], "row 1"),
    "two titles": ([["λ = 450"], ["λ = 500 nm"], *matrix("theta_o \\ theta_i")], "row 2"),
    "no title of the second": (
        [["x"], *matrix("theta_o \\ theta_i"), ["λ = 500 nm"], *matrix("theta_o \\ theta_i")],
        "row 2",
    ),
    "per cent": ([["BRDF [%]"], *matrix("theta_o \\ theta_i")], "row 1"),
    "standard deviations": ([["Standardabweichung"], *matrix("theta_o \\ theta_i")], "row 1"),
    "two samples": (
        [["Sample A"], *matrix("theta_o \\ theta_i"), ["Sample B"], *matrix("theta_o \\ theta_i")],
        "row 9",
    ),
    "side by side": (
        [[*a, *b] for a, b in zip(matrix("theta_o \\ theta_i"), matrix("theta_o \\ theta_i"), strict=True)],
        "row 1",
    ),
    "other edges": ([*matrix("theta_o \\ theta_i"), [], *matrix("theta_o \\ phi")], "row 8"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_matrices(name, tmp_path, told):
    rows, named = BAD[name]
    with pytest.raises(jaxink.InputRefusedError) as problem:
        jaxink.read(write_csv(tmp_path / "bad.csv", rows), side="R", signed_angles=True, wavelength_nm=None)
    told(str(problem.value), "bad.csv", named)


def test_empty_cells_are_no_readings(tmp_path):
    rows = changed(3, 2, "")
    rows[5][3] = None
    data = jaxink.read(write_csv(tmp_path / "gaps.csv", rows), **OF_ALL)
    left_out = {(550.0, "R", 0.0, -30.0), (550.0, "R", 40.0, 60.0)}
    assert directions(data) == {key: v for key, v in expected().items() if key not in left_out}
    assert any("2 cells" in note for note in data.notes)


def test_repeats_are_named(tmp_path):
    rows = []
    for repeat in (1, 2):
        rows += [[f"repeat {repeat}"], *matrix("theta_o \\ theta_i")]
    assert len(jaxink.read(write_csv(tmp_path / "m.csv", rows), **OF_ALL)) == 30


def test_rows_of_the_file_stay_known(tmp_path):
    rows = [["a title"], [], *matrix("theta_o \\ theta_i")]
    data = jaxink.read(write_workbook(tmp_path / "m.xlsx", {"x": rows}), **OF_ALL)
    np.testing.assert_array_equal(data.row, np.repeat([4, 5, 6, 7, 8], 3))


def test_missing_azimuths_are_stated(tmp_path, refused):
    path = write_csv(tmp_path / "m.csv", matrix("theta_o \\ theta_i", (0, 20, 40)))
    with refused("phi_deg", "--phi-deg", "--signed-angles"):
        jaxink.read(path, wavelength_nm=550, side="R")
    assert set(jaxink.read(path, wavelength_nm=550, side="R", phi_deg=90).phi_deg) == {90}


def test_no_matrix_where_the_caller_states_one(tmp_path, refused):
    rows = [["theta_i_deg", "theta_o_deg", "phi_deg", "bsdf"], [0, 10, 180, 0.3], [0, 20, 180, 0.2]]
    with refused("m.csv", "matrix"):
        jaxink.read(write_csv(tmp_path / "m.csv", rows), wavelength_nm=550, side="R", matrix="phi_deg")
    with refused("book.xlsx", "matrix"):
        jaxink.read(write(tmp_path / "book.xlsx", rows), wavelength_nm=550, side="R", matrix="phi_deg")


def test_corners():
    o, i = ("theta_o_deg", ""), ("theta_i_deg", "")
    assert corner("theta_o \\ theta_i") == [("rows", o), ("columns", i)]
    assert corner("θi→ θo↓") == [("columns", i), ("rows", o)]
    assert corner("exit angle") == [("rows", o)]
    assert corner("theta_o / theta_i") == corner("exit vs incidence") == corner("") == []


@pytest.mark.parametrize(
    ("text", "number", "name"),
    [("30", "30", ""), ("30°", "30", ""), ("-12,5 deg", "-12,5", ""), ("θi = 30°", "30", "theta_i_deg")],
)
def test_cells_of_an_edge(text, number, name):
    found = edge_cell(text)
    assert (found.number, found.name) == (number, name)


@pytest.mark.parametrize("text", ["", "x", "nan", "sample 3", "30 kg", "BRDF 3"])
def test_no_cells_of_an_edge(text):
    assert edge_cell(text) is None


@pytest.mark.parametrize(
    ("cells", "stated"),
    [
        (["λ = 632,8 nm"], {"wavelength_nm": "632,8"}),
        (["BTDF 550 nm"], {"wavelength_nm": "550", "side": "T"}),
        (["Reflexion, Einfallswinkel = 30°"], {"theta_i_deg": "30", "side": "R"}),
        (["Angle of reflection 30"], {"theta_o_deg": "30"}),
        (["Incidence azimuth", "", "45"], {"phi_i_deg": "45"}),
        (["# side: T"], {"side": "T"}),
        # A list, a thickness and a date state nothing.
        (["Wavelengths 450, 550, 650 nm"], {}),
        (["film of 200 nm"], {}),
        (["R and T of 3.4.2025"], {}),
        (["T = 23"], {}),
        (["T: 23 °C"], {}),
    ],
)
def test_what_titles_state(cells, stated):
    assert {fact.name: fact.text for fact in facts("m.csv", 1, cells)} == stated
