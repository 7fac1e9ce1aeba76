"""``parameters.csv``: the parameters of a fit for a spreadsheet, one row for each name and wavelength."""

import csv
import io
import math

from jaxink.files.result_folder import PARAMETER_COLUMNS
from jaxink.files.spreadsheet import cell
from jaxink.fitting.fitted_parameters import FittedParameter, FittedParameters


def parameter_text(parameters: FittedParameters) -> str:
    """Text of the file: all digits of the numbers, blank where there is none."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(PARAMETER_COLUMNS)
    table.writerows([cell(value) for value in _row(p)] for p in parameters.values())
    return text.getvalue()


def _row(p: FittedParameter) -> list[object]:
    name, _, wavelength_nm = p.name.partition("@")
    state = "free" if p.free else "fixed" if p.tie is None else "tied"
    numbers = [_number(value) for value in (p.value, p.standard_error, p.minimum, p.maximum)]
    return [name, wavelength_nm, *numbers[:2], p.unit, *numbers[2:], state, "; ".join(_notes(p))]


def _number(value: float | None) -> str:
    return repr(float(value)) if value is not None and math.isfinite(value) else ""


def _notes(p: FittedParameter) -> list[str]:
    notes = [p.flag] if p.flag else []
    if p.tie is not None:
        notes.append(f"tied: {p.tie}")
    if p.interval is not None:
        notes.append(f"{p.interval[0]!r} to {p.interval[1]!r} by profile likelihood")
    return notes
