"""The copies for reading on a web page are those of the notebooks, and small."""

import re

import pytest

from benchmarks.render_notebooks import (
    NOTEBOOKS,
    RENDERED,
    cells,
    names,
    outputs,
    rendered_code,
    rendered_text,
)
from tests.docs.test_documents import ROOT

# All files of a page together.
MOST_BYTES = 300_000


@pytest.mark.parametrize("name", names())
def test_rendered_copy_has_the_same_cells(name):
    page, notebook = RENDERED / f"{name}.md", cells(NOTEBOOKS / f"{name}.py")
    assert rendered_code(page) == [cell.source for cell in notebook if cell.is_code]
    text = page.read_text(encoding="utf-8")
    for cell in notebook:
        assert cell.is_code or rendered_text(cell.source) in text


@pytest.mark.parametrize("name", names())
def test_rendered_copy_has_its_pictures_and_is_small(name):
    page = RENDERED / f"{name}.md"
    pictures = re.findall(r"!\[output\]\((.*?)\)", page.read_text(encoding="utf-8"))
    assert {p.name for p in RENDERED.glob(f"{name}-*.png")} == set(pictures) != set()
    assert sum(file.stat().st_size for file in RENDERED.glob(f"{name}[.-]*")) < MOST_BYTES


@pytest.mark.parametrize(
    "path", sorted([*NOTEBOOKS.glob("*.py"), *RENDERED.glob("*.md")]), ids=lambda p: p.name
)
def test_links_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", path.read_text(encoding="utf-8")):
        assert target.startswith("https://") or (path.parent / target).exists(), target


def test_all_pages_are_of_notebooks_and_in_the_manual():
    manual = (ROOT / "docs" / "manual" / "library.md").read_text(encoding="utf-8")
    assert sorted(page.stem for page in RENDERED.glob("*.md")) == names()
    for name in names():
        page = (RENDERED / f"{name}.md").relative_to(ROOT).as_posix()
        assert f"](../../{page})" in manual, page


def test_a_notebook_says_what_it_needs_and_how_long_it_takes():
    for name in names():
        first = cells(NOTEBOOKS / f"{name}.py")[0]
        assert not first.is_code
        assert re.search(
            r"\bNeeds .*\bTakes\s+(about\s+)?\d+\s+s\s+of\s+processor\s+time", first.source, re.DOTALL
        ), name


def test_a_cell_shows_its_text_its_last_value_and_its_figures():
    source = "import matplotlib.pyplot as plt\nplt.figure()\nprint('printed')\n1 + 1"
    text, value, picture = outputs(source, {}, lambda png: png[1:4].decode())
    assert (text, value, picture) == ("```text\nprinted\n```", "```text\n2\n```", "PNG")
    assert not list(outputs("x = 3", {}, repr))


def test_links_of_a_page_lead_one_folder_up_or_to_other_pages():
    text = "[a](https://example.org) [b](#here) [c](data/README.md) [d](../docs/x.md#y) [e](first_fit.py)"
    moved = (
        "[a](https://example.org) [b](#here) [c](../data/README.md) [d](../../docs/x.md#y) [e](first_fit.md)"
    )
    assert rendered_text(text) == moved
