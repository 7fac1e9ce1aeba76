"""Writes the page as-people-have-it.md anew, by running every command on it.

python docs/manual/as_people_have_it.py
"""

import os
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main() -> None:
    """Make the files of the page in a folder of their own, and write what becomes of them."""
    sys.path.insert(0, str(HERE.parents[1]))
    from tests.docs.situation_page import page

    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        text = page(Path(folder))
        os.chdir(HERE)
    (HERE / "as-people-have-it.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
