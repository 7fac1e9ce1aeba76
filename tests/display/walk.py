"""All objects of the library within an object, and whether they show themselves briefly."""

import dataclasses
from collections.abc import Iterator, Mapping

MOST_LINES, MOST_CHARACTERS = 9, 1200


def objects_in(root: object) -> Iterator[object]:
    """The object, and every dataclass or table of the library that it holds."""
    if dataclasses.is_dataclass(root) and not isinstance(root, type):
        yield root
        for field in dataclasses.fields(root):
            yield from objects_in(getattr(root, field.name, None))
    elif isinstance(root, Mapping):
        if type(root).__module__.startswith("jaxink"):
            yield root
        for value in root.values():
            yield from objects_in(value)
    elif isinstance(root, tuple | list):
        for value in root:
            yield from objects_in(value)


def too_long(root: object) -> dict[str, int]:
    """Kinds of objects within one whose ``repr`` is too long, with its length."""
    found = {}
    for one in objects_in(root):
        text = repr(one)
        public = not type(one).__name__.startswith("_")
        if public and (len(text.splitlines()) > MOST_LINES or len(text) > MOST_CHARACTERS):
            found[type(one).__name__] = len(text)
    return found
