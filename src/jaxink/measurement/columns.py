"""Which column of a file is which quantity."""

import difflib
import re

from jaxink.measurement.table import TextTable, refusal

ANGLES = ("theta_i_deg", "theta_o_deg", "phi_deg")
REQUIRED = (*ANGLES, "wavelength_nm", "side", "bsdf_per_sr")
KNOWN = (*REQUIRED, "sigma_per_sr")

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
# Uncertainties without a unit: to keep them as an unused extra column would lose the user's weights.
_VAGUE_SIGMA = ("sigma", "std", "stdev", "stderr", "error", "uncertainty")


def match_columns(
    table: TextTable, columns: dict[str, str], supplied: tuple[str, ...]
) -> tuple[dict[str, int], dict[str, int], list[str]]:
    """Find the known columns of a table.

    Parameters
    ----------
    table
        The table as read.
    columns
        Known name to the file's name, for columns that the caller renames.
    supplied
        Known names that the caller gives as one value, so that their column may be absent.

    Returns
    -------
    known, extra, notes
        Known name to column index, other name to column index, sentences on what was handled.

    Raises
    ------
    InputRefusedError
        A required column is missing or misspelt, twice there, or in another unit.
    """
    notes: list[str] = []
    names = _renamed(table, columns, notes)
    known, extra = {}, {}
    for index, name in enumerate(names):
        if not name:
            _drop_blank_column(table, index, notes)
            continue
        plain = re.sub(r"[^0-9a-z]+", "_", name.lower()).strip("_")
        target = plain if plain in KNOWN else name
        if target in known or target in extra:
            raise refusal(table.source, "the column stands twice in the header", column=target)
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
            text = f"columns renames '{target}', which is none of {', '.join(KNOWN)}"
            raise refusal(table.source, text)
        if name not in names:
            text = f"columns names it for {target}, but the header holds {', '.join(table.names)}"
            raise refusal(table.source, text, column=name)
        names[names.index(name)] = target
        notes.append(f"Column '{name}' is read as {target}, as the caller said.")
    return names


def _drop_blank_column(table, index, notes):
    for line, cell in zip(table.lines, table.column(index), strict=True):
        if cell:
            text = f"the cell '{cell}' stands under an empty column name; name the column"
            raise refusal(table.source, text, line, index + 1)
    notes.append(f"Column {index + 1} has neither name nor content and was left out.")


def _refuse_other_units(table, known, extra):
    for name in extra:
        plain = re.sub(r"[^0-9a-z]+", "_", name.lower()).strip("_")
        stem, _, unit = plain.rpartition("_")
        about_bsdf = "bsdf_per_sr" not in known or stem.startswith(("bsdf", "sigma"))
        if unit in ("percent", "pct") and about_bsdf:
            target = "sigma_per_sr" if stem.startswith("sigma") else "bsdf_per_sr"
            text = f"holds per cent; convert it to 1/sr and name the column {target}"
            raise refusal(table.source, text, column=name)
        if plain in _OTHER_UNITS:
            raise refusal(table.source, _OTHER_UNITS[plain], column=name)
        if plain in _VAGUE_SIGMA and not {"value", "unit"} <= set(extra):
            text = (
                "an uncertainty without a unit; convert it to 1/sr and name the column "
                "sigma_per_sr, or rename it if it is something else"
            )
            raise refusal(table.source, text, column=name)


def _refuse_misspelt(table, known, extra, supplied):
    absent = [name for name in KNOWN if name not in known and name not in supplied]
    for name in extra:
        near = difflib.get_close_matches(name.lower(), absent, n=1, cutoff=0.75)
        if near:
            text = f"the name is not known; did you mean {near[0]}"
            raise refusal(table.source, text, column=name)


def _refuse_missing(table, known, supplied):
    missing = [name for name in REQUIRED if name not in known and name not in supplied]
    if not missing:
        return
    header = ", ".join(table.names)
    if missing[0] == "bsdf_per_sr" or {"value", "unit"} <= set(table.names):
        if {"value", "unit"} <= set(table.names):
            unit = table.column(table.names.index("unit"))[0]
            text = (
                f"column bsdf_per_sr is missing: column value is in '{unit}', a total or ratio from "
                "which the BSDF in 1/sr of one direction does not follow"
            )
            raise refusal(table.source, text)
        text = f"column bsdf_per_sr (radiance over irradiance in 1/sr) is missing from {header}"
        raise refusal(table.source, text)
    plural = "columns" if len(missing) > 1 else "column"
    verb = "are" if len(missing) > 1 else "is"
    text = f"{plural} {', '.join(missing)} {verb} missing; the header holds {header}"
    if set(missing) <= {"wavelength_nm", "side"}:
        text += f"; if all rows share one, pass {' and '.join(missing)} to read_csv"
    raise refusal(table.source, text)
