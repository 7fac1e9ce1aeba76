"""Assignment of the columns of a file to quantities."""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.measurement.names import (
    SIDES,
    is_angle,
    is_cosine,
    is_cosine_product,
    is_known_unit,
    is_unit,
    meaning,
    name_and_unit,
    other_quantity,
    plain_name,
    side_of,
    unit_problem,
)
from jaxink.measurement.table import TextTable, is_number, refusal

ANGLES = ("theta_i_deg", "theta_o_deg", "phi_deg")
REQUIRED = (*ANGLES, "wavelength_nm", "side", "bsdf_per_sr")
# Azimuths of incidence and of view; phi_deg is their difference.
AZIMUTHS = ("phi_i_deg", "phi_o_deg")
KNOWN = (*REQUIRED, "sigma_per_sr", *AZIMUTHS)
# How to state one value for all rows, on the command line and in Python.
OPTIONS = {
    "wavelength_nm": "--wavelength-nm NM (in Python: wavelength_nm=NM)",
    "side": "--side R or --side T (in Python: side='R' or side='T'; with several files, --side R,T: one for "
    "each; with several sheets, --sheet A=R,B=T)",
    "theta_i_deg": "--theta-i-deg DEG (in Python: theta_i_deg=DEG; with several files, --theta-i-deg "
    "0,30,60: one for each)",
    "phi_deg": "--phi-deg DEG (in Python: phi_deg=DEG)",
    "phi_o_deg": "--phi-o-deg DEG (in Python: phi_o_deg=DEG)",
}
_SIGNED = "--signed-angles (in Python: signed_angles=True)"

_RADIANS = "holds radians; multiply by 180/pi and name the column {}_deg"
_OTHER_UNITS = {
    **{f"{a}_{u}": _RADIANS.format(a) for a in ("theta_i", "theta_o", "phi") for u in ("rad", "radians")},
    "wavelength_um": "holds micrometres; multiply by 1000 and name the column wavelength_nm",
    "wavelength_micron": "holds micrometres; multiply by 1000 and name the column wavelength_nm",
    "wavelength_m": "holds metres; multiply by 1e9 and name the column wavelength_nm",
    "wavelength_angstrom": "holds angstrom; divide by 10 and name the column wavelength_nm",
    "brf": "holds reflectance factors; divide by pi and name the column bsdf_per_sr",
    "reflectance_factor": "holds reflectance factors; divide by pi and name the column bsdf_per_sr",
}
# So many columns that differ by a number only are one kind of columns.
_NUMBERED = re.compile(r"(\D*?)[ _]*-?\d+(?:[.,]\d+)?\s*(?:nm|°|deg)?")
_FEWEST_NUMBERED = 4
# More names than these are counted, not listed.
_MOST_LISTED = 12
_DIFFERENCE = "phi_deg is the azimuth of view minus that of the direction towards the source"


def option_words(stated: Mapping[str, Any]) -> list[str]:
    """Options of a command that state the same as these keywords of `jaxink.read`."""
    words: list[str] = []
    for key, value in stated.items():
        option = f"--{'which' if key == 'sample' else key.replace('_', '-')}"
        if isinstance(value, bool):
            words.append(option if value else option.replace("--", "--no-", 1))
        elif isinstance(value, Mapping):
            words += [word for name, header in value.items() for word in (option, f"{name}={header}")]
        else:
            words += [option, ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)]
    return words


def match_columns(
    table: TextTable, columns: dict[str, str], supplied: tuple[str, ...], cosine_weighted: bool = False
) -> tuple[dict[str, int], dict[str, int], list[str]]:
    """Find the known columns of a table.

    Parameters
    ----------
    table
        The table as read.
    columns
        Name in the file of each known column that the caller renames.
    supplied
        Known columns that may be absent because the caller gives one value for all rows.
    cosine_weighted
        Whether the caller says that the values are the BSDF times a cosine.

    Returns
    -------
    known, extra, notes
        Column index by known name, column index by other name, and sentences on what was changed.

    Raises
    ------
    InputRefusedError
        If a required column is missing, misspelt, duplicated, or in another unit.
    """
    notes: list[str] = []
    named = _named(table, columns, cosine_weighted, notes)
    known = dict(named)
    extra: dict[str, int] = {}
    for index, name in enumerate(table.names):
        if index in named.values():
            continue
        if not name:
            _drop_blank_column(table, index, notes)
        elif name in extra or plain_name(name) in named:
            raise _twice(table, plain_name(name))
        else:
            extra[name] = index
    _refuse_other_units(table, known, extra)
    _find_by_meaning(table, known, extra, supplied, cosine_weighted, notes)
    _refuse_other_quantities(table, known, extra, supplied)
    _refuse_misspelt(table, known, extra, supplied)
    _refuse_azimuths(table, known, supplied)
    _refuse_missing(table, known, supplied)
    return known, extra, notes


