"""A self-contained HTML page and its elements, besides those of `jaxink.display.html`."""

import base64
import dataclasses
import math
from collections.abc import Iterable, Sequence
from html import escape

from jaxink.display.html import class_attribute, table
from jaxink.numerics.digits import percent, rounded

_STYLE = """
body { font: 10.5pt/1.45 "Helvetica Neue", Arial, sans-serif; color: #1a1a1a; max-width: 66rem;
  margin: 1.5rem auto; padding: 0 1rem; }
h1 { font-size: 1.5em; margin: 0 0 .4em; }
h2 { font-size: 1.15em; margin: 1.8em 0 .5em; border-bottom: 1px solid #999; break-after: avoid; }
p, ul, ol { margin: .5em 0; max-width: 62rem; }
.verdict { border-left: .4em solid #c22f2f; background: #f5f5f5; padding: .7em 1em; font-size: 1.1em;
  break-inside: avoid; }
.verdict.good { border-color: #2f7d3b; }
.steps li, nav { break-inside: avoid; }
pre { background: #f5f5f5; padding: .3em .6em; margin: .2em 0 .6em; white-space: pre-wrap;
  overflow-wrap: anywhere; }
nav ol { columns: 2; max-width: 40rem; }
table { border-collapse: collapse; font-size: .85em; margin: .6em 0; break-inside: avoid; }
th, td { padding: .2em .5em; text-align: right; vertical-align: top; font-variant-numeric: tabular-nums; }
th { border-bottom: 1px solid #333; vertical-align: bottom; }
td { border-bottom: 1px solid #e2e2e2; overflow-wrap: break-word; }
th.text, td.text { text-align: left; }
tr { break-inside: avoid; }
p:has(+ table) { break-after: avoid; }
thead { display: table-header-group; }
figure { margin: 1.2em 0; break-inside: avoid; }
figure img { max-width: 100%; height: auto; display: block; }
figcaption { font-size: .9em; color: #444; max-width: 62rem; }
code, pre { font-size: .92em; }
.beside { display: flex; flex-wrap: wrap; gap: .5em 2.5em; align-items: center; break-inside: avoid; }
.numbers { display: grid; grid-template-columns: auto 1fr; gap: .3em .8em; margin: .5em 0;
  align-items: baseline; }
.numbers dt { font-size: 1.25em; font-weight: bold; text-align: right; white-space: nowrap;
  font-variant-numeric: tabular-nums; }
.numbers dd { margin: 0; }
svg { font: 12px "Helvetica Neue", Arial, sans-serif; max-width: 100%; }
details { border-top: 1px solid #ccc; }
summary { cursor: pointer; padding: .35em 0; font-weight: bold; break-inside: avoid; }
@page { size: A4 portrait; margin: 12mm; }
@media print { body { max-width: none; margin: 0; padding: 0; font-size: 9pt; }
  th, td { padding: .15em .35em; } a { color: inherit; text-decoration: none; } }
"""
# Rows of a table that fit on a printed page, even if some take three lines.
_ROWS_OF_A_PAGE = 20
# Height of a printed page that a figure may take beside its caption.
_PAGE_INCH = 8.8
# Shown in a cell without a number.
NONE = "\N{EN DASH}"


def number(value: float | None, digits: int = 4) -> str:
    """A number, or a dash."""
    if value is not None and math.isinf(value):
        return "unlimited"
    return rounded(value, digits, NONE)


def share(value: float | None) -> str:
    """A fraction in per cent."""
    return percent(value, missing=NONE)


def chance(p_value: float | None) -> str:
    """A probability."""
    return "below 1e-300" if p_value == 0 else number(p_value, 2)


def verdict(sentence: str, code: str, is_good: bool) -> str:
    """The verdict with its code."""
    kind = "verdict good" if is_good else "verdict"
    return f"<p{class_attribute(kind)}>{escape(sentence)}<br><code>{escape(code)}</code></p>\n"


