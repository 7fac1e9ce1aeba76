"""Users' text in files that spreadsheets open: shown, never run."""

import re

# What begins a formula, and white space that a spreadsheet takes off before it looks; by OWASP's advice.
_FORMULA = re.compile(r"[\t\r\n]|\s*[=+\-@\uff1d\uff0b\uff0d\uff20]")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_NEXT_CELL = re.compile(r"([,;\t])(?=\s*[=+\-@\uff1d\uff0b\uff0d\uff20])")


def cell(value: object) -> object:
    """A cell of a CSV file: text that would be a formula gets an apostrophe, numbers stay.

    Parameters
    ----------
    value
        Text or anything else.

    Returns
    -------
    object
        What to write.
    """
    is_formula = isinstance(value, str) and _FORMULA.match(value) and not _NUMBER.fullmatch(value)
    return f"'{value}" if is_formula else value


def comment(line: str) -> str:
    """A comment line of a CSV file, which a spreadsheet cuts into cells at its separators.

    Parameters
    ----------
    line
        The line; it begins with a sign that makes no formula.

    Returns
    -------
    str
        With an apostrophe before what would be a formula.
    """
    return _NEXT_CELL.sub(r"\1'", line)
