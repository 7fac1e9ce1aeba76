"""Sample files as their user has them."""

import pytest

from jaxink.sample import load_sample


@pytest.fixture
def refused_sample(refused, tmp_path):
    """Refuses a sample file of that text by a sentence with its name and all of these; gives the sentence."""
    path = tmp_path / "sample.toml"

    def refuse(text: str, *named: object) -> str:
        path.write_text(text)
        with refused(f"{path}: ", *named) as caught:
            load_sample(path)
        return str(caught.value)

    return refuse
