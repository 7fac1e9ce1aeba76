"""Rows of a table by name: what `parameters` is, of a sample, of a fit and of a diagnosis."""

import dataclasses
import difflib
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from jaxink.display.brief import MOST_LINES, brief
from jaxink.display.card import CardTable
from jaxink.errors import NoSuchNameError, no_such_name

if TYPE_CHECKING:
    import pandas

RowT = TypeVar("RowT")


class NamedRows(Mapping[str, RowT]):
    """An ordered, immutable table of rows by name; each row is a dataclass or a named tuple.

    Parameters
    ----------
    rows
        The rows.
    """

    def __init__(self, rows: Mapping[str, RowT]):
        self._by_name = dict(rows)

    def __getitem__(self, name: str) -> RowT:
        if name not in self._by_name:
            near = difflib.get_close_matches(str(name), list(self._by_name), n=3)
            raise NoSuchNameError(f"{name!r} is asked for, {no_such_name(self, ' or '.join(near))}")
        return self._by_name[name]

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def __iter__(self) -> Iterator[str]:
        return iter(self._by_name)

    def __len__(self) -> int:
        return len(self._by_name)

    def to_frame(self) -> "pandas.DataFrame":
        """The table as a pandas DataFrame: one line for each name, one column for each field."""
        import pandas

        index = pandas.Index(list(self), name="name", dtype=object)
        return pandas.DataFrame([_fields_of(row) for row in self.values()], index=index)

    def table(self) -> CardTable:
        """The table as text; fields without any value are left out."""
        rows = [_fields_of(row) for row in self.values()]
        heads = [head for head in (rows[0] if rows else ()) if any(_says(row[head]) for row in rows)]
        cells = [[name, *(_cell(row[head]) for head in heads)] for name, row in zip(self, rows, strict=True)]
        words = tuple(
            i + 1 for i, head in enumerate(heads) if any(isinstance(row[head], str) for row in rows)
        )
        return CardTable(["name", *heads], cells, (0, *words))

    def __repr__(self) -> str:
        lines = self.table().lines() if self else []
        if len(lines) > MOST_LINES - 1:
            lines = [*lines[: MOST_LINES - 2], f"... {len(self) - MOST_LINES + 3} more"]
        return "\n".join([f"{type(self).__name__} with {len(self)} rows", *lines])

    def _repr_html_(self) -> str:
        return self.table().html()


def _fields_of(row: Any) -> dict[str, Any]:
    """Fields of a row without its name, which is that of the line."""
    if dataclasses.is_dataclass(row):
        return {f.name: getattr(row, f.name) for f in dataclasses.fields(row) if f.name != "name"}
    return {name: value for name, value in row._asdict().items() if name != "name"}


def _says(value: Any) -> bool:
    return value is not None and value != ""


def _cell(value: Any) -> str:
    return value if isinstance(value, str) else "" if value is None else brief(value)
