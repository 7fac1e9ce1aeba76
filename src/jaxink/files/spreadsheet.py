"""Users' text in files that spreadsheets open: displayed, never executed."""

import re

# Start of a formula, after white space that spreadsheets strip (recommendation of OWASP).
_FORMULA = re.compile(r"[\t\r\n]|\s*[=+\-@\uff1d\uff0b\uff0d\uff20]")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NEXT_CELL = re.compile(r"([,;\t])(?=\s*[=+\-@\uff1d\uff0b\uff0d\uff20])")


def cell(value: object) -> object:
    """Value to write to a cell of a CSV file: text that would be a formula gets an apostrophe in front."""
    is_formula = isinstance(value, str) and _FORMULA.match(value) and not _NUMBER.fullmatch(value)
    return f"'{value}" if is_formula else value


def comment(line: str) -> str:
    """Comment line of a CSV file, with an apostrophe before every cell that would be a formula.

    Spreadsheets split comments at separators. The line must not itself begin like a formula.
    """
    return _NEXT_CELL.sub(r"\1'", line)
