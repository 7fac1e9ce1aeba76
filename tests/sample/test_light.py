"""What falls on the sample, and what the detector sees."""

import pytest

from jaxink.sample import parse_sample, sample_from_dict, sample_to_dict

INK = """
schema_version = 1
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "rayleigh"
refractive_index = 1.5
thickness_um = 20
scattering_per_mm = 10
absorption_per_mm = 1
[instrument]
"""


def test_light_is_read_and_kept():
    text = (
        INK
        + 'detector_mode = "spectrometer"\nillumination = { wavelength_nm = [350, 700], power = [1, 2] }\n'
    )
    sample = parse_sample(text)
    assert sample.detector_mode == "spectrometer"
    assert sample.illumination == ((350.0, 700.0), (1.0, 2.0))
    assert sample_from_dict(sample_to_dict(sample)) == sample


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ('detector_mode = "eye"', "detector_mode"),
        ("illumination = 3", "wavelength_nm"),
        ("illumination = { wavelength_nm = [400], power = [1] }", "wavelength_nm"),
        ("illumination = { wavelength_nm = [400, 500], power = [1, -1] }", "power"),
        ("illumination = { wavelength_nm = [500, 400], power = [1, 1] }", "wavelength_nm"),
    ],
)
def test_bad_light_gets_a_sentence(line, named, refused):
    with refused(named):
        parse_sample(INK + line)
