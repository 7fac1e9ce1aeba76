"""Samples whose ink is tabulated, and the tables."""

import pytest

import jaxink
from jaxink.ink import TableOptions, read_ink_table
from tests.samples import UNMATCHED


@pytest.fixture(scope="package")
def unmatched():
    return jaxink.parse_sample(UNMATCHED)


@pytest.fixture(scope="package")
def unmatched_table(unmatched, tmp_path_factory):
    """As a user has it: written, and read again."""
    made = jaxink.ink_table(unmatched, options=TableOptions(n_theta=51, n_phi=25))
    path = made.to_netcdf(tmp_path_factory.mktemp("table") / "ink.nc")
    return read_ink_table(path)
