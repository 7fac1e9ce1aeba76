"""Reading TOML files within bounds."""

import re
import tomllib
from pathlib import Path
from typing import Any

from jaxink.errors import InputRefusedError
from jaxink.files.reading import read_bounded, utf8_text

_MOST_BYTES = 4_000_000
_DEEPEST = 30
_LARGEST_INTEGER = 2**63
# Strings and comments, complete even without their end, and the characters that nest or end a key. Every
# alternative for a string matches once it has begun, so that none is tried twice. Possessive quantifiers
# would ensure it, too, but Python 3.11.2 matches them wrongly (3.11.7 does not).
_SIGNS = re.compile(
    r'"""(?:[^"\\]+|\\(?:.|\Z)|"(?!""))*(?:"""|\Z)'
    r"|'''(?:[^']+|'(?!''))*(?:'''|\Z)"
    r'|"(?:[^"\\\n]+|\\.)*"?'
    r"|'[^'\n]*'?"
    r"|\#[^\n]*"
    r"|[\[\]{}.,=\n]",
    re.DOTALL,
)


def text_of(path: Path, what: str) -> str:
    """Text of a file that describes ``what``."""
    return utf8_text(read_bounded(path, _MOST_BYTES, f"{what} file"), str(path))


def document_of(text: str, source: str) -> dict[str, Any]:
    """The tables of a TOML text; messages name the ``source``."""
    try:
        _require_shallow(text)
        document = tomllib.loads(text)
        _require_small_integers(document)
    except tomllib.TOMLDecodeError as problem:
        raise InputRefusedError(
            f"{source}: is not valid TOML: {problem}.{_toml_hint(text, str(problem))}"
        ) from None
    except InputRefusedError as problem:
        raise InputRefusedError(f"{source}: {problem}") from None
    except ValueError:
        # An integer with more digits than Python converts.
        raise InputRefusedError(f"{source}: {_TOO_LARGE}") from None
    return document


# A number with a decimal comma, after the sign or the bracket before it.
_DECIMAL_COMMA = re.compile(r"=\s*[-+]?\d+,\d+\s*(#|}|$)")


def _toml_hint(text: str, problem: str) -> str:
    """What may be meant by a text that is not TOML."""
    lines = text.splitlines()
    found = re.search(r"at line (\d+)", problem)
    line = lines[int(found[1]) - 1] if found and int(found[1]) <= len(lines) else ""
    if _DECIMAL_COMMA.search(line):
        return " Write numbers with a decimal point, such as 3.0."
    if not any("=" in one for one in lines[:20]) and any(sign in line for sign in ",;\t"):
        return " It looks like a measurement, which is given first; the sample file follows --sample."
    return ""


_TOO_LARGE = "has an integer of more than 64 bits; write it as a decimal number, such as 1e20."


def _require_shallow(text: str) -> None:
    """Reject excessive nesting before the parser takes minutes or fails."""
    n_open = n_dots = 0
    for sign in _SIGNS.finditer(text):
        match text[sign.start()]:
            case "[" | "{":
                n_open, n_dots = n_open + 1, 0
            case "]" | "}":
                n_open, n_dots = max(n_open - 1, 0), 0
            case ".":
                n_dots += 1
            case "," | "=" | "\n":
                n_dots = 0
        if n_open + n_dots > _DEEPEST:
            row = text.count("\n", 0, sign.start()) + 1
            raise InputRefusedError(
                f"row {row} is nested more than {_DEEPEST} levels deep; remove superfluous brackets or dots."
            )


def _require_small_integers(document: dict[str, Any]) -> None:
    """Reject integers beyond the range of TOML, which may not be convertible to floats or decimal digits."""
    waiting: list[tuple[str, Any]] = list(document.items())
    while waiting:
        name, value = waiting.pop()
        if isinstance(value, dict):
            waiting += [(f"{name}.{key}", inner) for key, inner in value.items()]
        elif isinstance(value, list):
            waiting += [(name, inner) for inner in value]
        elif isinstance(value, int) and not -_LARGEST_INTEGER <= value < _LARGEST_INTEGER:
            raise InputRefusedError(f"{name} {_TOO_LARGE}")
