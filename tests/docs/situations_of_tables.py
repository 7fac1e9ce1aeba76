"""Tables, matrices and workbooks as people have them: rows of the page of as_people_have_it.py."""

import codecs

import numpy as np

from tests.docs.situation_files import (
    EXIT,
    FRENCH,
    GERMAN,
    HEADER,
    INCIDENCE,
    JAPANESE,
    SIGNED,
    TIDY,
    Situation,
    binary,
    book,
    changed,
    csv,
    encoded,
    matrix,
    rows,
    text,
    truth,
    value,
    with_column,
    without,
)
from tests.measurement.layouts import shown


def _wide(unit=""):
    along = [450, 550, 650]
    head = ["theta_i_deg", "theta_o_deg", "phi_deg", "side", *(f"{nm}{unit}" for nm in along)]
    directions = [(0, 20, 180), (30, 20, 0), (30, 50, 90)]
    return [head, *([i, o, p, "R", *(float(truth(i, o, p, nm)) for nm in along)] for i, o, p in directions)]


def _blocks(titles, make):
    table = []
    for title, entry in titles:
        table += [[title], *make(entry), []]
    return table


_PER_WAVELENGTH = _blocks(
    [(f"Wavelength: {nm} nm, reflection", nm) for nm in (450, 550)],
    lambda nm: matrix("theta_o \\ theta_i", of=lambda o, i: value(i, o, nm)),
)
_PER_AZIMUTH = _blocks(
    [(f"Incidence azimuth {a}°", a) for a in (0, 90)],
    lambda a: matrix("theta_o \\ theta_i", (10, 40), of=lambda o, i: float(truth(i, o, 180 - a))),
)
_PER_INCIDENCE = _blocks(
    [(f"Einfallswinkel {i} Grad", i) for i in (0, 30)],
    lambda i: matrix("Ausfallswinkel \\ Azimut", (10, 40), (0, 90, 180), lambda o, p: float(truth(i, o, p))),
)
_SIDE_BY_SIDE = [
    [*a, "", *b] for a, b in zip(matrix("theta_o \\ theta_i"), matrix("theta_o \\ theta_i"), strict=True)
]
_PLANE = "--wavelength-nm 550 --side R --signed-angles"
_NO_SIDE = without(TIDY, "side")
_ZEROS = changed(TIDY, "bsdf_per_sr", lambda v, row: 0 if row[:3] == [0, 20, 0] else v)
_COSINE = changed(TIDY, "bsdf_per_sr", lambda v, row: v * np.cos(np.deg2rad(row[1])))

