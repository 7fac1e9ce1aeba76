"""Samples whose ink is tabulated, and the tables."""

import pytest

import jaxink
from jaxink.ink import TableOptions, read_ink_table

# A plate that is not matched to the binder and absorbs; an ink without absorption.
UNMATCHED = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.49
thickness_mm = 1.0
absorption_per_mm = 0.05
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.53
thickness_um = 40
scattering_per_mm = 80
absorption_per_mm = 0
asymmetry_parameter = 0.5
"""


@pytest.fixture(scope="package")
def unmatched():
    return jaxink.parse_sample(UNMATCHED)


@pytest.fixture(scope="package")
def unmatched_table(unmatched, tmp_path_factory):
    """As a user has it: written, and read again."""
    made = jaxink.ink_table(unmatched, options=TableOptions(n_theta=51, n_phi=25))
    path = made.to_netcdf(tmp_path_factory.mktemp("table") / "ink.nc")
    return read_ink_table(path)
