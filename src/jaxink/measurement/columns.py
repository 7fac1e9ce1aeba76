"""Assignment of the columns of a file to quantities."""

import difflib
import re

from jaxink.measurement.table import TextTable, refusal

ANGLES = ("theta_i_deg", "theta_o_deg", "phi_deg")
REQUIRED = (*ANGLES, "wavelength_nm", "side", "bsdf_per_sr")
KNOWN = (*REQUIRED, "sigma_per_sr")
# How to state one value for all rows, on the command line and in Python.
OPTIONS = {
    "wavelength_nm": "--wavelength-nm NM (in Python: wavelength_nm=NM)",
    "side": "--side R or --side T (in Python: side='R' or side='T'; with several files, --side R,T: one for "
    "each)",
}

_RADIANS = "holds radians; multiply by 180/pi and name the column {}_deg"
_OTHER_UNITS = {
    **{f"{a}_{u}": _RADIANS.format(a) for a in ("theta_i", "theta_o", "phi") for u in ("rad", "radians")},
    "wavelength_um": "holds micrometres; multiply by 1000 and name the column wavelength_nm",
    "wavelength_micron": "holds micrometres; multiply by 1000 and name the column wavelength_nm",
    "wavelength_m": "holds metres; multiply by 1e9 and name the column wavelength_nm",
    "wavelength_angstrom": "holds angstrom; divide by 10 and name the column wavelength_nm",
    "brf": "holds reflectance factors; divide by pi and name the column bsdf_per_sr",
    "reflectance_factor": "holds reflectance factors; divide by pi and name the column bsdf_per_sr",
    "bsdf_cos": "holds the BSDF times a cosine; divide by cos(theta_o) and name it bsdf_per_sr",
}
# Uncertainties without a unit: keeping them as an unused extra column would ignore the user's weights.
_VAGUE_SIGMA = ("sigma", "std", "stdev", "stderr", "error", "uncertainty")


def plain_name(name: str) -> str:
    """A column name in small letters, digits and underscores: ``phi [deg]`` is ``phi_deg``."""
    return re.sub(r"[^0-9a-z]+", "_", name.lower()).strip("_")


def match_columns(
    table: TextTable, columns: dict[str, str], supplied: tuple[str, ...]
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
    names = _renamed(table, columns, notes)
    known, extra = {}, {}
    for index, name in enumerate(names):
        if not name:
            _drop_blank_column(table, index, notes)
            continue
        target = plain if (plain := plain_name(name)) in KNOWN else name
        if target in known or target in extra:
            raise refusal(table.source, "the column occurs twice in the header", column=target)
        if target in KNOWN:
            known[target] = index
            if name != target:
                notes.append(f"Column '{name}' is read as {target}.")
        else:
            extra[name] = index
    _refuse_other_units(table, known, extra)
    _refuse_misspelt(table, known, extra, supplied)
    _refuse_missing(table, known, supplied)
    return known, extra, notes


def _renamed(table, columns, notes) -> list[str]:
    names = list(table.names)
    for target, name in columns.items():
        if target not in KNOWN:
            text = f"columns has the key '{target}'; it must be one of {', '.join(KNOWN)}"
            raise refusal(table.source, text)
        if name not in names:
            text = f"columns assigns it to {target}, but the header contains {', '.join(table.names)}"
            raise refusal(table.source, text, column=name)
        names[names.index(name)] = target
        notes.append(f"Column '{name}' is read as {target}, as requested by the caller.")
    return names


def _drop_blank_column(table, index, notes):
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
            raise refusal(table.source, _OTHER_UNITS[plain], column=name)
        if plain in _VAGUE_SIGMA and not {"value", "unit"} <= set(extra):
            text = (
                "the uncertainty has no unit; convert it to 1/sr and name the column sigma_per_sr, or "
                "rename the column if it is something else"
            )
            raise refusal(table.source, text, column=name)


def _refuse_misspelt(table, known, extra, supplied):
    absent = [name for name in KNOWN if name not in known and name not in supplied]
    for name in extra:
        near = difflib.get_close_matches(name.lower(), absent, n=1, cutoff=0.75)
        if near:
            raise refusal(table.source, f"the name is unknown; the most similar is {near[0]}", column=name)


def _refuse_missing(table, known, supplied):
    missing = [name for name in REQUIRED if name not in known and name not in supplied]
    if not missing:
        return
    header = ", ".join(table.names)
    if missing[0] == "bsdf_per_sr" or {"value", "unit"} <= set(table.names):
        if {"value", "unit"} <= set(table.names):
            unit = table.column(table.names.index("unit"))[0]
            text = (
                f"column bsdf_per_sr is missing; column value is in '{unit}', a total or ratio from "
                "which the BSDF of a direction in 1/sr cannot be derived"
            )
            raise refusal(table.source, text)
        text = f"column bsdf_per_sr (radiance over irradiance in 1/sr) is missing; the header has {header}"
        raise refusal(table.source, text)
    plural, verb = ("columns", "are") if len(missing) > 1 else ("column", "is")
    text = f"{plural} {', '.join(missing)} {verb} missing; the header has {header}"
    if set(missing) <= OPTIONS.keys():
        text += f"; if the value is the same in all rows, state it: {' and '.join(map(OPTIONS.get, missing))}"
    elif missing == ["phi_deg"]:
        text += (
            "; if theta_o_deg is negative on the side of the source, state it: --signed-angles (in Python: "
            "signed_angles=True)"
        )
    raise refusal(table.source, text)
