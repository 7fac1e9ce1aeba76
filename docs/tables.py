"""Writes the tables of these pages anew, from the catalogue of effects.

python docs/tables.py
"""

import re
from collections.abc import Iterable
from pathlib import Path

from jaxink.effects import CATALOGUE, Effect

HERE = Path(__file__).parent
_TABLE = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end of table -->\n)", re.DOTALL)


def effects(catalogue: Iterable[type[Effect]]) -> str:
    """The catalogue of effects."""
    sign = {0: "either", 1: "0 or more"}
    rows = [
        [f"`{e.name}`", e.group, sign[e.sign], f"{e.usual:g}".replace("inf", "-"), e.statement]
        for e in catalogue
    ]
    return _markdown(["effect", "group", "strength", "usual size", "what is the case"], rows)


def _markdown(heads: list[str], rows: Iterable[list[str]]) -> str:
    body = [f"| {' | '.join(row)} |\n" for row in rows]
    return "".join([f"| {' | '.join(heads)} |\n", "|---" * len(heads) + "|\n", *body])


# Text of each table by the name in its marker, for each page.
PAGES = {"diagnosis.md": {"CATALOGUE": effects(CATALOGUE)}}


def with_tables(page: str, text: str) -> str:
    """Text of a page with its tables as they are now, each of them once."""
    tables = PAGES[page]
    names = [name for _, name, _ in _TABLE.findall(text)]
    assert sorted(names) == sorted(tables), f"{page} has the tables {names}, not {list(tables)}"
    return _TABLE.sub(lambda found: found[1] + tables[found[2]] + found[3], text)


if __name__ == "__main__":
    for name in PAGES:
        path = HERE / name
        path.write_text(with_tables(name, path.read_text(encoding="utf-8")), encoding="utf-8")
