"""Laws of scattering and absorption against the wavelength."""

import math

import numpy as np
import pytest

import jaxink
from jaxink.sample import parse_sample
from jaxink.sample.writing import sample_text
from tests.samples import edited

WAVES = (450.0, 550.0, 650.0)
SCATTERING = '{ law = "power", at_reference = 60, reference_nm = 550, exponent = 1.2 }'
ABSORPTION = '{ law = "exponential", at_reference = 3, reference_nm = 450, decay_nm = 80 }'
BY_LAW = f"""
schema_version = 1
wavelength_nm = [450, 550, 650]
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 50
scattering_per_mm = {SCATTERING}
absorption_per_mm = {ABSORPTION}
asymmetry_parameter = 0.5
"""


def test_a_law_is_the_same_as_its_values():
    scattering = [60 * (nm / 550) ** -1.2 for nm in WAVES]
    absorption = [3 * math.exp((450 - nm) / 80) for nm in WAVES]
    listed = edited(
        BY_LAW,
        (
            SCATTERING,
            f"{{ per_wavelength = true, value = {scattering} }}",
            ABSORPTION,
            f"{{ per_wavelength = true, value = {absorption} }}",
        ),
    )
    theta_i, theta_o, nm = (column.ravel() for column in np.meshgrid([0.0, 40.0], [10.0, 60.0], WAVES))
    by_law, by_value = (
        jaxink.predict_at(parse_sample(text), theta_i, theta_o, wavelength_nm=nm, accuracy=1e-2)
        for text in (BY_LAW, listed)
    )
    np.testing.assert_allclose(by_law.bsdf_per_sr, by_value.bsdf_per_sr, rtol=1e-9)


def test_a_law_is_written_and_read_back():
    sample = parse_sample(BY_LAW)
    assert "ink.scattering_per_mm" not in sample.parameters
    assert sample.parameters["ink.scattering_per_mm.at_reference"].unit == "1/mm"
    again = parse_sample(sample_text(sample))
    assert (again.parameters, again.dispersions) == (sample.parameters, sample.dispersions)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        (('law = "power"', 'law = "powers"'), "power"),
        (('law = "power"', 'dispersion = "cauchy"'), "law"),
        (("reference_nm = 550", "reference_nm = { free = true, min = 400, max = 700 }"), "reference_nm"),
        ((", exponent = 1.2", ""), "exponent"),
        (("exponent = 1.2", "exponent = 1.2, decay_nm = 50"), "decay_nm"),
        (("at_reference = 60", "at_reference = -60"), "at_reference"),
        (("at_reference = 60", "at_reference = { per_wavelength = true, value = [1, 2, 3] }"), "per_"),
        (("exponent = 1.2", "exponent = { free = true, min = 0, max = 10 }", "= 60,", "= 1e6,"), "450"),
        (("asymmetry_parameter = 0.5", 'asymmetry_parameter = { law = "power" }'), "asymmetry_parameter"),
        (("thickness_um = 50", 'thickness_um = { law = "power" }'), "thickness_um"),
        (
            ("asymmetry_parameter = 0.5", 'asymmetry_parameter = { tie = "ink.scattering_per_mm / 200" }'),
            "exponent",
        ),
    ],
)
def test_a_bad_law_is_refused(changes, named, refused_sample):
    refused_sample(edited(BY_LAW, changes), named)
