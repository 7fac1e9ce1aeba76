import pytest

from tests.render import inks


@pytest.fixture(scope="session")
def ink_file(tmp_path_factory):
    return inks.written(tmp_path_factory.mktemp("render"))


@pytest.fixture(scope="session")
def ink(ink_file):
    return inks.ink(ink_file.parent)
