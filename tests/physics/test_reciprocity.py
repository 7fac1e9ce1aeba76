"""Source and detector may change places: f(i, o) / n_o^2 = f(o, i) / n_i^2, also through the stack."""

import numpy as np
import pytest

from tests.physics.probe import Light, film, ink, matched, printed, two_inks

ROUNDING = 1e-11
ASYMMETRIC = (
    ink(optical_thickness=0.7, asymmetry=0.6),
    ink(optical_thickness=3.0, albedo=0.99, asymmetry=-0.2),
)


@pytest.mark.parametrize(
    "stack",
    [matched(), film(ink(1.7)), printed(ink(), 1.6), printed(ink(), 1.4, behind=True), two_inks(*ASYMMETRIC)],
    ids=["matched", "film", "plate first", "plate behind", "two inks"],
)
def test_reflection(stack):
    there, back_again = Light(stack).reflected_pairs
    np.testing.assert_allclose(there, back_again, rtol=ROUNDING)


@pytest.mark.parametrize(
    ("stack", "turned"),
    [
        (film(ink(), 1.33, 1.0), film(ink(), 1.0, 1.33)),
        (printed(ink(), 1.6), printed(ink(), 1.6, behind=True)),
        (printed(ink(), 1.6, 0.3), printed(ink(), 1.6, 0.3, behind=True)),
        (two_inks(*ASYMMETRIC), two_inks(*ASYMMETRIC[::-1])),
    ],
    ids=["surroundings", "plate", "absorbing plate", "two inks"],
)
def test_transmission_of_the_turned_stack(stack, turned):
    # Basic radiance L / n^2 per irradiance is reciprocal; the back of one is the front of the other.
    here, there = Light(stack).transmitted_pairs, Light(turned).transmitted_pairs[::-1]
    np.testing.assert_allclose(here / stack.index_back**2, there / stack.index_front**2, rtol=ROUNDING)


def test_order_of_layers_matters_in_reflection_only():
    one, other = Light(two_inks(*ASYMMETRIC)), Light(two_inks(*ASYMMETRIC[::-1]))
    assert np.min(np.abs(one.reflected_pairs / other.reflected_pairs - 1)) > 0.01
