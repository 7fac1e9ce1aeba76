"""Effects in plain sentences with all of their numbers."""

import re

import pytest

from jaxink.effects import CATALOGUE, in_numbers
from jaxink.effects.constants import DeclaredConstant, PlateThickness
from jaxink.effects.fluorescence import Fluorescence
from jaxink.effects.geometry import LateralLoss, ThinPatches
from jaxink.effects.instrument import Blur, Nonlinearity
from jaxink.effects.numerics import NUMERICS
from jaxink.effects.surfaces import RoughInk
from jaxink.effects.volume import SecondLobe
from jaxink.numerics.digits import plus_minus
from jaxink.sample import Parameter


class Plain(Nonlinearity):
    statement, numbered = "the instrument is odd", ""


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
        (
            Nonlinearity(),
            (-0.03,),
            (0.002,),
            "the detector is not linear, or something else grows with the signal: the reading of the largest "
            "one is off by -3.00 +- 0.20 %",
        ),
        (
            Blur(False),
            (0.36,),
            (0.02,),
            "the angular resolution is finite, with a variance of 0.360 +- 0.020 deg^2",
        ),
        (
            Blur(True),
            (0.05, 0.36, 4.0),
            (0.01, 0.02, 0.5),
            "the angular resolution is finite, with a variance of 0.360 +- 0.020 deg^2, and 5.0 +- 1.0 % of "
            "the light is in wings with a half-width of 4.00 +- 0.50 deg",
        ),
        (
            RoughInk("ink", "front_roughness", "ggx"),
            (3.0,),
            (0.2,),
            "the outer face of the ink is rough: its slopes have a GGX density with an angle of "
            "3.00 +- 0.20 deg",
        ),
        (
            Fluorescence("ink", (400.0, 500.0, 600.0, 700.0), ((400.0,), (1.0,)), 1),
            (0.2, 0.55, 0.4),
            (0.01, 0.05, None),
            "the ink fluoresces with a quantum yield of 20.0 +- 1.0 %; the shares of the photons that no "
            "shorter wavelength has are 55.0 +- 5.0 % at 500 nm, 40 % at 600 nm",
        ),
        (
            Fluorescence("ink", (400.0,), None, 1),
            (0.2,),
            (0.01,),
            "the ink fluoresces with a quantum yield of 20.0 +- 1.0 %",
        ),
        # Without words of its own: the statement, then the numbers by their names.
        (Plain(), (0.03,), (0.002,), "the instrument is odd: relative 0.0300 +- 0.0020"),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_every_number_is_in_the_sentence(effect, values, errors, sentence):
    assert told(effect, values, errors) == sentence


def test_a_declared_constant_is_told_by_how_much_it_differs():
    effect = PlateThickness(Parameter("plate.thickness_mm", 2.0, True, 0.1, 10.0, "mm"))
    sentence = told(effect, (0.12,), (0.01,), difference=True)
    assert sentence == f"{PlateThickness.statement}, by 0.120 +- 0.010 mm"


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda effect: effect.name)
def test_every_effect_with_numbers_has_words_for_them(effect):
    is_by_value = issubclass(effect, DeclaredConstant) or effect in NUMERICS
    assert bool(effect.numbered) is not is_by_value


WORDED = [e for e in CATALOGUE if isinstance(e.numbered, str) and e.numbered]


@pytest.mark.parametrize("effect", WORDED, ids=lambda effect: effect.name)
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
