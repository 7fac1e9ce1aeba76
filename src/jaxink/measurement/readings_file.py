"""Readings from a CSV file, one row each, or from a file of inverse adding-doubling."""

import difflib
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from jaxink.errors import no_such_name
from jaxink.files.reading import open_bounded, read_bounded
from jaxink.measurement.adding_doubling import MAGIC, read_adding_doubling
from jaxink.measurement.checks import numbers
from jaxink.measurement.integra_regular import is_regular_file, read_regular
from jaxink.measurement.readings import IDEAL_SPHERE, QUANTITIES, Readings, Spheres
from jaxink.measurement.rows import with_decimal_points
from jaxink.measurement.spectrophotometer import is_spectrophotometer_file, read_spectrophotometer
from jaxink.measurement.table import TextTable, refusal
from jaxink.measurement.text_file import lines_of, read_table

_MOST_BYTES = 50_000_000
_ANGLES = ("theta_i_deg", "theta_o_deg", "phi_deg")
_SPHERE = ("sphere_wall_reflectance", "sphere_port_fraction", "sphere_reference")
_COLUMNS = (
    "quantity",
    "value",
    "value_percent",
    "sigma",
    "sigma_percent",
    "wavelength_nm",
    *_ANGLES,
    *_SPHERE,
)
# What fills the port while 100 % is read.
_PORTS = ("open", "closed")
_STATED = re.compile(r"\s*#\s*(sphere_\w*)\s*=\s*(.*?)\s*")
_SPECULAR_DEG = 180.0


_HEAD_BYTES = 20_000


def read_readings(
    path: str | Path,
    *,
    wavelength_nm: float | None = None,
    quantity: str | None = None,
    sample: str | None = None,
) -> Readings:
    """Read totals, regular light and reflectance factors.

    Parameters
    ----------
    path
        A CSV file (docs/manual/readings.md), one of inverse adding-doubling (``.rxt``), which begins with
        ``IAD1``, spectra of a spectrophotometer, CGATS text or CxF3, or regular light of Integra's programs
        (``.sdr``, ``.sdt``).
    wavelength_nm
        Wavelength of all readings, if the file does not state it.
    quantity, sample
        Of spectra of a spectrophotometer: what was read, if the file does not state its geometry, and
        identifier or name of the sample, if there are several. Of Integra's files: ``R_specular`` or
        ``T_collimated``, if the suffix does not tell.

    Raises
    ------
    InputRefusedError
        If the file is invalid; the message names file, row and column.
    """
    path = Path(path)
    head = _head(path)
    if is_spectrophotometer_file(head):
        if wavelength_nm is not None:
            raise refusal(path, "has wavelengths of its own; do not state wavelength_nm")
        return read_spectrophotometer(path, head, quantity, sample)
    if is_regular_file(head) and sample is None:
        return read_regular(path, wavelength_nm, quantity)
    for name, stated in (("quantity", quantity), ("sample", sample)):
        if stated is not None:
            raise refusal(path, f"is no file of a spectrophotometer (CGATS or CxF3); leave out {name}")
    if head.startswith(MAGIC):
        return read_adding_doubling(path, wavelength_nm)
    return _of_table(_known(read_table(path, _COLUMNS)), _stated_of_spheres(path), wavelength_nm)


def is_readings_file(path: str | Path) -> bool:
    """Whether a file holds readings, by its first word or its header."""
    head = _head(Path(path))
    if head.startswith(MAGIC) or is_spectrophotometer_file(head) or is_regular_file(head):
        return True
    rows = (line for line in head.splitlines() if line.strip() and not line.startswith("#"))
    names = {name.strip().lower() for name in next(rows, "").split(",")}
    return "quantity" in names and bool(names & {"value", "value_percent"})


def _head(path: Path) -> str:
    with open_bounded(path, _MOST_BYTES, "file of readings") as file:
        return file.read(_HEAD_BYTES).decode("utf-8", errors="replace")


