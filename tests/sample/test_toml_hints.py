"""What is said of a text that is not TOML, or not the file that is asked for."""

import pytest

from jaxink.errors import InputRefusedError
from jaxink.projects import parse_project
from jaxink.sample import parse_sample
from tests.samples import PRINTED_INK, edited


@pytest.mark.parametrize("number", ["3,0", "-0,5", "+12,75  # mm"])
def test_a_decimal_comma_is_recognised(number, told):
    text = edited(PRINTED_INK, ("thickness_mm = 1.0", f"thickness_mm = {number}"))
    with pytest.raises(InputRefusedError, match="decimal point") as problem:
        parse_sample(text)
    told(str(problem.value))


@pytest.mark.parametrize("text", ["theta_i_deg,theta_o_deg\n0,10\n", "0;10;0.3\n0;20;0.3\n", "0\t10\t0.3\n"])
def test_a_measurement_is_no_sample_file(text, told):
    with pytest.raises(InputRefusedError, match="looks like a measurement") as problem:
        parse_sample(text)
    told(str(problem.value))


@pytest.mark.parametrize("text", ["a = 1\nb c\n", "a = [1,\n", "a = 1, 2\n"])
def test_other_mistakes_have_no_hint(text):
    with pytest.raises(InputRefusedError) as problem:
        parse_sample(text)
    assert str(problem.value).endswith(").")


def test_a_sample_file_is_no_project(told):
    with pytest.raises(InputRefusedError, match="--sample") as problem:
        parse_project(PRINTED_INK)
    told(str(problem.value))
