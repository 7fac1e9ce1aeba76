"""Files with values in a matrix and workbooks, made cell by cell for the tests."""

import csv

import numpy as np

EXIT, INCIDENCE = (-60, -30, 0, 30, 60), (0, 15, 40)


def value(theta_i, theta_o, wavelength_nm=550.0):
    """Different in every direction; theta_o has a sign."""
    return round(0.2 + 0.001 * theta_i - 0.0007 * theta_o + 0.0001 * (wavelength_nm - 550), 6)


def matrix(corner, down=EXIT, along=INCIDENCE, of=lambda o, i: value(i, o)):
    """Rows of cells: the corner and one edge, then the other edge and the values."""
    return [[corner, *along], *([d, *(of(d, a) for a in along)] for d in down)]


def shown(cell, comma=False):
    text = "" if cell is None else str(cell)
    return text.replace(".", ",") if comma and isinstance(cell, float) else text


def write_csv(path, rows, delimiter=",", comma=False):
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, delimiter=delimiter).writerows([shown(c, comma) for c in row] for row in rows)
    return path


def write_workbook(path, sheets):
    import openpyxl

    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append([None if cell == "" else cell for cell in row])
    book.save(path)
    return path


def write(path, rows):
    """CSV or Excel, as the suffix says."""
    return write_workbook(path, {"Sheet1": rows}) if path.suffix == ".xlsx" else write_csv(path, rows)


def directions(data):
    """The value of each direction, theta_o with its sign in the plane of incidence."""
    sign = np.where(data.phi_deg == 0, -1.0, 1.0)
    columns = data.wavelength_nm, data.side, data.theta_i_deg, sign * data.theta_o_deg
    keys = zip(*(column.tolist() for column in columns), strict=True)
    return {(w, s, i, o + 0.0): v for (w, s, i, o), v in zip(keys, data.bsdf_per_sr.tolist(), strict=True)}


def expected(wavelengths=(550.0,), sides="R", down=EXIT, along=INCIDENCE):
    return {
        (w, s, float(i), float(o)): value(i, o, w)
        for w in wavelengths
        for s in sides
        for o in down
        for i in along
    }