def _named(table, columns, cosine_weighted, notes) -> dict[str, int]:
    """Columns that the caller names, and those with the names of docs/manual/measurement-file.md."""
    named: dict[str, int] = {}
    for target, name in columns.items():
        if target not in KNOWN:
            text = f"columns has the key '{target}'; it must be one of {', '.join(KNOWN)}"
            raise refusal(table.source, text)
        if name not in table.names:
            text = f"columns assigns it to {target}, but the header contains {listed(table.names)}"
            raise refusal(table.source, text, column=name)
        if table.names.index(name) in named.values():
            raise refusal(table.source, "columns assigns it to two quantities", column=name)
        _refuse_name(table, target, name, cosine_weighted, is_stated=True)
        named[target] = table.names.index(name)
        notes.append(f"Column '{name}' is read as {target}, as requested by the caller.")
    stated = set(named.values())
    for index, name in enumerate(table.names):
        target = plain_name(name)
        if target not in KNOWN or index in stated:
            continue
        if target in named:
            raise _twice(table, target)
        named[target] = index
        if name != target:
            _refuse_name(table, target, name, cosine_weighted, is_stated=True)
            notes.append(f"Column '{name}' is read as {target}.")
    return named


def _twice(table: TextTable, name: str) -> InputRefusedError:
    text = (
        "the column occurs twice in the header; rename or remove one, and put curves that stand side by side "
        "below each other, with a column for what differs"
    )
    if table.titles and len(table.titles[-1][1].split(",")) > 1:
        text += ", or one matrix for each heading in the row above, with it as a title"
    return refusal(table.source, text, column=name)


def _refuse_name(
    table: TextTable, target: str, name: str, cosine_weighted: bool, is_stated: bool = False
) -> None:
    """Reject a column whose heading says that it is not this quantity, or is in another unit.

    What the caller states does not change a unit; but what is no unit is then taken as a remark.
    """
    is_expected = cosine_weighted and target == "bsdf_per_sr" and is_cosine_product(name)
    other = None if is_expected else other_quantity(target, name)
    problem = None if other is None else other.of_column(target)
    unit = name_and_unit(name)[1]
    if problem is None and (not is_stated or is_known_unit(target, unit)):
        problem = unit_problem(target, unit, f"; if it is right: {_stating(target, name)}")
    if problem is not None:
        raise refusal(table.source, problem, column=name)


def _refuse_other_quantities(table, known, extra, supplied) -> None:
    """Reject a column that would have to be converted where the quantity is missing."""
    for target in ("bsdf_per_sr", "theta_o_deg", "theta_i_deg"):
        if target in known or target in supplied:
            continue
        for name in extra:
            is_named = target == "bsdf_per_sr" or is_angle(name)
            if is_named and (other := other_quantity(target, name)) is not None:
                # Of two missing angles, it may be either.
                both = {"theta_i_deg", "theta_o_deg"}
                either = "theta_i_deg or theta_o_deg" if target in both and not both & {*known} else target
                raise refusal(table.source, other.of_column(either), column=name)


def _find_by_meaning(table, known, extra, supplied, cosine_weighted, notes) -> None:
    """Move the columns with other names of known quantities from the extra ones to the known ones."""
    found: dict[str, list[tuple[str, str]]] = {}
    for name in extra:
        meant = meaning(name)
        if meant is None and cosine_weighted and is_cosine_product(name):
            meant = "bsdf_per_sr", name_and_unit(name)[1]
        if meant is not None and meant[0] not in known:
            found.setdefault(meant[0], []).append((name, meant[1]))
    for target, names in found.items():
        if target == "phi_deg" and "phi_o_deg" in {*known, *found} and "phi_i_deg" in {*known, *found}:
            continue
        if target == "side" and "side" in supplied:
            continue
        if target == "bsdf_per_sr" and len(names) > 1 and all(is_number(unit) for _, unit in names):
            raise refusal(table.source, _as_a_matrix([name for name, _ in names]))
        if len(names) > 1:
            several = " and ".join(f"'{name}'" for name, _ in names)
            text = f"the columns {several} can be {target}; say which: {_stating(target, names[0][0])}"
            raise refusal(table.source, text)
        name, unit = names[0]
        if target == "sigma_per_sr" and not unit:
            if {"value", "unit"} <= set(extra):
                continue
            text = (
                "the uncertainty has no unit; convert it to 1/sr and name the column sigma_per_sr, or "
                f"rename the column if it is something else; if it is in 1/sr: {_stating(target, name)}"
            )
            raise refusal(table.source, text, column=name)
        _refuse_name(table, target, name, cosine_weighted)
        known[target] = extra.pop(name)
        zero = ", whose 0 is the side of the source" if target == "phi_deg" else ""
        notes.append(f"Column '{name}' is read as {target}{zero}.")


