"""Samples whose ink is tabulated, and the tables."""

import importlib.util
from pathlib import Path

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


@pytest.fixture(scope="package")
def photons():
    """The Monte Carlo of the benchmarks."""
    path = Path(__file__).resolve().parents[2] / "benchmarks" / "sheet_photons.py"
    spec = importlib.util.spec_from_file_location("sheet_photons", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
