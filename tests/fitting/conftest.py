"""What several tests of fits read."""

import pytest

import jaxink
from jaxink.data import simulated_example


@pytest.fixture(scope="session")
def inputs():
    """The embedded measurement and its sample."""
    data, sample = simulated_example()
    return jaxink.read(data), jaxink.load_sample(sample)