def side_in_header(table: TextTable, known: dict[str, int]) -> str | None:
    """``R`` or ``T`` if the name of the column of values, such as BTDF, says so."""
    return side_of(table.names[known["bsdf_per_sr"]]) if "bsdf_per_sr" in known else None


def listed(names: Iterable[str]) -> str:
    """The names of a header for a message: the first ones, and how many there are."""
    names = [name for name in names if name]
    if len(names) <= _MOST_LISTED:
        return ", ".join(names)
    return f"{', '.join(names[:_MOST_LISTED])} and {len(names) - _MOST_LISTED} more"


def _holds_sides(cells: Sequence[str]) -> bool:
    """Whether every cell is a word for reflection or transmission."""
    return all(cell.lower() in SIDES for cell in cells)


def _stating(target: str, name: str) -> str:
    """How to say that a column is a quantity, on the command line and in Python."""
    return f'--columns "{target}={name}" (in Python: columns={{{target!r}: {name!r}}})'


def _drop_blank_column(table, index, notes):
    first = [cell for cell in table.rows[0] if cell.strip()]
    if sum(map(is_number, first)) * 2 < len(first) and not any(map(is_unit, first)):
        text = (
            f"the header has no name in column {index + 1}, and row {table.lines[0]} has names, too; write "
            "one row of names, or below each other one matrix for each heading, with it as a title"
        )
        raise refusal(table.source, text, table.header_line)
    for line, cell in zip(table.lines, table.column(index), strict=True):
        if cell:
            text = f"the cell '{cell}' belongs to a column without a name; name the column"
            raise refusal(table.source, text, line, index + 1)
    notes.append(f"Column {index + 1} has neither a name nor values and was omitted.")


def _refuse_other_units(table, known, extra):
    for name in extra:
        plain = plain_name(name)
        stem, _, unit = plain.rpartition("_")
        about_bsdf = "bsdf_per_sr" not in known or stem.startswith(("bsdf", "sigma"))
        if unit in ("percent", "pct") and about_bsdf:
            target = "sigma_per_sr" if stem.startswith("sigma") else "bsdf_per_sr"
            text = f"holds values in per cent; convert them to 1/sr and name the column {target}"
            raise refusal(table.source, text, column=name)
        if plain in _OTHER_UNITS:
            text = _OTHER_UNITS[plain]
            text = text.replace("divide by pi", "divide by 100 pi") if "%" in name else text
            raise refusal(table.source, text, column=name)


def _refuse_misspelt(table, known, extra, supplied):
    wanted = (*REQUIRED, "sigma_per_sr")
    absent = [name for name in wanted if name not in known and name not in supplied]
    if "phi_deg" in absent and set(AZIMUTHS) & set(known):
        absent.remove("phi_deg")
    for name in extra:
        near = difflib.get_close_matches(name.lower(), absent, n=1, cutoff=0.75)
        if near:
            text = f"the name is unknown; the most similar is {near[0]}: {_stating(near[0], name)}"
            raise refusal(table.source, text, column=name)


def _refuse_azimuths(table, known, supplied):
    """Reject azimuths of which the one of the other direction is missing."""
    if "phi_deg" in known or "phi_deg" in supplied or len(set(AZIMUTHS) & set(known)) != 1:
        return
    if "phi_o_deg" in known:
        name = table.names[known["phi_o_deg"]]
        text = (
            f"{_DIFFERENCE}, which the header lacks; if '{name}' is 0 on the side of the source: "
            f"{_stating('phi_deg', name)}; if it is 0 on the specular side, add 180 to it, and name it "
            "phi_deg; if neither, add a column phi_i_deg"
        )
    else:
        name = table.names[known["phi_i_deg"]]
        text = (
            f"{_DIFFERENCE}; the header has the latter, but no column phi_o_deg of the former; if that is "
            f"the same in all rows, state it: {OPTIONS['phi_o_deg']}; if theta_o_deg is negative on the "
            f"side of the source: {_SIGNED}"
        )
    raise refusal(table.source, text, column=name)


