"""A few sentences and tables on an object, as text for a terminal or as HTML for a notebook."""

import abc
import dataclasses
import textwrap
from collections.abc import Sequence
from html import escape

from jaxink.display import html
from jaxink.display.brief import LINE_WIDTH, MOST_LINES

_GAP = "  "


@dataclasses.dataclass(frozen=True)
class CardTable:
    """A table of plain text.

    Parameters
    ----------
    heads, rows
        Its cells.
    text_columns
        Positions of the columns without numbers.
    title
        Line above it, or empty.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    text_columns: tuple[int, ...] = (0,)
    title: str = ""

    def lines(self) -> list[str]:
        """Aligned columns below their heads; columns without any entry are left out.

        What is wider than a page goes on below, with the first column again.
        """
        shown = [i for i in range(len(self.heads)) if any(row[i] for row in self.rows)]
        columns = [self._aligned(i) for i in shown]
        lines = [self.title] if self.title else []
        for number, part in enumerate(_parts([len(column[0]) for column in columns])):
            lines += [""] if number else []
            lines += (_GAP.join(row).rstrip() for row in zip(*(columns[i] for i in part), strict=True))
        return lines

    def _aligned(self, column: int) -> list[str]:
        """Cells of a column and its head, padded to the widest."""
        cells = [row[column] for row in (self.heads, *self.rows)]
        width = max(map(len, cells))
        return [cell.ljust(width) if column in self.text_columns else cell.rjust(width) for cell in cells]

    def html(self) -> str:
        """The table with its title."""
        title = f"<p><b>{escape(self.title)}</b></p>\n" if self.title else ""
        return title + html.table(self.heads, self.rows, self.text_columns)


def _parts(widths: Sequence[int]) -> list[list[int]]:
    """Positions of columns that fit on a line, each time with the first one."""
    if not widths:
        return []
    parts, used = [[0]], widths[0]
    for column in range(1, len(widths)):
        wider = used + len(_GAP) + widths[column]
        if wider > LINE_WIDTH and len(parts[-1]) > 1:
            parts.append([0])
            wider = widths[0] + len(_GAP) + widths[column]
        parts[-1].append(column)
        used = wider
    return parts


@dataclasses.dataclass(frozen=True)
class Card:
    """What an object says of itself.

    Parameters
    ----------
    title
        First line.
    sentences
        Lines below it.
    tables
        Tables below these.
    remarks
        Lines at the end.
    """

    title: str
    sentences: Sequence[str] = ()
    tables: Sequence[CardTable] = ()
    remarks: Sequence[str] = ()

    def text(self) -> str:
        """Plain text, with an empty line above each table."""
        blocks = [_wrapped([self.title, *self.sentences]), *(t.lines() for t in self.tables if t.rows)]
        if self.remarks:
            blocks.append(_wrapped(self.remarks))
        return "\n\n".join("\n".join(block) for block in blocks)

    def html(self) -> str:
        """HTML without styles, as the notebook shows its own tables."""
        parts = [f"<p><b>{escape(self.title)}</b></p>\n", *map(html.paragraph, self.sentences)]
        parts += [table.html() for table in self.tables if table.rows]
        return f"<div>\n{''.join(parts)}{''.join(map(html.paragraph, self.remarks))}</div>\n"


def _wrapped(sentences: Sequence[str]) -> list[str]:
    lines: list[str] = []
    for sentence in sentences:
        lines += textwrap.wrap(sentence, LINE_WIDTH, subsequent_indent="  ", break_on_hyphens=False)
    return lines


class Presented(abc.ABC):
    """An object whose card is its ``summary()``, its ``repr`` and its display in a notebook."""

    @abc.abstractmethod
    def card(self) -> Card:
        """Sentences and tables on the object."""

    def summary(self) -> str:
        """The card as plain text."""
        return self.card().text()

    def __repr__(self) -> str:
        lines = [line for line in self.summary().splitlines() if line]
        if len(lines) > MOST_LINES:
            lines = [*lines[: MOST_LINES - 1], f"... {len(lines) - MOST_LINES + 1} more lines in summary()"]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return self.card().html()
