"""Effects in plain sentences with all of their numbers."""

import re

import pytest

from jaxink.effects import CATALOGUE, in_numbers
from jaxink.effects.constants import PlateThickness
from jaxink.effects.geometry import LateralLoss, ThinPatches
from jaxink.effects.instrument import Nonlinearity
from jaxink.effects.volume import SecondLobe
from jaxink.numerics.digits import plus_minus
from jaxink.sample import Parameter


def told(effect, values, errors, **options):
    terms = dict(zip([term.name for term in effect.terms], zip(values, errors, strict=True), strict=True))
    return in_numbers(
        effect, {n: v for n, (v, _) in terms.items()}, {n: e for n, (_, e) in terms.items()}, **options
    )


@pytest.mark.parametrize(
    ("effect", "values", "errors", "sentence"),
    [
        (
            ThinPatches("ink"),
            (0.151, 0.2),
            (0.013, 0.01),
            "15.1 +- 1.3 % of the area has ink of 0.200 +- 0.010 times the thickness",
        ),
        (
            SecondLobe("ink"),
            (0.25, -0.4),
            (None, 0.02),
            "25 % of the scattering is in a second lobe, with an asymmetry parameter of -0.400 +- 0.020",
        ),
        (
            LateralLoss(1.0),
            (12.0, 2.5),
            (0.5, None),
            "light leaves the sample outside the field of the detector, which is 12.00 +- 0.50 mm wide, with "
            "a beam of 2.5 mm",
        ),
        # Without words of its own: the statement, then the numbers by their names.
        (
            Nonlinearity(),
            (0.03,),
            (0.002,),
            "the detector is not linear, or something else grows with the signal: relative 0.0300 +- 0.0020",
        ),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_every_number_is_in_the_sentence(effect, values, errors, sentence):
    assert told(effect, values, errors) == sentence


def test_a_declared_constant_is_told_by_how_much_it_differs():
    effect = PlateThickness(Parameter("plate.thickness_mm", 2.0, True, 0.1, 10.0, "mm"))
    sentence = told(effect, (0.12,), (0.01,), difference=True)
    assert sentence == f"{PlateThickness.statement}, by 0.120 +- 0.010 mm"


@pytest.mark.parametrize("effect", [e for e in CATALOGUE if e.numbered], ids=lambda effect: effect.name)
def test_words_name_quantities_that_the_effect_has(effect):
    keys = set(re.findall(r"\{(\w+)%?\}", effect.numbered))
    terms = effect.terms if isinstance(effect.terms, tuple) else ()
    assert keys
    assert not terms or keys == {term.name.rsplit(".", 1)[-1] for term in terms}


def test_without_values_there_is_the_statement():
    assert in_numbers(Nonlinearity(), {}, {}) == Nonlinearity.statement


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (1.2345, 0.0123, "1.234 +- 0.012"),
        (120.4, 3.21, "120.4 +- 3.2"),
        (12345.0, 678.0, "12345 +- 678"),
        (3e-6, 2e-7, "3e-06 +- 2e-07"),
        (0.123456, None, "0.1235"),
        (0.123456, 0.0, "0.1235"),
    ],
)
def test_values_have_the_decimals_of_their_errors(value, error, text):
    assert plus_minus(value, error) == text
