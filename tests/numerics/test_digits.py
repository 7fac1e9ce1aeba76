import math

import pytest

from jaxink.numerics.digits import interval, percent, plain, relative_error, rounded, with_uncertainty


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (1.2341, 0.0049, "1.234(5)"),
        (1.2341, 0.0012, "1.2341(12)"),
        (1.2341, 0.0019, "1.2341(19)"),
        (1.2341, 0.0021, "1.234(2)"),
        (98.222, 2.006, "98(2)"),
        (95.04, 1.2, "95.0(12)"),
        (1234.4, 12.3, "1234(12)"),
        (12345.0, 250.0, "12300(200)"),
        (-0.6136, 0.00799, "-0.614(8)"),
        (0.0, 0.3, "0.0(3)"),
        (0.05, 3.0, "0(3)"),
        (1.23456e-5, 3e-7, "1.23(3)e-05"),
        (3.7e7, 1.2e5, "3.700(12)e+07"),
        (9.9999e6, 3e4, "1.000(3)e+07"),
        (1.2341, 0.0096, "1.234(10)"),
        (1.2341, None, "1.2341"),
        (1.2341, 0.0, "1.2341"),
        (1.2341, math.inf, "1.2341"),
        (123456.789, None, "123457"),
    ],
)
def test_digits_follow_the_error(value, error, text):
    assert with_uncertainty(value, error) == text


def test_relative_error_of_the_value():
    assert relative_error(200.0, 3.0) == "1.5 %"
    assert relative_error(-200.0, 3.0) == "1.5 %"
    assert relative_error(0.0, 3.0) == relative_error(1.0, None) == relative_error(1.0, math.inf) == ""


def test_interval_keeps_two_digits_of_its_width():
    assert interval(0.605468, 0.621618) == "0.605 ... 0.622"
    assert interval(96.2257, 100.284) == "96.2 ... 100.3"
    assert interval(0.0, 1000.0) == "0 ... 1000"
    assert interval(1e-6, 3e-6) == f"{plain(1e-6)} ... {plain(3e-6)}"


@pytest.mark.parametrize("none", [None, math.nan])
def test_no_number_is_said_as_the_caller_wants(none):
    assert (percent(none), percent(none, missing="-"), rounded(none), rounded(none, missing="-")) == (
        "",
        "-",
        "",
        "-",
    )


def test_shares_in_per_cent():
    assert percent(0.01234) == "1.23 %"
    assert percent(0.01234, "+.2f") == "+1.23 %"
    assert rounded(1234.5) == "1.23e+03"
    assert rounded(0.012345, 4) == "0.01235"