def _known(table: TextTable) -> TextTable:
    """The table, if its columns are those of readings."""
    names, notes = table.names, list(table.notes)
    for name in names:
        if names.count(name) > 1:
            raise refusal(table.source, "the column occurs twice; keep one of them", column=name)
        near = difflib.get_close_matches(name, _COLUMNS, n=1)
        if name not in _COLUMNS and near:
            text = f"is not a column of readings; did you mean {near[0]}"
            raise refusal(table.source, text, table.header_line, name)
        if name not in _COLUMNS and name:
            notes.append(f"Column {name} is not used.")
    if "quantity" not in names:
        text = f"is missing; it says what each value is, one of: {', '.join(QUANTITIES)}"
        raise refusal(table.source, text, table.header_line, "quantity")
    for one, other in (("value", "value_percent"), ("sigma", "sigma_percent")):
        if {one, other} <= {*names}:
            raise refusal(table.source, f"is there beside {other}; keep one of them", table.header_line, one)
    if not {"value", "value_percent"} & {*names}:
        text = "is missing; add it, or value_percent for values in per cent"
        raise refusal(table.source, text, table.header_line, "value")
    known = {name: names.index(name) for name in _COLUMNS if name in names and name not in ("quantity",)}
    table = with_decimal_points(table, known, {}, notes)
    return TextTable(table.source, names, table.rows, table.lines, table.header_line, tuple(notes))


def _of_table(
    table: TextTable, of_sphere: dict[str, tuple[int, str]], wavelength_nm: float | None
) -> Readings:
    quantity = np.array(table.column(table.names.index("quantity")))
    for line, name in zip(table.lines, quantity.tolist(), strict=True):
        if name not in QUANTITIES:
            near = difflib.get_close_matches(name, QUANTITIES, n=1)
            text = f"is '{name}', {no_such_name(QUANTITIES, near[0] if near else None)}"
            raise refusal(table.source, text.rstrip(".?"), line, "quantity")
    if "wavelength_nm" in table.names:
        if wavelength_nm is not None:
            text = "is in the file; do not state another one"
            raise refusal(table.source, text, table.header_line, "wavelength_nm")
        wavelength = numbers(table, table.names.index("wavelength_nm"), "wavelength_nm")
    elif wavelength_nm is None:
        text = (
            "is missing; add it, or state the wavelength of all readings as wavelength_nm (in a project: "
            "reading = { wavelength_nm = <nm> })"
        )
        raise refusal(table.source, text, table.header_line, "wavelength_nm")
    else:
        wavelength = np.full(len(quantity), float(wavelength_nm))
    spheres, notes = _spheres(table, quantity, of_sphere)
    theta_i, theta_o, phi = _angles(table, quantity, notes)
    return Readings(
        quantity,
        theta_i,
        theta_o,
        phi,
        wavelength,
        _share(table, "value"),
        _share(table, "sigma") if {"sigma", "sigma_percent"} & {*table.names} else None,
        np.asarray(table.lines, np.int64),
        spheres,
        table.source,
        (*table.notes, *notes),
    )


def _share(table: TextTable, name: str) -> Float[np.ndarray, " readings"]:
    """A column of shares or of per cent."""
    if name in table.names:
        return numbers(table, table.names.index(name), name)
    return numbers(table, table.names.index(f"{name}_percent"), f"{name}_percent") / 100


def _optional(table: TextTable, name: str) -> Float[np.ndarray, " readings"]:
    """A column in which cells may be empty, nan there; all of them if it is missing."""
    values = np.full(len(table.rows), np.nan)
    if name not in table.names:
        return values
    column = table.names.index(name)
    filled = np.array([bool(cell) for cell in table.column(column)])
    if filled.any():
        rows = tuple(row for row, has in zip(table.rows, filled, strict=True) if has)
        values[filled] = numbers(table.with_rows(rows, np.asarray(table.lines)[filled]), column, name)
    return values


