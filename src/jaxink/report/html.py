"""A self-contained HTML page and its elements, besides those of `jaxink.display.html`."""

import base64
import math
from collections.abc import Iterable
from html import escape

from jaxink.display.html import class_attribute
from jaxink.numerics.digits import percent, rounded

_STYLE = """
body { font: 10.5pt/1.45 "Helvetica Neue", Arial, sans-serif; color: #1a1a1a; max-width: 78rem;
  margin: 1.5rem auto; padding: 0 1rem; }
h1 { font-size: 1.5em; margin: 0 0 .4em; }
h2 { font-size: 1.15em; margin: 1.8em 0 .5em; border-bottom: 1px solid #999; break-after: avoid; }
p, ul { margin: .5em 0; max-width: 62rem; }
.verdict { border-left: .4em solid #c22f2f; background: #f5f5f5; padding: .7em 1em; font-size: 1.1em;
  break-inside: avoid; }
.verdict.good { border-color: #2f7d3b; }
table { border-collapse: collapse; font-size: .85em; margin: .6em 0; }
th, td { padding: .2em .65em; text-align: right; vertical-align: top; font-variant-numeric: tabular-nums; }
th { border-bottom: 1px solid #333; vertical-align: bottom; }
td { border-bottom: 1px solid #e2e2e2; overflow-wrap: break-word; }
th.text, td.text { text-align: left; }
tr { break-inside: avoid; }
thead { display: table-header-group; }
figure { margin: 1.2em 0; break-inside: avoid; }
figure img { max-width: 100%; max-height: 160mm; display: block; }
figcaption { font-size: .9em; color: #444; max-width: 62rem; }
code { font-size: .95em; }
@page { size: A4 landscape; margin: 12mm; }
@media print { body { max-width: none; margin: 0; padding: 0; font-size: 9.5pt; } }
"""
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


def bullets(lines: Iterable[str]) -> str:
    """A list of sentences."""
    return "<ul>\n" + "".join(f"<li>{escape(line)}</li>\n" for line in lines) + "</ul>\n"


def figure(png: bytes, caption: str) -> str:
    """A figure embedded in the page."""
    data = base64.b64encode(png).decode("ascii")
    words = escape(caption, quote=True)
    return (
        f'<figure><img alt="{words}" src="data:image/png;base64,{data}">'
        f"<figcaption>{words}</figcaption></figure>\n"
    )


def section(title: str, *parts: str) -> str:
    """Parts below a heading."""
    return f"<section>\n<h2>{escape(title)}</h2>\n{''.join(parts)}</section>\n"


def document(title: str, *parts: str) -> str:
    """The whole page."""
    head = f'<meta charset="utf-8">\n<title>{escape(title)}</title>\n<style>{_STYLE}</style>'
    body = f"<h1>{escape(title)}</h1>\n{''.join(parts)}"
    return f'<!DOCTYPE html>\n<html lang="en">\n<head>\n{head}\n</head>\n<body>\n{body}</body>\n</html>\n'
