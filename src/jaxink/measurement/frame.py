"""A table in memory, such as a pandas DataFrame, as cells; only its columns and their values are used."""

from typing import Any

import numpy as np

from jaxink.measurement.header import require_names
from jaxink.measurement.table import TextTable, refusal

_MISSING = ("nan", "NaN", "NaT", "None", "<NA>")


def is_frame(data: Any) -> bool:
    """Whether the object is a table of named columns."""
    return hasattr(data, "columns") and hasattr(data, "__getitem__") and not isinstance(data, str)


def table_of(frame: Any, source: str) -> TextTable:
    """The cells of a table in memory; rows are counted from 0, as by ``iloc``.

    Raises
    ------
    InputRefusedError
        If it has no column or no row, two columns of one name, or too many.
    """
    labels = list(frame.columns)
    names = tuple(_name(label) for label in labels)
    if not names:
        raise refusal(source, "has no columns")
    require_names(source, names, 0, ())
    for name in names:
        if names.count(name) > 1:
            raise refusal(source, "the column occurs twice", column=name)
    columns = [[_cell(value) for value in list(frame[label])] for label in labels]
    rows = tuple(zip(*columns, strict=True))
    if not rows:
        raise refusal(source, "has columns but no rows")
    return TextTable(source, names, rows, np.arange(len(rows)), 0, ())


def _name(label: Any) -> str:
    """A label, of several levels too."""
    parts = label if isinstance(label, tuple) else (label,)
    return " ".join(str(part) for part in parts if str(part)).strip()


def _cell(value: Any) -> str:
    """A value as it would stand in a file, with all of its digits."""
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else repr(float(value))
    if isinstance(value, np.generic):
        value = value.item()
    text = str(value)
    return "" if text in _MISSING else text