TABLES = (
    Situation("one row for each value, the usual names", {"ink.csv": csv(TIDY)}, values=10),
    Situation(
        "German Excel: semicolons, decimal commas, German names with units",
        {"Messung.csv": csv([GERMAN, *rows()], ";", comma=True)},
        values=10,
    ),
    Situation(
        "Japanese names, tabs, UTF-16", {"測定.txt": encoded([JAPANESE, *rows()], "\t", "utf-16")}, values=10
    ),
    Situation(
        "French names in Latin-1, the byte-order mark of UTF-8 forgotten",
        {"mesure.csv": encoded([FRENCH, *rows()], ";", "cp1252")},
        values=10,
    ),
    Situation(
        "UTF-8 with a byte-order mark, comments with #",
        {"ink.csv": encoded([["# a comment"], *TIDY], ",", "utf-8", codecs.BOM_UTF8)},
        values=10,
    ),
    Situation(
        "title lines above the header, a row of units below it",
        {
            "ink.csv": csv(
                [["White ink, 3 May"], [], HEADER, ["deg", "deg", "deg", "nm", "", "1/sr"], *rows()]
            )
        },
        values=10,
    ),
    Situation(
        "azimuths of the light and of the view, instead of their difference",
        {
            "ink.csv": csv(
                with_column(
                    changed(
                        [[*HEADER[:2], "phi_o", *HEADER[3:]], *rows()], "phi_o", lambda p, _: (p + 45) % 360
                    ),
                    "phi_i",
                    [45] * 10,
                )
            )
        },
        values=10,
    ),
    Situation(
        "scans in the plane of incidence with signed angles, no azimuth",
        {"scan.csv": csv(SIGNED)},
        "--wavelength-nm 550 --side R",
        named=("phi_deg", "--signed-angles"),
        then=_PLANE,
        then_values=10,
    ),
    Situation(
        "neither wavelength nor side",
        {"ink.csv": csv(without(TIDY, "side", "wavelength_nm"))},
        named=("--wavelength-nm", "--side"),
        then="--wavelength-nm 550 --side R",
        then_values=10,
    ),
    Situation(
        "the header says BTDF",
        {"ink.csv": csv([[*HEADER[:4], "BTDF"], *without([HEADER, *rows("T")], "side")[1:]])},
        values=10,
    ),
    Situation(
        "one file for each incidence, which no column states",
        {f"{i}deg.csv": csv(without([HEADER, *rows(incidences=(i,))], "theta_i_deg")) for i in (0, 30)},
        named=("theta_i_deg", "--theta-i-deg"),
        then="--theta-i-deg 0,30",
        then_values=10,
    ),
    Situation(
        "one file for reflection, one for transmission",
        {f"{s}.csv": csv(without([HEADER, *rows(s)], "side")) for s in "RT"},
        named=("side", "--side R,T"),
        then="--side R,T",
        then_values=20,
    ),
    Situation(
        "names of one's own",
        {"ink.csv": csv([[*HEADER[:1], "arm", *HEADER[2:]], *rows()])},
        named=("arm", "--columns"),
        then="--columns theta_o_deg=arm",
        then_values=10,
    ),
    Situation("values times the cosine, by agreement", {"ink.csv": csv(_COSINE)}, "--cosine-weighted", 10),
    Situation(
        "values times the cosine, by their name",
        {"ink.csv": csv([[*HEADER[:5], "bsdf_cos"], *_COSINE[1:]])},
        named=("bsdf_cos", "--cosine-weighted"),
        then="--cosine-weighted",
        then_values=10,
    ),
    Situation(
        "values in per cent",
        {
            "ink.csv": csv(
                [[*HEADER[:5], "bsdf_percent"], *changed(TIDY, "bsdf_per_sr", lambda v, _: 100 * v)[1:]]
            )
        },
        named=("per cent",),
    ),
    Situation(
        "reflectance factors",
        {"ink.csv": csv([[*HEADER[:5], "reflectance_factor"], *rows(factor=np.pi)])},
        named=("divide by pi",),
    ),
    Situation(
        "angles in radians",
        {
            "ink.csv": csv(
                [HEADER, *([*(round(a * np.pi / 180, 5) for a in row[:3]), *row[3:]] for row in rows())]
            )
        },
        named=("180/pi",),
    ),
    Situation(
        "wavelengths in micrometres",
        {"ink.csv": csv([[*HEADER[:3], "wavelength [µm]", *HEADER[4:]], *rows(nm=0.55)])},
        named=("1000",),
    ),
    Situation(
        "direction cosines",
        {
            "ink.csv": csv(
                [["theta_i_deg", "u_x", "u_y", "wavelength_nm", "side", "bsdf"], [0, 0.1, 0.2, 550, "R", 0.2]]
            )
        },
        named=("direction cosine",),
    ),
    Situation(
        "several samples in one file",
        {"inks.csv": csv(with_column(TIDY, "sample", ["white"] * 5 + ["red"] * 5))},
        named=("white, red", "--which"),
        then="--which white",
        then_values=5,
    ),
    Situation(
        "two polarisations in one file",
        {
            "ink.csv": csv(
                [
                    [*HEADER, "polarisation"],
                    *([*row, p] for p, f in (("s", 1), ("p", 0.9)) for row in rows(factor=f)),
                ]
            )
        },
        named=("polarisation",),
        then="--rows polarisation=s",
        then_values=10,
    ),
    Situation(
        "an empty cell",
        {"ink.csv": csv(changed(TIDY, "bsdf_per_sr", lambda v, row: "" if row[1] == 60 else v))},
        named=("row 6", "empty"),
    ),
    Situation(
        "NaN written as 0, at one direction",
        {"ink.csv": csv(_ZEROS)},
        values=10,
        is_truth=False,
    ),
    Situation(
        "decimal commas between commas",
        {"ink.csv": text("\n".join(",".join(shown(c, comma=True) for c in row) for row in TIDY))},
        named=("decimal commas",),
    ),
    Situation(
        "columns separated by spaces",
        {"ink.txt": text("\n".join(" ".join(shown(c) for c in row) for row in TIDY))},
        values=10,
    ),
    Situation(
        "columns separated by spaces, one of them with an empty cell",
        {"ink.txt": text("\n".join(" ".join(shown(c) for c in row) for row in [*TIDY, TIDY[1][:-1]]))},
        named=("row 12", "5 words", "commas"),
    ),
    Situation(
        "as numpy.savetxt writes it: spaces, names in a comment",
        {"ink.txt": text("# " + "\n".join(" ".join(map(shown, row)) for row in without(TIDY, "side")))},
        "--side R",
        values=10,
    ),
    Situation(
        "wavelength and side in lines above the header",
        {
            "ink.csv": csv(
                [["Wavelength", "550 nm"], ["Mode", "Reflection"], *without(TIDY, "side", "wavelength_nm")]
            )
        },
        values=10,
    ),
)
MATRICES = (
    Situation(
        "exit angles down, incidence along, both named in the corner",
        {"matrix.csv": csv(matrix("theta_o \\ theta_i"))},
        _PLANE,
        15,
    ),
    Situation(
        "the other way round, in Excel",
        {"matrix.xlsx": book(Sheet1=matrix("AOI \\ viewing angle", INCIDENCE, EXIT, value))},
        _PLANE,
        15,
    ),
    Situation(
        "labels above and aside, in Excel",
        {
            "matrix.xlsx": book(
                Sheet1=[
                    ["White ink"],
                    ["", "", "Angle of incidence [°]"],
                    *(["Exit angle" if k == 3 else "", *row] for k, row in enumerate(matrix(""))),
                ]
            )
        },
        _PLANE,
        15,
    ),
    Situation(
        "German matrix: titles, decimal commas",
        {
            "Matrix.csv": csv(
                [["BRDF, λ = 550 nm"], *matrix("Ausfallswinkel \\ Einfallswinkel")], ";", comma=True
            )
        },
        "--signed-angles",
        15,
    ),
    Situation(
        "nothing in the corner",
        {"matrix.csv": csv(matrix(""))},
        _PLANE,
        named=("row 1", "0, 15, 40", "--matrix"),
        then=f"{_PLANE} --matrix theta_o_deg,theta_i_deg",
        then_values=15,
    ),
    Situation(
        "a slash in the corner, which does not say what is where",
        {"matrix.xlsx": book(Sheet1=matrix("theta_o/theta_i"))},
        _PLANE,
        named=("theta_o/theta_i", "--matrix"),
        then=f"{_PLANE} --matrix theta_o_deg,theta_i_deg",
        then_values=15,
    ),
    Situation(
        "numbers only, as from Matlab",
        {"matrix.csv": csv(matrix(0))},
        _PLANE,
        named=("--matrix",),
        then=f"{_PLANE} --matrix theta_o_deg,theta_i_deg",
        then_values=15,
    ),
    Situation(
        "one matrix for each wavelength, with titles", {"m.csv": csv(_PER_WAVELENGTH)}, "--signed-angles", 30
    ),
    Situation(
        "one matrix for each azimuth of the light",
        {"m.csv": csv(_PER_AZIMUTH)},
        "--wavelength-nm 550 --side R",
        named=("phi_i_deg", "--phi-o-deg"),
        then="--wavelength-nm 550 --side R --phi-o-deg 180",
        then_values=12,
    ),
    Situation(
        "one matrix of exit angles and azimuths for each incidence",
        {"m.xlsx": book(Tabelle1=_PER_INCIDENCE)},
        "--wavelength-nm 550 --side R",
        12,
    ),
    Situation(
        "exit angles without a sign, no azimuth",
        {"m.csv": csv(matrix("theta_o \\ theta_i", (0, 30, 60)))},
        "--wavelength-nm 550 --side R",
        named=("phi_deg", "--phi-deg"),
        then="--wavelength-nm 550 --side R --phi-deg 180",
        then_values=9,
    ),
    Situation(
        "directions that were not measured: empty cells",
        {"m.csv": csv([*matrix("theta_o \\ theta_i")[:-1], [60, "", value(15, 60), ""]])},
        _PLANE,
        13,
    ),
    Situation(
        "directions that were not measured: n/a",
        {"m.csv": csv([*matrix("theta_o \\ theta_i")[:-1], [60, "n/a", value(15, 60), value(40, 60)]])},
        _PLANE,
        named=("row 6, column 2", "n/a"),
    ),
    Situation(
        "two matrices side by side", {"m.csv": csv(_SIDE_BY_SIDE)}, _PLANE, named=("row 1", "side by side")
    ),
    Situation("a spectrum beside each direction: 450 nm, 550 nm", {"wide.csv": csv(_wide(" nm"))}, values=9),
    Situation(
        "a spectrum beside each direction: R_400 to R_760",
        {
            "wide.csv": csv(
                [
                    ["theta_i", "theta_o", "phi", *(f"R_{nm}" for nm in range(400, 761, 10))],
                    [0, 20, 180, *[0.2] * 37],
                ]
            )
        },
        named=("37 columns", "R_400 to R_760"),
    ),
    Situation(
        "a spectrum beside each direction: 450, 550",
        {"wide.csv": csv(_wide())},
        named=("450, 550, 650", "--matrix wavelength_nm"),
        then="--matrix wavelength_nm",
        then_values=9,
    ),
)
WORKBOOKS = (
    Situation(
        "a sheet with values, another one with remarks",
        {"ink.xlsx": book(Remarks=[["Operator", "x"]], Data=TIDY)},
        values=10,
    ),
    Situation(
        "sheets Reflexion and Transmission without a column for the side",
        {"ink.xlsx": book(Reflexion=_NO_SIDE, Transmission=without([HEADER, *rows("T")], "side"))},
        named=("Reflexion, Transmission", "--sheet"),
        then="--sheet Reflexion,Transmission",
        then_values=20,
    ),
    Situation(
        "sheets with other names",
        {"ink.xlsx": book(Tab_1=_NO_SIDE, Tab_2=without([HEADER, *rows("T")], "side"))},
        '--sheet "Tab 1,Tab 2"',
        named=("side", "--sheet A=R,B=T"),
        then='--sheet "Tab 1=R,Tab 2=T"',
        then_values=20,
    ),
    Situation(
        "a matrix on each sheet",
        {
            "ink.xlsx": book(
                BRDF=matrix("theta_o \\ theta_i"),
                BTDF=matrix("theta_o \\ theta_i", of=lambda o, i: value(i, o, side="T")),
            )
        },
        "--sheet BRDF,BTDF --wavelength-nm 550 --signed-angles",
        30,
    ),
    Situation("Excel 2003", {"ink.xls": binary(b"\xd0\xcf\x11\xe0rest")}, named=("2003", "CSV")),
    Situation("a workbook with the suffix .csv", {"ink.csv": book(Sheet1=TIDY)}, named=(".xlsx",)),
)