def _angles(table: TextTable, quantity: np.ndarray, notes: list[str]) -> list[Float[np.ndarray, " readings"]]:
    """Angles of each reading, with the usual ones in the place of those that are left out."""
    columns = []
    for name in _ANGLES:
        angle, taken = _optional(table, name), {}
        for kind in np.unique(quantity).tolist():
            of_kind = QUANTITIES[kind]
            usual = getattr(of_kind, name, _SPECULAR_DEG if of_kind.has_azimuth else None)
            empty = (quantity == kind) & np.isnan(angle)
            if usual is not None and empty.any():
                angle[empty] = usual
                taken[kind] = usual
        # The azimuth has no effect if one direction is the normal.
        if taken and name != "phi_deg":
            each = ", ".join(f"{usual:g} of {kind}" for kind, usual in taken.items())
            notes.append(f"{name} was not stated and taken as {each}.")
        columns.append(angle)
    return columns


def _stated_of_spheres(path: Path) -> dict[str, tuple[int, str]]:
    """Row and text of what comments say of the sphere, by key."""
    stated: dict[str, tuple[int, str]] = {}
    for row, line in enumerate(lines_of(path, read_bounded(path, _MOST_BYTES, "file of readings"), []), 1):
        if (found := _STATED.fullmatch(line)) is None:
            continue
        key, text = found.groups()
        if key not in _SPHERE:
            near = difflib.get_close_matches(key, _SPHERE, n=1)
            sentence = f"states {key}, {no_such_name(_SPHERE, near[0] if near else None)}"
            raise refusal(path, sentence.rstrip(".?"), row)
        if key in stated:
            raise refusal(path, f"states {key} again; state it once", row)
        stated[key] = row, text
    return stated


def _spheres(
    table: TextTable, quantity: np.ndarray, of_all: dict[str, tuple[int, str]]
) -> tuple[Spheres | None, list[str]]:
    """Sphere of each reading, from columns or comments, and a note on what is taken as ideal."""
    at_sphere = np.array([QUANTITIES[name].is_of_sphere for name in quantity.tolist()])
    for name in _SPHERE:
        if name in of_all and name in table.names:
            text = "is a column and in a comment above; state it once"
            raise refusal(table.source, text, table.header_line, name)
    wall, fraction = (_of_sphere(table, name, of_all, at_sphere) for name in _SPHERE[:2])
    if not np.isnan(wall).all() or not np.isnan(fraction).all() or _SPHERE[2] in (*of_all, *table.names):
        spheres = Spheres(wall, fraction, _reference(table, quantity, wall, of_all))
        is_ideal = (at_sphere & np.isnan(wall)).any()
        notes = [IDEAL_SPHERE] if is_ideal else []
        if of_all:
            stated = ", ".join(f"{name} = {text}" for name, (_, text) in of_all.items())
            notes.append(f"Of the sphere, comments state {stated}.")
        return spheres, notes
    return None, [IDEAL_SPHERE] if at_sphere.any() else []


def _of_sphere(table, name, of_all, at_sphere) -> Float[np.ndarray, " readings"]:
    if name not in of_all:
        return _optional(table, name)
    row, text = of_all[name]
    try:
        return np.where(at_sphere, float(text), np.nan)
    except ValueError:
        raise refusal(table.source, f"{name} is '{text}'; it must be a number", row) from None


def _reference(table, quantity, wall, of_all) -> Float[np.ndarray, " readings"]:
    """Of what fills the port at 100 %: unless stated, a standard in reflection, nothing in transmission."""
    if _SPHERE[2] in of_all:
        row, text = of_all[_SPHERE[2]]
        stated: Sequence[tuple[int, str]] = [(row, text)] * len(quantity)
    elif _SPHERE[2] in table.names:
        cells = table.column(table.names.index(_SPHERE[2]))
        stated = list(zip(np.asarray(table.lines).tolist(), cells, strict=True))
    else:
        stated = [(table.header_line, "")] * len(quantity)
    found = np.full(len(quantity), np.nan)
    for k, (row, text) in enumerate(stated):
        if np.isnan(wall[k]):
            continue
        usual = "open" if QUANTITIES[str(quantity[k])].is_transmission else "closed"
        word = text.lower() or usual
        try:
            found[k] = {"open": 0.0, "closed": wall[k]}[word] if word in _PORTS else float(word)
        except ValueError:
            what = "write open, closed, or the reflectance of the standard in the port"
            raise refusal(table.source, f"is '{text}'; {what}", row, _SPHERE[2]) from None
    return found
