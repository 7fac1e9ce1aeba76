"""Numbers as people write them are read as what they mean, or refused."""

import pytest

from jaxink.cli.answers import quantity, word
from jaxink.sample.draft import DRAFTED_PHASE_FUNCTIONS, ORDERS


@pytest.mark.parametrize(
    ("name", "text", "value"),
    [
        ("ink_um", "90", 90),
        ("ink_um", "90 um", 90),
        ("ink_um", "0.09 mm", 90),
        ("ink_um", "0,09mm", 90),
        ("ink_um", " 90 µm ", 90),
        ("ink_um", "90 μm", 90),
        ("ink_um", "90000 nm", 90),
        ("ink_um", "12 microns", 12),
        ("plate_mm", "3", 3),
        ("plate_mm", "0.3 cm", 3),
        ("plate_mm", "1,5", 1.5),
        ("plate_mm", "1500 um", 1.5),
        ("plate_mm", "0,500", 0.5),
        ("plate_index", "1,49", 1.49),
        ("plate_index", "1.", 1),
        ("radius_nm", "0.15 um", 150),
        ("radius_nm", "1.5e2", 150),
    ],
)
def test_numbers(name, text, value):
    assert quantity(name, text) == value


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("ink_um", "1,500"),
        ("ink_um", "90 kg"),
        ("ink_um", "thick"),
        ("ink_um", ""),
        ("ink_um", "1.2.3"),
        ("ink_um", "1,2,3"),
        ("plate_index", "1.5 mm"),
        ("plate_mm", "3 deg"),
        ("plate_mm", "1_0"),
    ],
)
def test_what_is_none(name, text, refused):
    with refused(name, numbers=False):
        quantity(name, text)


@pytest.mark.parametrize(
    ("text", "words", "meant"),
    [
        ("plate, ink", ORDERS, "plate,ink"),
        (" Plate,Ink ", ORDERS, "plate,ink"),
        ("ink", ORDERS, "ink"),
        ("2", ORDERS, "ink,plate"),
        ("hg", DRAFTED_PHASE_FUNCTIONS, "henyey_greenstein"),
        ("Henyey-Greenstein", DRAFTED_PHASE_FUNCTIONS, "henyey_greenstein"),
        ("MIE", DRAFTED_PHASE_FUNCTIONS, "mie"),
        ("two term", DRAFTED_PHASE_FUNCTIONS, "two_term_henyey_greenstein"),
    ],
)
def test_words_are_meant_whatever_their_spelling(text, words, meant):
    assert word("order", text, words) == meant


@pytest.mark.parametrize("text", ["", "4", "0", "p i", "paint"])
def test_words_that_are_none_or_could_be_two_are_refused(text, refused):
    with refused("order", "plate,ink | ink,plate | ink"):
        word("order", text, ORDERS)
