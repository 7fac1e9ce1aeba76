"""Finished pieces of a diagnosis in a folder, so that it goes on where it was stopped.

A piece is the result of one fit, prediction or linearisation, named by a hash of everything that it depends
on. A diagnosis that is begun again finds them in the order in which it asks for them, and compiles nothing
until it comes to new work.
"""

import dataclasses
import io
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import jax
import jaxlib
import numpy as np

from jaxink.fitting import Objective, Outcome, Point, Search, SearchPath, program_of
from jaxink.numerics.fingerprint import fingerprint, source_fingerprint
from jaxink.numerics.named_files import read_named, write_named

Piece = TypeVar("Piece")
_SUFFIX = ".piece"
_WORDS = "words"


class Form(NamedTuple):
    """How a piece is written: as arrays, and made from them again."""

    arrays_of: Callable[[Any], dict[str, np.ndarray]]
    made_of: Callable[[Mapping[str, np.ndarray]], Any]


class Checkpoint:
    """Reads and writes the pieces of one diagnosis; may be used by several threads.

    Parameters
    ----------
    folder
        Created with the first piece; None to keep nothing.
    """

    def __init__(self, folder: Path | None = None):
        self.folder = folder

    def once(self, kind: str, about: tuple, form: Form, make: Callable[[], Piece]) -> Piece:
        """A piece from its file, or made now and written.

        Parameters
        ----------
        kind
            What is made.
        about
            An objective, and everything else that it depends on.
        form
            Of the piece.
        make
            Makes it.
        """
        name = None if self.folder is None else _name(kind, *about)
        if name is None:
            return make()
        found = self._read(name, form)
        if found is None:
            found = make()
            self._write(name, form.arrays_of(found))
        return found

    def _read(self, name: str, form: Form) -> Any:
        assert self.folder is not None
        content = read_named(self.folder / f"{name}{_SUFFIX}", name)
        if content is None:
            return None
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                return form.made_of({key: file[key] for key in file.files})
        except Exception:  # noqa: BLE001 - whatever is wrong with the file, making the piece anew is right
            return None

    def _write(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Write a piece whole; without space, a diagnosis goes on and only cannot be resumed."""
        assert self.folder is not None
        content = io.BytesIO()
        np.savez(content, **arrays)  # type: ignore[arg-type]
        with suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            write_named(self.folder / f"{name}{_SUFFIX}", name, content.getvalue())


def code_version() -> str:
    """What pieces depend on besides the input."""
    return str(fingerprint(source_fingerprint(), jax.__version__, jaxlib.__version__, np.__version__))


def _name(kind: str, objective: Objective, *about: Any) -> str | None:
    """Name of a piece; None if something that it depends on has no fingerprint, such as a user's effect."""
    structure, arrays = program_of(objective)
    if structure.key is None:
        return None
    leaves = [np.asarray(leaf) for leaf in jax.tree.leaves(arrays)]
    return fingerprint(kind, code_version(), structure.key, leaves, *about)


ARRAY = Form(lambda array: {"array": np.asarray(array)}, lambda arrays: arrays["array"])
POINT = Form(lambda point: point._asdict(), lambda arrays: Point(**arrays))
_SEARCH_ARRAYS = "start", "unit", "triangle", "gradient", "predicted"
_PATH_ARRAYS = tuple(field.name for field in dataclasses.fields(SearchPath))


def _search_arrays(search: Search) -> dict[str, np.ndarray]:
    arrays = {name: getattr(search, name) for name in _SEARCH_ARRAYS}
    path = {f"path_{name}": getattr(search.path, name) for name in _PATH_ARRAYS}
    plain = {
        field.name: getattr(search, field.name)
        for field in dataclasses.fields(search)
        if field.name not in (*_SEARCH_ARRAYS, "path", "outcome")
    }
    words = json.dumps(plain | {"outcome": search.outcome.name})
    return {**arrays, **path, _WORDS: np.array(words)}


def _search_of(arrays: Mapping[str, np.ndarray]) -> Search:
    plain: dict[str, Any] = json.loads(str(arrays[_WORDS]))
    path = SearchPath(**{name: arrays[f"path_{name}"] for name in _PATH_ARRAYS})
    outcome = Outcome[plain.pop("outcome")]
    plain |= {name: arrays[name] for name in _SEARCH_ARRAYS}
    return Search(**plain, outcome=outcome, path=path)


SEARCH = Form(_search_arrays, _search_of)
