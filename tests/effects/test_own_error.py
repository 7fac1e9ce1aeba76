"""Errors that models are known to have."""

import pytest

from jaxink.effects import own_error
from jaxink.sample import parse_sample
from tests.samples import PRINTED_INK

FIELD = "[instrument]\nbeam_diameter_mm = 2\ndetector_diameter_mm = 5\n"
FACETS = 'back_roughness = { density = "ggx", sigma_deg = 5.0 }\n'


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (PRINTED_INK, 0.0),
        (PRINTED_INK.replace("[noise]", FIELD + "[noise]"), 2.5e-3),
        (PRINTED_INK.replace("[noise]", FACETS + "[noise]"), 1e-3),
    ],
)
def test_facets_and_a_limited_field_have_one(text, error):
    assert own_error(parse_sample(text)) == error