def commands(steps: Iterable[tuple[str, str]]) -> str:
    """What to do next, each with the command to type, if any."""
    items = ""
    for words, command in steps:
        typed = f"<pre>{escape(command)}</pre>" if command else ""
        items += f"<li>{escape(words)}{typed}</li>\n"
    return f'<h2>Next</h2>\n<ol class="steps">\n{items}</ol>\n'


def tables(heads: Sequence[str], rows: Iterable[Sequence[str]], text_columns: Iterable[int] = (0,)) -> str:
    """A long table in parts that fit on a printed page, each with its heads."""
    rows, columns = list(rows), tuple(text_columns)
    starts = range(0, max(len(rows), 1), _ROWS_OF_A_PAGE)
    return "".join(table(heads, rows[start : start + _ROWS_OF_A_PAGE], columns) for start in starts)


def bullets(lines: Iterable[str]) -> str:
    """A list of sentences."""
    return "<ul>\n" + "".join(f"<li>{escape(line)}</li>\n" for line in lines) + "</ul>\n"


def figure(png: bytes, caption: str) -> str:
    """A figure embedded in the page."""
    # Takes matplotlib, which a page without figures can do without.
    from jaxink.plots import DPI

    data = base64.b64encode(png).decode("ascii")
    words = escape(caption, quote=True)
    # From the header of the file: figures keep their size, and with it that of their letters, unless they
    # are higher than a printed page, which makes them smaller as a whole.
    wide, tall = (int.from_bytes(png[at : at + 4]) / DPI for at in (16, 20))
    width = wide * min(1.0, _PAGE_INCH / tall)
    return (
        f'<figure><img style="width: {width:.2f}in" alt="{words}" src="data:image/png;base64,{data}">'
        f"<figcaption>{words}</figcaption></figure>\n"
    )


@dataclasses.dataclass(frozen=True)
class Section:
    """A part of the page with a heading, which the contents list."""

    title: str
    content: str

    @property
    def anchor(self) -> str:
        """Name that links refer to."""
        return "-".join("".join(c if c.isalnum() else " " for c in self.title.lower()).split())


def section(title: str, *parts: str) -> Section:
    """Parts below a heading."""
    return Section(title, "".join(parts))


def numbers(values: Iterable[tuple[str, str]]) -> str:
    """Few numbers in large letters, each with what it is."""
    items = "".join(f"<dt>{escape(value)}</dt><dd>{escape(what)}</dd>\n" for value, what in values)
    return f"<dl{class_attribute('numbers')}>\n{items}</dl>\n"


def beside(*parts: str) -> str:
    """Parts next to each other, where the page is wide enough."""
    return f"<div{class_attribute('beside')}>\n{''.join(f'<div>{part}</div>' for part in parts)}</div>\n"


def document(
    title: str, top: str, sections: Iterable[Section], folded: Iterable[Section] | None = None
) -> str:
    """The whole page: what comes first, the sections, and details that open on a click.

    Without details there is a list of contents instead.
    """
    parts = list(sections)
    shown = "".join(
        f'<section id="{part.anchor}">\n<h2>{escape(part.title)}</h2>\n{part.content}</section>\n'
        for part in parts
    )
    if folded is None:
        items = "".join(f'<li><a href="#{part.anchor}">{escape(part.title)}</a></li>\n' for part in parts)
        shown = f"<nav>\n<h2>Contents</h2>\n<ol>\n{items}</ol>\n</nav>\n{shown}"
    else:
        items = "".join(
            f'<details id="{part.anchor}">\n<summary>{escape(part.title)}</summary>\n'
            f"{part.content}</details>\n"
            for part in folded
        )
        shown += f'<section id="details">\n<h2>Details</h2>\n{items}</section>\n'
    head = f'<meta charset="utf-8">\n<title>{escape(title)}</title>\n<style>{_STYLE}</style>'
    body = f"<h1>{escape(title)}</h1>\n{top}{shown}"
    return f'<!DOCTYPE html>\n<html lang="en">\n<head>\n{head}\n</head>\n<body>\n{body}</body>\n</html>\n'
