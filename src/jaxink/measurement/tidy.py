"""From the cells of a table to a measurement: defects are corrected and noted, or rejected."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from jaxink.measurement import checks
from jaxink.measurement.columns import ANGLES, OPTIONS, match_columns, side_in_header
from jaxink.measurement.conditions import refuse_several_conditions
from jaxink.measurement.dataset import GonioData
from jaxink.measurement.masks import value_bits, value_notes
from jaxink.measurement.names import meaning, other_quantity, side_of
from jaxink.measurement.pairs import direction_groups
from jaxink.measurement.rows import (
    Conditions,
    conditions_of,
    has_decimal_commas,
    with_decimal_points,
    with_one_sample,
    with_rows_of,
    without_units,
)
from jaxink.measurement.stacked import facts_of_title
from jaxink.measurement.table import TextTable, refusal
from jaxink.measurement.titles import stated_alone

_SAME_DEG = 1e-3
_LARGEST_DEG = 360.0


@dataclass(frozen=True)
class ReadOptions:
    """What the caller states about all rows of a table.

    Parameters
    ----------
    wavelength_nm, side
        Value for all rows, if the table has no such column.
    sample
        The sample to read, if column ``sample`` contains several.
    columns
        Names of known columns in the table.
    signed_angles
        Whether a negative ``theta_o_deg`` means the other half-plane.
    cosine_weighted
        Whether the values are the BSDF times cos(theta_o).
    theta_i_deg, phi_deg, phi_o_deg
        Angle for all rows, if the table has no such column.
    matrix
        Quantities down and along the edges of a matrix, or the latter only; also as text with a comma.
    needs_values
        Whether the column of values is required; without it all values are 0.
    rows
        The rows to read, as a cell for each column.
    """

    wavelength_nm: float | None = None
    side: str | None = None
    sample: str | None = None
    columns: Mapping[str, str] = field(default_factory=dict)
    signed_angles: bool = False
    cosine_weighted: bool = False
    theta_i_deg: float | None = None
    phi_deg: float | None = None
    phi_o_deg: float | None = None
    matrix: str | Sequence[str] | None = None
    needs_values: bool = True
    rows: Mapping[str, Any] = field(default_factory=dict)

    @property
    def edges(self) -> Sequence[str] | None:
        """The quantities of ``matrix`` one by one."""
        return self.matrix.split(",") if isinstance(self.matrix, str) else self.matrix

    def of_side(self, side: str, source: str) -> "ReadOptions":
        """The same with the side of a sheet; a different one that is stated already is rejected."""
        if self.side not in (None, side):
            raise refusal(
                source, f"the caller gives {side} for the sheet, but {self.side} for all rows; remove one"
            )
        return replace(self, side=side)

    @property
    def supplied(self) -> tuple[str, ...]:
        """Known columns that the table may lack."""
        given = {"wavelength_nm": self.wavelength_nm is not None, "side": self.side is not None}
        given |= {"phi_deg": self.signed_angles, "bsdf_per_sr": not self.needs_values}
        return tuple(name for name, here in given.items() if here)


def measurement_of(table: TextTable, stated: ReadOptions) -> GonioData:
    """The measurement that a table contains; parameters and errors as for `jaxink.measurement.read_csv`."""
    table, known, extra, notes = _understood(table, stated)
    table, chosen = with_rows_of(table, stated.rows, notes)
    table, of_sample = with_one_sample(table, extra, stated.sample)
    angles = _angles(table, known, stated.signed_angles, notes)
    divided = _cosine(table, angles["theta_o_deg"], stated.cosine_weighted, notes)
    has_values = "bsdf_per_sr" in known
    bsdf = _per_sr(table, known, "bsdf_per_sr", divided) if has_values else np.zeros(len(table.rows))
    sigma = _sigma(table, known, divided, notes)
    wavelength_nm = _wavelength(table, known, stated.wavelength_nm, notes)
    is_transmission = _side(table, known, stated.side, notes)
    theta_i, theta_o, phi = (angles[name] for name in ANGLES)
    directions = theta_i, theta_o, phi, wavelength_nm, is_transmission
    data = GonioData(
        *directions,
        bsdf_per_sr=bsdf,
        sigma_per_sr=sigma,
        extra={name: _extra(table.column(index)) for name, index in extra.items()},
        row=table.lines,
        mask=value_bits(directions, bsdf),
        source=Path(table.source).name,
        attrs=chosen | of_sample,
    )
    if not has_values:
        return data.replace(notes=[*notes, "The table has directions, but no values of the BSDF."])
    checks.refuse_nothing_or_excess(table, directions, bsdf, data.scan_index, data.mask)
    checks.refuse_marks(table, directions, bsdf, divided)
    refuse_several_conditions(data, table.source)
    checks.refuse_peak_at_source(table, directions, bsdf, _if_turned(table, known, stated))
    notes += [*value_notes(data.mask, directions, data.row), *_order_notes(data), *_repeat_notes(table, data)]
    return data.replace(notes=notes)


def stated_conditions(table: TextTable, stated: ReadOptions) -> Conditions:
    """The columns of a table that say what was changed between its rows."""
    table, *_ = _understood(table, stated)
    return conditions_of(table, stated.rows, stated.sample)


def _understood(
    table: TextTable, stated: ReadOptions
) -> tuple[TextTable, dict[str, int], dict[str, int], list[str]]:
    """The table without its units and decimal commas, its known and other columns, and notes."""
    if {name.lower() for name in table.names} >= {"quantity", "value"}:
        text = (
            'is a file of readings of other instruments: write readings = "..." for it in a project, or read '
            "it with jaxink.read_readings"
        )
        raise refusal(table.source, text, table.header_line)
    table, constant_notes = _with_constants(*_with_titles(table, stated), stated)
    known, extra, column_notes = match_columns(
        table, dict(stated.columns), stated.supplied, stated.cosine_weighted
    )
    _refuse_titles(table, stated)
    notes = [*table.notes, *constant_notes, *column_notes]
    table = without_units(table, known, notes)
    return with_decimal_points(table, known, extra, notes), known, extra, notes


def _refuse_other_value(table: TextTable, line: int, title: str, stated: ReadOptions) -> None:
    """Reject a title above a table that states another angle or wavelength than the caller does."""
    for fact in facts_of_title(table.source, line, title):
        given = getattr(stated, fact.name, None)
        if isinstance(given, Real) and abs(float(fact.text.replace(",", ".")) - float(given)) > _SAME_DEG:
            text = f"the title states {fact.name} = {fact.text}, but the caller gives {given:g}; remove one"
            raise refusal(table.source, text, line)


def _refuse_titles(table: TextTable, stated: ReadOptions) -> None:
    """Reject a title that says something else than the caller says."""
    for line, title in table.titles:
        # A table names its values in the header, but seldom says there that they contain a cosine.
        if not table.is_matrix:
            _refuse_other_value(table, line, title, stated)
        # Comments also say what a converter has done.
        other = None if title.startswith("#") else other_quantity("bsdf_per_sr", title)
        if other is None or (stated.cosine_weighted if other.is_cosine else not table.is_matrix):
            continue
        raise refusal(table.source, other.of_title(title), line)


def _with_titles(table: TextTable, stated: ReadOptions) -> tuple[TextTable, list[str]]:
    """The table with a column for each quantity that it lacks, and that one line above it states."""
    found: dict[str, dict[str, int]] = {}
    for line, title in () if table.is_matrix else table.titles:
        if (fact := stated_alone(title)) is not None:
            found.setdefault(fact[0], {}).setdefault(fact[1], line)
    meant = {name: (meaning(name) or ("",))[0] for name in table.names}
    own = {*stated.columns, *meant.values()}
    values = [
        stated.columns.get("bsdf_per_sr"),
        *(n for n, target in meant.items() if target == "bsdf_per_sr"),
    ]
    if table.sheet_side is not None or any(name and side_of(name) for name in values):
        own.add("side")
    notes = []
    for name, texts in found.items():
        if name in own or getattr(stated, name) is not None or len(texts) > 1:
            continue
        ((text, line),) = texts.items()
        cell = text.replace(".", ",") if has_decimal_commas(table) else text
        table = table.with_constant(name, cell)
        notes.append(f"The table has no column {name}; row {line} above it states {text}.")
    return table, notes


def _with_constants(table: TextTable, notes: list[str], stated: ReadOptions) -> tuple[TextTable, list[str]]:
    """The table with a column for each angle that the caller states."""
    for name in ("theta_i_deg", "phi_deg", "phi_o_deg"):
        value = getattr(stated, name)
        if value is None:
            continue
        if not isinstance(value, Real) or not np.isfinite(float(value)):
            raise refusal(table.source, f"{name} is {value!r}; it must be an angle in degrees")
        own = [
            own
            for own in table.names
            if own == stated.columns.get(name) or (meaning(own) or ("",))[0] == name
        ]
        if own:
            text = f"the table has this column, but the caller gives {float(value):g}; remove one"
            raise refusal(table.source, text, column=own[0])
        cell = f"{float(value):.10g}"
        table = table.with_constant(name, cell.replace(".", ",") if has_decimal_commas(table) else cell)
        notes.append(f"The file states no {name}; the caller gave {float(value):g}.")
    return table, notes


def _angles(table: TextTable, known, signed: bool, notes) -> dict[str, Any]:
    angles = {name: checks.numbers(table, known[name], name) for name in ANGLES if name in known}
    angles |= relative_azimuths(table, known, angles.get("phi_deg"), notes)
    derived = "phi_deg" not in angles
    if derived:
        _refuse_azimuths_of_view(table, known)
        # In the plane of incidence, on the specular side.
        angles["phi_deg"] = np.zeros(len(table.rows))
    checks.refuse_radians(table, angles)
    angles["theta_i_deg"] = checks.polar_angles(table, angles["theta_i_deg"], "theta_i_deg", derived)
    angles["phi_deg"] = checks.azimuths(table, angles["phi_deg"] + 180.0 * derived, notes)
    if signed:
        checks.refuse_through(table, angles["theta_o_deg"])
        angles |= unsigned_directions(table, angles, derived, notes)
    angles["theta_o_deg"] = checks.polar_angles(table, angles["theta_o_deg"], "theta_o_deg")
    return angles


def _refuse_azimuths_of_view(table: TextTable, known: Mapping[str, int]) -> None:
    """Reject azimuths of view that differ, where the sign of the polar angle is to tell the half-plane."""
    if "phi_o_deg" not in known:
        return
    view = _azimuth(table, known, "phi_o_deg")
    wrong = _turned(view - view[0])
    if wrong.any():
        text = (
            "the azimuth of view differs between the rows, but with --signed-angles (in Python: "
            "signed_angles=True) all are in the plane of incidence; leave that out"
        )
        raise refusal(table.source, text, table.lines[np.argmax(wrong)], table.names[known["phi_o_deg"]])


def _if_turned(table: TextTable, known: Mapping[str, int], stated: ReadOptions) -> str:
    """What to do if azimuths are counted from the other side; empty where it is stated that they are not."""
    if stated.phi_deg is not None or stated.phi_o_deg is not None:
        return ""
    target = "phi_deg" if "phi_deg" in known else "phi_o_deg" if "phi_o_deg" in known else ""
    if not target:
        return (
            "if negative theta_o_deg are on the specular side, state it: --signed-angles --phi-deg 0 (in "
            "Python: signed_angles=True, phi_deg=0); if they are not, --signed-angles --phi-deg 180"
        )
    name = table.names[known[target]]
    if table.is_matrix:
        if table.states_phi_deg:
            return ""
        return "if azimuths are 0 on the specular side, add 180 to them, and name them phi_deg in any case"
    if name == target or name == stated.columns.get(target):
        return ""
    return (
        f"if column '{name}' is 0 on the specular side, add 180 and name it {target}; if it is right, state "
        f'it: --columns "{target}={name}" (in Python: columns={{{target!r}: {name!r}}})'
    )


def _cosine(table: TextTable, theta_o_deg: np.ndarray, weighted: bool, notes) -> np.ndarray | float:
    """Divisor of the values: cos(theta_o), or 1."""
    if not weighted:
        return 1.0
    horizon = np.flatnonzero(theta_o_deg > 90 - 1e-6)
    if horizon.size:
        text = (
            f"{theta_o_deg[horizon[0]]:g} degrees is the horizon, where values times the cosine are 0 and do "
            "not tell the BSDF; remove the row"
        )
        raise refusal(table.source, text, table.lines[horizon[0]], "theta_o_deg")
    notes.append("The values were divided by cos(theta_o), as requested by the caller.")
    return np.cos(np.deg2rad(theta_o_deg))


def _wavelength(table: TextTable, known, given, notes) -> np.ndarray:
    name = "wavelength_nm"
    if given is not None:
        given = float(given)
        checks.wavelengths("read_csv", np.array([given]), [None])
    stated = name in known and any(table.column(known[name]))
    if not stated:
        if given is None:
            text = "the column is empty; state one for all rows with " + OPTIONS[name]
            raise refusal(table.source, text, column=name)
        notes.append(f"The file states no wavelength; the caller gave {given:g} nm.")
        return np.full(len(table.rows), given)
    values = checks.numbers(table, known[name], name)
    values = checks.wavelengths(table.source, values, table.lines)
    if given is not None and (values != given).any():
        line = table.lines[np.argmax(values != given)]
        text = f"the file states {values[values != given][0]:g}, but the caller gives {given:g}; remove one"
        raise refusal(table.source, text, line, name)
    return values


def _side(table: TextTable, known, given, notes) -> np.ndarray:
    if given not in (None, "R", "T"):
        raise refusal("read_csv", f"side is {given!r}; it must be 'R' or 'T'")
    stated = "side" in known and any(table.column(known["side"]))
    named = side_in_header(table, known)
    if not stated and named is None and table.sheet_side is not None:
        if given not in (None, table.sheet_side):
            text = (
                f"the name of the sheet says {table.sheet_side}, but the caller gives {given}; state it "
                f"with the sheet: --sheet NAME={given}"
            )
            raise refusal(table.source, text)
        notes.append(f"The name of the sheet says that every row is {table.sheet_side}.")
        return np.full(len(table.rows), table.sheet_side == "T")
    if not stated and named is not None:
        name = table.names[known["bsdf_per_sr"]]
        if given not in (None, named):
            text = f"the name says {named}, but the caller gives {given}; remove one"
            raise refusal(table.source, text, column=name)
        notes.append(f"Column '{name}' says that every row is {named}.")
        return np.full(len(table.rows), named == "T")
    if not stated:
        if given is None:
            text = "the column is empty; state one for all rows with " + OPTIONS["side"]
            raise refusal(table.source, text, column="side")
        notes.append(f"The file states no side; the caller gave '{given}'.")
        return np.full(len(table.rows), given == "T")
    values = checks.sides(table, known["side"], notes)
    other = values != (given == "T")
    if given is not None and other.any():
        text = f"the file states {'RT'[int(values[other][0])]}, but the caller gives {given}; remove one"
        raise refusal(table.source, text, table.lines[np.argmax(other)], "side")
    return values


def _sigma(table: TextTable, known, divided, notes) -> np.ndarray | None:
    name = "sigma_per_sr"
    if name not in known:
        return None
    if not any(table.column(known[name])):
        notes.append("Column sigma_per_sr is empty and was ignored.")
        return None
    return checks.sigmas(table, _per_sr(table, known, name, divided))


def _per_sr(table: TextTable, known, name: str, divided) -> np.ndarray:
    return checks.magnitudes(table, checks.numbers(table, known[name], name) / divided, name)


def _extra(cells: list[str]) -> np.ndarray:
    """Numbers if all non-empty cells are; labels such as 007 and numbers beyond the float range stay text."""
    filled = [cell for cell in cells if cell]
    number = re.compile(r"[+-]?(0|[1-9]\d*|(0|[1-9]\d*)?\.\d+|(0|[1-9]\d*)\.)([eE][+-]?\d+)?")
    if not filled or not all(number.fullmatch(cell) for cell in filled):
        return np.array(cells)
    values = np.array([float(cell) if cell else np.nan for cell in cells])
    return np.array(cells) if np.isinf(values).any() else values


def _order_notes(data: GonioData) -> list[str]:
    changes = int((np.diff(data.scan_index) != 0).sum())
    if changes + 1 == len(data.scans):
        return []
    return ["The rows of a scan are not consecutive; the order of the file was kept."]


def _repeat_notes(table: TextTable, data: GonioData) -> list[str]:
    notes = []
    # Zeros where nothing was measured repeat nothing.
    read = data.bsdf_per_sr != 0
    group = np.where(read, direction_groups(data), -1)
    counts = np.bincount(group[read])
    if (counts > 1).any():
        several = int((counts > 1).sum())
        which = "1 direction was" if several == 1 else f"{several} directions were"
        rows = data.row[group == np.argmax(counts > 1)]
        notes.append(
            f"{which} measured more than once (rows {rows[0]} and {rows[1]}); all rows were kept as repeats."
        )
    seen, copies = dict[tuple[str, ...], int](), []
    for line, row in zip(table.lines, table.rows, strict=True):
        first = seen.setdefault(row, line)
        if first != line:
            copies.append((first, line))
    if copies:
        first, line = copies[0]
        which = "1 row is a copy" if len(copies) == 1 else f"{len(copies)} rows are copies"
        notes.append(
            f"{which} of another in every cell (rows {first} and {line}); all were kept, but copies are not "
            "used to estimate the noise."
        )
    return notes


def relative_azimuths(
    table: TextTable, known: Mapping[str, int], phi_deg: np.ndarray | None, notes: list[str]
) -> dict[str, np.ndarray]:
    """``phi_deg`` where a table has an azimuth of incidence; otherwise nothing.

    Parameters
    ----------
    table, known
        The table, and the position of its known columns.
    phi_deg
        The column ``phi_deg`` if there is one: it is then the relative azimuth only if the azimuth of
        incidence is 0, or if all three agree.
    notes
        Collects sentences on what was computed.
    """
    if "phi_i_deg" not in known:
        return {}
    source = _azimuth(table, known, "phi_i_deg")
    view = _azimuth(table, known, "phi_o_deg") if "phi_o_deg" in known else None
    named = {name: f"'{table.names[known[name]]}'" for name in ("phi_i_deg", "phi_o_deg") if name in known}
    if phi_deg is not None:
        wrong = _turned(source) if view is None else _turned(phi_deg - view + source)
        if wrong.any():
            line = table.lines[np.argmax(wrong)]
            text = (
                f"the azimuth of incidence {named['phi_i_deg']} is not 0, so it is open whether phi_deg is "
                "measured from the source; if it is not, name it phi_o_deg, and phi_deg is phi_o_deg - "
                f"phi_i_deg; if it is, remove {named['phi_i_deg']}"
            )
            raise refusal(table.source, text, line, "phi_deg")
        return {}
    if view is None:
        # The caller says that polar angles are signed.
        return {}
    notes.append(
        f"phi_deg is {named['phi_o_deg']} minus {named['phi_i_deg']}, the azimuth of the direction towards "
        "the source."
    )
    turned = np.round(np.mod(view - source, 360.0), 9) % 360
    return {"phi_deg": np.where(turned > 180, turned - 360, turned)}


def _azimuth(table: TextTable, known: Mapping[str, int], name: str) -> np.ndarray:
    values = checks.numbers(table, known[name], name)
    bad = np.flatnonzero(np.abs(values) > _LARGEST_DEG)
    if bad.size:
        text = f"{values[bad[0]]:g} is outside the range -360 to 360 degrees"
        raise refusal(table.source, text, table.lines[bad[0]], name)
    return values


def _turned(difference_deg: np.ndarray) -> np.ndarray:
    """True where azimuths are not equal."""
    return np.abs((difference_deg + 180) % 360 - 180) > _SAME_DEG


def unsigned_directions(
    table: TextTable, angles: Mapping[str, np.ndarray], derived: bool, notes: list[str]
) -> dict[str, np.ndarray]:
    """Viewing angle, 0 or more, and azimuth turned by 180 degrees where the angle was negative.

    Parameters
    ----------
    table
        The table, for row numbers.
    angles
        ``theta_o_deg`` with its sign; ``phi_deg`` in (-180, 180].
    derived
        Whether the table has no column ``phi_deg``.
    notes
        Collects sentences on what was changed.
    """
    theta, phi = angles["theta_o_deg"], angles["phi_deg"]
    negative = theta < 0
    turned = np.where(phi > 0, phi - 180, phi + 180)
    if derived:
        notes.append(
            "The file has no column phi_deg; it is 180 degrees (towards the peak) at positive theta_o_deg "
            "and 0 (towards the source) at negative."
        )
    if negative.any():
        first = table.lines[np.argmax(negative)]
        what = "" if derived else " with phi_deg turned by 180 degrees"
        notes.append(
            f"{int(negative.sum())} negative values of theta_o_deg (first in row {first}) were read as "
            f"positive{what}, as requested by the caller."
        )
    return {"theta_o_deg": np.abs(theta), "phi_deg": np.where(negative, turned, phi)}
