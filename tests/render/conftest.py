import pytest

from jaxink.render import PrintedPlate
from jaxink.sample import load_sample
from tests.render import inks


@pytest.fixture(scope="session")
def ink_file(tmp_path_factory):
    return inks.written(tmp_path_factory.mktemp("render"))


@pytest.fixture(scope="session")
def ink(ink_file):
    return inks.ink(ink_file.parent)


@pytest.fixture(scope="session")
def plate(ink_file):
    return PrintedPlate.of(load_sample(ink_file))
