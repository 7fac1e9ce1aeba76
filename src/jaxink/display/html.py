"""Elements of HTML; all text is escaped here."""

from collections.abc import Iterable, Sequence
from html import escape


def paragraph(text: str, kind: str = "") -> str:
    """A paragraph of plain text."""
    return f"<p{class_attribute(kind)}>{escape(text)}</p>\n"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], text_columns: Iterable[int] = (0,)) -> str:
    """A table of plain text; ``text_columns`` are the positions of columns without numbers."""
    kinds = dict.fromkeys(text_columns, "text")

    def cells(row, tag):
        shown = (f"<{tag}{class_attribute(kinds.get(i, ''))}>{escape(c)}</{tag}>" for i, c in enumerate(row))
        return f"<tr>{''.join(shown)}</tr>\n"

    body = "".join(cells(row, "td") for row in rows)
    return f"<table>\n<thead>{cells(heads, 'th')}</thead>\n<tbody>\n{body}</tbody>\n</table>\n"


def class_attribute(name: str) -> str:
    """Attribute ``class`` of an element, or nothing."""
    return f' class="{name}"' if name else ""
