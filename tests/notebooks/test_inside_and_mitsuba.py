"""The ink from inside: a table that gives back the measurement, in Mitsuba's files."""

import pytest


@pytest.mark.slow
def test_inside_and_mitsuba(run):
    names = run("inside_and_mitsuba")
    assert names["check"].largest_difference < 0.01
    assert "jaxink_table.py" in {path.name for path in names["paths"]}
