"""A table in memory, a pandas DataFrame or a dict of columns, as cells."""

from typing import Any

import numpy as np

from jaxink.measurement.header import require_names
from jaxink.measurement.table import TextTable, refusal

_MISSING = ("nan", "NaN", "NaT", "None", "<NA>")


def is_frame(data: Any) -> bool:
    """Whether the object is a table of named columns."""
    is_framed = hasattr(data, "columns") and hasattr(data, "__getitem__") and not isinstance(data, str)
    return is_framed or isinstance(data, dict)


def kind_of(frame: Any) -> str:
    """What messages call a table in memory."""
    return "dict" if isinstance(frame, dict) else "DataFrame"


def table_of(frame: Any, source: str) -> TextTable:
    """The cells of a table in memory; rows are counted from 0, as by ``iloc``.

    An entry of a dict that is one number or one text is that of all rows.

    Raises
    ------
    InputRefusedError
        If it has no column or no row, two columns of one name, columns of several lengths, or too many.
    """
    if isinstance(frame, dict):
        frame = _Columns(frame)
    labels = list(frame.columns)
    names = tuple(_name(label) for label in labels)
    if not names:
        raise refusal(source, "has no columns")
    require_names(source, names, 0, ())
    for name in names:
        if names.count(name) > 1:
            raise refusal(source, "the column occurs twice", column=name)
    columns = [[_cell(value) for value in list(frame[label])] for label in labels]
    for name, column in zip(names, columns, strict=True):
        if len(column) != len(columns[0]):
            text = f"has {len(column)} entries, but column {names[0]} has {len(columns[0])}"
            raise refusal(source, text, column=name)
    rows = tuple(zip(*columns, strict=True))
    if not rows:
        raise refusal(source, "has columns but no rows")
    return TextTable(source, names, rows, np.arange(len(rows)), 0, ())


class _Columns(dict):
    """A dict of columns as a table; an entry alone is repeated."""

    def __init__(self, columns: dict):
        size = max((len(values) for values in columns.values() if np.ndim(values) > 0), default=1)
        super().__init__({n: [v] * size if np.ndim(v) == 0 else v for n, v in columns.items()})

    @property
    def columns(self) -> list:
        """Names of the columns."""
        return list(self)


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
