"""Links that somebody has put into the folder of a batch: their targets are neither emptied nor removed."""

import json
import os
import re
import sys

import pytest

from tests.batches.test_run import ANSWERED, run, values

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="links and locks of Unix")
KEPT = "somebody's own words"


@pytest.fixture
def own(tmp_path_factory):
    """A folder with a file that no batch may touch."""
    place = tmp_path_factory.mktemp("home")
    (place / "own.txt").write_text(KEPT)
    yield place
    assert (place / "own.txt").read_text() == KEPT
    assert os.listdir(place) == ["own.txt"]


@pytest.fixture
def planted(folder):
    (folder / "out").mkdir()
    return folder / "out"


@pytest.mark.parametrize("kind", ["link", "broken link", "pipe", "folder"])
def test_a_lock_that_is_no_file_is_refused(kind, folder, planted, own, refused):
    lock = planted / ".lock"
    if kind == "pipe":
        os.mkfifo(lock)
    elif kind == "folder":
        lock.mkdir()
    else:
        lock.symlink_to(own / ("own.txt" if kind == "link" else "new.txt"))
    with refused(lock):
        run(folder)


def test_a_lock_keeps_what_is_in_it(folder, planted):
    (planted / ".lock").write_text(KEPT)
    run(folder)
    assert (planted / ".lock").read_text() == KEPT


@pytest.mark.parametrize("name", ["results", "rows"])
def test_folders_that_are_links_are_refused(name, folder, planted, own, refused):
    (planted / name).symlink_to(own)
    with refused(planted / name):
        run(folder)


@pytest.mark.parametrize(
    "name", ["running.json", "running.json.part", "rows/sheet_1.json", "summary.csv", "report.html"]
)
def test_files_that_are_links_are_replaced_and_not_followed(name, folder, planted, own):
    (planted / name).parent.mkdir(exist_ok=True)
    (planted / name).symlink_to(own / "own.txt")
    assert len(values(run(folder))) == 3
    # In a later batch it is a file of its own.
    assert run(folder, ANSWERED).kept == 3


@pytest.mark.parametrize("target", ["", "own.txt"])
def test_a_result_that_is_a_link_is_replaced(target, folder, planted, own):
    (planted / "results").mkdir()
    (planted / "results/sheet_2").symlink_to(own / target)
    assert len(values(run(folder))) == 3
    assert not (planted / "results/sheet_2").is_symlink()
    assert (planted / "results/sheet_2/fit.html").exists()


def test_the_folder_itself_may_be_a_link(folder, tmp_path_factory):
    place = tmp_path_factory.mktemp("large disk")
    (folder / "out").symlink_to(place)
    assert len(values(run(folder))) == 3
    assert (place / "summary.csv").exists()


ELSEWHERE = (
    *("../own.html", "results/../own.html", "results/sheet_1/../../own.html", "results/sheet_9/fit.html"),
    *("results/sheet_1\\..\\own.html", "/etc/passwd", "javascript:alert(1)", "https://example.org/fit.html"),
    *("//example.org/fit.html", "file:///etc/passwd", "results/sheet_1", "results/sheet_1/."),
)


@pytest.mark.parametrize("pages", [ELSEWHERE[:3], ELSEWHERE[3:6], ELSEWHERE[6:9], ELSEWHERE[9:]])
@pytest.mark.parametrize("outcome", ["done", "refused"])
def test_rows_with_a_page_elsewhere_are_done_again_and_not_linked(outcome, pages, folder, planted):
    run(folder)
    for place in (folder, planted):
        (place / "own.html").write_text(KEPT)
    for file, page in zip(sorted((planted / "rows").iterdir()), pages, strict=True):
        file.write_text(json.dumps(json.loads(file.read_text()) | {"page": page, "outcome": outcome}))
    assert run(folder).kept == 0
    linked = re.findall(r'<a href="([^#][^"]*)"', (planted / "report.html").read_text(encoding="utf-8"))
    assert linked == [f"results/sheet_{i}/fit.html" for i in (1, 2, 3)]


def test_a_page_that_is_a_link_is_no_page(folder, planted, own):
    run(folder)
    (planted / "results/sheet_1/fit.html").unlink()
    (planted / "results/sheet_1/fit.html").symlink_to(own / "own.txt")
    assert run(folder).kept == 2
    assert not (planted / "results/sheet_1/fit.html").is_symlink()
