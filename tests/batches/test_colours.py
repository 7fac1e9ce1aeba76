"""Colours of the rows of a batch."""

import dataclasses

import pytest

from jaxink.batches.result import colour_columns
from jaxink.batches.row import Inputs, Row, RowColour, row_from_dict

ROW = Row("a", ("a.csv",), Inputs("1", "2", "3"), "done", "fits")
# Pair 1 of Sharma, Wu, Dalal 2005 Color Res. Appl. 30, 21.
FIRST = RowColour("45:0", "D65", 50.0, 2.6772, -79.7751)


def test_differences_are_to_the_first_colour():
    other = RowColour("45:0", "D65", 50.0, 0.0, -82.7485)
    elsewhere = dataclasses.replace(FIRST, direction="30:0")
    colours = (None, FIRST, other, elsewhere)
    found = colour_columns([dataclasses.replace(ROW, colour=one) for one in colours])
    assert found["lab_L"] == [None, 50.0, 50.0, 50.0]
    none, own, far, incomparable = found["ciede2000_to_first"]
    assert (none, incomparable) == (None, None)
    assert own == pytest.approx(0, abs=1e-9)
    assert far == pytest.approx(2.0425, abs=1e-4)


def test_rows_without_colours_have_no_columns():
    assert colour_columns([ROW]) == {}


def test_a_colour_is_kept_with_its_row():
    row = dataclasses.replace(ROW, colour=FIRST)
    assert row_from_dict(row.to_dict()) == row