def _refuse_missing(table, known, supplied):
    supplied = (*supplied, *(["phi_deg"] if set(AZIMUTHS) <= set(known) else []))
    if "bsdf_per_sr" in known and side_in_header(table, known) is not None:
        supplied = (*supplied, "side")
    if table.sheet_side is not None:
        supplied = (*supplied, "side")
    missing = [name for name in REQUIRED if name not in known and name not in supplied]
    if not missing:
        return
    header = listed(table.names)
    cosines = [name for name in table.names if is_cosine(name)]
    if cosines and {*ANGLES} & {*missing}:
        text = (
            "the name is that of a direction cosine or of sine space; for the cosines a, b along x, y in the "
            "plane of the sample, write theta = asin(sqrt(a^2 + b^2)) and phi = atan2(b, a) in degrees "
            "(theta_i_deg and phi_i_deg, theta_o_deg and phi_o_deg); in the plane of incidence, beta - beta0 "
            "is sin(theta_o) - sin(theta_i)"
        )
        raise refusal(table.source, text, column=cosines[0])
    if (numbered := _numbered(table.names)) is not None:
        raise refusal(table.source, f"{_as_a_matrix(numbered)} (missing: {', '.join(missing)})")
    if {"value", "unit"} <= set(table.names):
        unit = table.column(table.names.index("unit"))[0]
        text = (
            f"column bsdf_per_sr is missing; column value is in '{unit}', a total or ratio from "
            "which the BSDF of a direction in 1/sr cannot be derived"
        )
        raise refusal(table.source, text)
    plural, verb = ("columns", "are") if len(missing) > 1 else ("column", "is")
    text = f"{plural} {', '.join(missing)} {verb} missing; the header has {header}"
    if missing == ["bsdf_per_sr"]:
        text = f"column bsdf_per_sr (radiance over irradiance in 1/sr) is missing; the header has {header}"
    text += _remedies(table, known, missing)
    if any("Latin-1" in note for note in table.notes):
        text += "; the file is not UTF-8 and was read as Latin-1: if these names are wrong, save it as UTF-8"
    raise refusal(table.source, text)


def _as_a_matrix(names: Sequence[str]) -> str:
    """What to do with columns of values with a number each."""
    return (
        f"{len(names)} columns are named {names[0]} to {names[-1]}; if each has the values of a wavelength "
        "or an angle, put them last, behind the columns of angles, and name them by that alone, such as "
        "450 nm or AOI 30 deg, to have them read as a matrix, or write a row for each value, in a column "
        "bsdf_per_sr"
    )


def _numbered(names: Sequence[str]) -> list[str] | None:
    """The names that are one word and a number, if they are most of a header: a list of them tells "
    "nothing.
    """
    found: dict[str, list[str]] = {}
    for name in names:
        if (parts := _NUMBERED.fullmatch(name)) is not None:
            found.setdefault(parts[1], []).append(name)
    most = max(found.values(), key=len, default=[])
    word = max(found, key=lambda name: len(found[name]), default="")
    # Of values, or of numbers alone, two are enough.
    is_clear = len(most) > 1 and (not word or (meaning(word) or ("",))[0] == "bsdf_per_sr")
    return most if is_clear or (len(most) > _FEWEST_NUMBERED and 2 * len(most) > len(names)) else None


def _remedies(table: TextTable, known: Mapping[str, int], missing: list[str]) -> str:
    """How to state the missing columns: values of all rows, signed angles, or another name."""
    free = {name: index for index, name in enumerate(table.names) if name and index not in known.values()}
    sides = [name for name, index in free.items() if _holds_sides(table.column(index))]
    if "side" in missing and len(sides) == 1:
        text = f"; the cells of column '{sides[0]}' say the side: {_stating('side', sides[0])}"
        others = [name for name in missing if name != "side"]
        return text + (_remedies(table, {**known, "side": free[sides[0]]}, others) if others else "")
    unknown = [name for name in free if meaning(name) is None]
    constant = [name for name in missing if name in OPTIONS]
    # Columns without a name that is known may be any of them.
    text = ""
    if constant and (len(constant) == len(missing) or not unknown):
        same = " and ".join(OPTIONS[name] for name in constant)
        text += f"; if the value is the same in all rows, state it: {same}"
    if "phi_deg" in missing and "theta_o_deg" not in missing:
        text += f"; if theta_o_deg is negative on the side of the source, state it: {_SIGNED}"
    angles = [name for name in missing if name in ANGLES or name == "bsdf_per_sr"]
    if unknown and angles:
        first = angles[0]
        # Which of several it is would be a guess, and a reflectance is no BSDF.
        is_clear = len(unknown) == len(missing) == 1 and first != "bsdf_per_sr"
        text += f"; if it has another name, state it: {_stating(first, unknown[0] if is_clear else 'HEADER')}"
    return text
