"""Files of measurements as people have them, all made from one BSDF, so that what is read can be compared."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from tests.measurement import layouts
from tests.measurement.layouts import EXIT, INCIDENCE, shown, write_csv, write_workbook

HEADER = ["theta_i_deg", "theta_o_deg", "phi_deg", "wavelength_nm", "side", "bsdf_per_sr"]
GERMAN = [
    "Einfallswinkel [°]",
    "Ausfallswinkel [°]",
    "Azimut [°]",
    "Wellenlänge [nm]",
    "Seite",
    "BSDF [1/sr]",
]
FRENCH = ["angle d'incidence (degrés)", "angle d'observation (degrés)", "azimut relatif"]
FRENCH += ["longueur d'onde (nm)", "côté", "BSDF"]
JAPANESE = ["入射角（度）", "受光角（度）", "相対方位角", "波長（nm）", "side", "BSDF値"]


def truth(theta_i, theta_o, phi, nm=550.0, side="R"):
    """Different in every direction; exactly representable with seven digits."""
    along = theta_o * np.round(np.cos(np.deg2rad(phi)), 9)
    level = np.where(np.asarray(side) == "R", 0.2, 0.12)
    return np.round(level + 0.0008 * theta_i - 0.0006 * along + 0.0001 * (np.asarray(nm, float) - 550), 7)


def value(theta_i, signed_theta_o, nm=550.0, side="R"):
    """In the plane of incidence, positive towards the peak."""
    return float(truth(theta_i, abs(signed_theta_o), 180 if signed_theta_o >= 0 else 0, nm, side))


def rows(sides="R", incidences=(0, 30), nm=550.0, factor=1.0):
    """Rows of the usual columns."""
    return [
        [i, o, phi, nm, side, round(factor * float(truth(i, o, phi, nm, side)), 7)]
        for side in sides
        for i in incidences
        for o, phi in ((0, 0), (20, 180), (20, 0), (50, 90), (60, 180))
    ]


def without(table, *names):
    """A table without some of its columns."""
    keep = [j for j, name in enumerate(table[0]) if name not in names]
    return [[row[j] for j in keep] for row in table]


def with_column(table, name, cells):
    """A table with another column."""
    return [[*row, cell] for row, cell in zip(table, [name, *cells], strict=True)]


def changed(table, name, change):
    """A table with another column of values."""
    j = table[0].index(name)
    return [table[0], *([*row[:j], change(row[j], row), *row[j + 1 :]] for row in table[1:])]


def matrix(corner, down=EXIT, along=INCIDENCE, of=lambda o, i: value(i, o)):
    """A corner and one edge, then the other edge and the values, those of `truth` if not others."""
    return layouts.matrix(corner, down, along, of)


TIDY = [HEADER, *rows()]
BOTH = [HEADER, *rows("RT")]
SIGNED = [["theta_i", "theta_o", "BSDF"], *([i, o, value(i, o)] for i in (0, 30) for o in EXIT)]
Maker = Callable[[Path], object]


def csv(table, delimiter=",", comma=False) -> Maker:
    """A CSV file of cells."""
    return lambda path: write_csv(path, table, delimiter, comma)


def text(content, encoding="utf-8") -> Maker:
    """A text file."""
    return lambda path: path.write_bytes(content.encode(encoding))


def encoded(table, delimiter, encoding, mark=b"") -> Maker:
    """A text file of cells in another encoding."""
    lines = "\r\n".join(delimiter.join(shown(cell) for cell in row) for row in table)
    return lambda path: path.write_bytes(mark + lines.encode(encoding))


def binary(content) -> Maker:
    """A file of bytes."""
    return lambda path: path.write_bytes(content)


def book(**sheets) -> Maker:
    """A workbook; the names of its sheets have spaces for underscores."""
    return lambda path: write_workbook(
        path, {name.replace("_", " "): table for name, table in sheets.items()}
    )


@dataclasses.dataclass(frozen=True)
class Situation:
    """A row of the page.

    Parameters
    ----------
    what
        What there is.
    files
        Files by name.
    options
        Options of ``jaxink convert``.
    values
        Number of values that are read; None: it is refused.
    named
        What the refusal names.
    then
        Options with which it is read after all; None: the file has to be changed.
    then_values
        Number of values that these read.
    is_truth
        Whether all values are those of `truth` (of `tests.formats.files.bsdf` for exchange files).
    """

    what: str
    files: dict[str, Maker]
    options: str = ""
    values: int | None = None
    named: Sequence[str] = ()
    then: str | None = None
    then_values: int = 0
    is_truth: bool = True
