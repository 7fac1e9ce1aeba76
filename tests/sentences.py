"""What a user is told, word by word, in one place: tests/sentences.json, by the test that comes upon it.

Tests state the type of an exception and what it names (keys, rows, parameters, options); the words around
that are compared with the file. `python -m pytest --write-sentences` runs the tests that are told something
and writes the file anew: its difference is then what a change of words changes. `-m told` only runs them.
"""

import json
import re
import traceback
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent
STORE = TESTS / "sentences.json"
# With its sign, exponent and standard error in brackets.
NUMBER = re.compile(r"(?<![\w.])[-+]?\d[\d.]*(?:e[-+]?\d+)?(?:\(\d+\))?")


def _stored() -> dict[str, list[str]]:
    stored = json.loads(STORE.read_text(encoding="utf-8")) if STORE.exists() else {}
    return {name: [said] if isinstance(said, str) else said for name, said in stored.items()}


def pytest_addoption(parser):
    parser.addoption(
        "--write-sentences",
        action="store_true",
        help="run the tests that are told something, and write tests/sentences.json anew",
    )


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config, items):
    for item in items:
        if "told" in getattr(item, "fixturenames", ()):
            item.add_marker("told")
    if config.getoption("--write-sentences"):
        config.hook.pytest_deselected(items=[item for item in items if not item.get_closest_marker("told")])
        items[:] = [item for item in items if item.get_closest_marker("told")]


@pytest.fixture(scope="session")
def _sentences():
    return _stored()


@pytest.fixture
def told(request, tmp_path_factory, _sentences):
    """``told(text, "ink.thickness_um")``: it names all of these, and has the words that stand in the file.

    Folders do not count, nor do ``numbers`` and white space if so wished.
    """
    from tests.conftest import SHARED

    writes = request.config.getoption("--write-sentences")
    node = request.node.nodeid.removeprefix("tests/")
    expected, said = _sentences.get(node, []), []
    folders = re.compile(rf"{re.escape(str(tmp_path_factory.getbasetemp()))}/[\w-]+")
    places = {str(files("jaxink")): "JAXINK", str(SHARED): "DATA"}

    def check(text: str, *named: object, numbers: bool = True) -> str:
        missing = [str(key) for key in named if str(key) not in text]
        assert not missing, f"{missing} not named in: {text}"
        words = folders.sub("FOLDER", text).strip()
        for place, name in places.items():
            words = words.replace(place, name)
        # What quotes more than anyone would read is shortened, the more the longer its folder is.
        words = re.sub(r"(.)\1{19,}", r"\1\1\1", words if len(text) < 1000 or not numbers else words[:100])
        words = words if numbers else " ".join(NUMBER.sub("#", words).split())
        if said and words == said[-1]:
            return text
        said.append(words)
        if not writes:
            before = expected[len(said) - 1] if len(said) <= len(expected) else None
            assert said[-1] == before, "other words than in tests/sentences.json; see --write-sentences"
        return text

    failed = request.session.testsfailed
    yield check
    if writes:
        request.node.user_properties.append(("told", (node, said)))
    elif request.session.testsfailed == failed:
        assert said == expected


def _without_others(problem: BaseException) -> str:
    """Its text without what other libraries say within it, which changes with their version."""
    text, package = str(problem), str(files("jaxink"))
    while (problem := problem.__context__) is not None:
        frames, said = traceback.extract_tb(problem.__traceback__), str(problem)
        if len(said) > 8 and not (frames and frames[-1].filename.startswith(package)):
            text = text.replace(said, "...")
    return text


@pytest.fixture
def refused(told):
    """``with refused("ink.thickness_um"):`` what is refused there, by a sentence that names all of these."""

    @contextmanager
    def refused(*named: object, kind: type[Exception] | None = None, numbers: bool = True):
        from jaxink.errors import InputRefusedError

        with pytest.raises(kind or InputRefusedError) as caught:
            yield caught
        missing = [str(key) for key in named if str(key) not in str(caught.value)]
        assert not missing, f"{missing} not named in: {caught.value}"
        told(_without_others(caught.value), numbers=numbers)

    return refused


class _Writer:
    """Collects what was told in all processes, and writes it at the end."""

    def __init__(self):
        self.told, self.not_run = {}, set()

    def pytest_runtest_logreport(self, report):
        if report.failed or report.skipped:
            self.not_run.add(report.nodeid.removeprefix("tests/"))
        elif report.when == "teardown":
            self.told |= dict(value for key, value in report.user_properties if key == "told")

    def pytest_sessionfinish(self):
        # What is no longer told in a file of tests that has run is forgotten; other files keep theirs.
        ran = {name.split("::")[0] for name in self.told}
        kept = {
            name: said
            for name, said in _stored().items()
            if name in self.not_run
            or (name.split("::")[0] not in ran and (TESTS / name.split("::")[0]).exists())
        }
        told = {name: said for name, said in self.told.items() if said and name not in self.not_run}
        lines = {name: said if len(said) > 1 else said[0] for name, said in sorted((kept | told).items())}
        text = json.dumps(lines, indent=1, ensure_ascii=False)
        STORE.write_text(text + "\n", encoding="utf-8")


def pytest_configure(config):
    # Workers of xdist report to the process that started them, which writes.
    if config.getoption("--write-sentences") and not hasattr(config, "workerinput"):
        config.pluginmanager.register(_Writer())
