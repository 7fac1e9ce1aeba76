"""Keys and values of TOML as text."""

import json
import re
from collections.abc import Mapping
from typing import Any


def toml_key(word: str) -> str:
    """A key, in quotation marks where it needs them."""
    return word if re.fullmatch(r"[A-Za-z0-9_-]+", word) else json.dumps(word, ensure_ascii=False)


def toml_value(value: Any) -> str:
    """A value of a project file."""
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{toml_key(key)} = {toml_value(inner)}' for key, inner in value.items())} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    return json.dumps(value, ensure_ascii=False)
