"""What falls on the sample, and what the detector sees."""

import pytest

from jaxink.errors import InputRefusedError
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
    ("line", "sentence"),
    [
        ('detector_mode = "eye"', "detector_mode = 'eye'; it must be one of: spectrometer, broadband"),
        ("illumination = 3", r"must be \{ wavelength_nm = \[...\], power = \[...\] \}"),
        ("illumination = { wavelength_nm = [400], power = [1] }", "equally many numbers"),
        ("illumination = { wavelength_nm = [400, 500], power = [1, -1] }", "none negative"),
        ("illumination = { wavelength_nm = [500, 400], power = [1, 1] }", "must ascend"),
    ],
)
def test_bad_light_gets_a_sentence(line, sentence):
    with pytest.raises(InputRefusedError, match=sentence):
        parse_sample(INK + line)
