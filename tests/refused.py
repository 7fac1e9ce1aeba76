"""Sample files made from a good one, and the sentence with which they are refused."""

import pytest

from jaxink.errors import InputRefusedError
from jaxink.sample import load_sample


def edited(good: str, changes: tuple[str, ...]) -> str:
    """A text with every second change in the place of the one before it, which it has once."""
    for old, new in zip(changes[::2], changes[1::2], strict=True):
        assert good.count(old) == 1, old
        good = good.replace(old, new)
    return good


def sentence_of(text: str, folder) -> str:
    """What the user of a file is told, after its name."""
    path = folder / "sample.toml"
    path.write_text(text)
    with pytest.raises(InputRefusedError) as caught:
        load_sample(path)
    name, sentence = str(caught.value).split(": ", 1)
    assert name == str(path)
    return sentence
