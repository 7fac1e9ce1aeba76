"""Dispersion formulas against published indices of acrylic glass, and their derivatives."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.sample.dispersion import cauchy_index, sellmeier_index, tabulated_index

# PMMA at 450, 550 and 650 nm, rounded from a published fit; and a one-term Sellmeier fit of PMMA:
# Sultanova, Kasarova, Nikolov 2009 Acta Phys. Pol. A 116, 585.
WAVELENGTHS = (450.0, 550.0, 650.0)
PMMA = (1.4998, 1.4924, 1.4883)
CAUCHY = {"a": 1.47766, "b_um2": 0.004479}
SULTANOVA = ((1.1819,), (0.011313,))


def test_cauchy_of_acrylic_glass():
    for wavelength, index in zip(WAVELENGTHS, PMMA, strict=True):
        assert cauchy_index(wavelength, **CAUCHY) == pytest.approx(index, abs=1e-4)
    # The third term meets all three.
    exact = [cauchy_index(w, 1.47847, 0.00399996, 0.0000646529) for w in WAVELENGTHS]
    assert exact == pytest.approx(PMMA, abs=1e-5)


def test_sellmeier_of_acrylic_glass_is_that_of_another_sample():
    assert [sellmeier_index(w, *SULTANOVA) for w in WAVELENGTHS] == pytest.approx(PMMA, abs=1e-3)


def test_sellmeier_of_fused_silica():
    # Malitson 1965 J. Opt. Soc. Am. 55, 1205: at the helium d line 1.45846.
    strengths = (0.6961663, 0.4079426, 0.8974794)
    resonances = (0.0684043**2, 0.1162414**2, 9.896161**2)
    assert sellmeier_index(587.6, strengths, resonances) == pytest.approx(1.45846, abs=1e-5)


def test_critical_angle_moves_by_the_dispersion():
    blue, red = (math.degrees(math.asin(1 / cauchy_index(w, **CAUCHY))) for w in (450.0, 650.0))
    assert red - blue == pytest.approx(0.40, abs=0.01)
    slope = -1 / (1.494 * math.sqrt(1.494**2 - 1))
    assert math.radians(red - blue) == pytest.approx(-slope * 0.0115, rel=0.02)


def test_table_meets_its_rows_and_cauchys_formula_between_them():
    ends = [cauchy_index(w, **CAUCHY) for w in (450.0, 650.0)]
    assert tabulated_index(450.0, (450.0, 650.0), ends) == ends[0]
    assert tabulated_index(650.0, (450.0, 650.0), ends) == ends[1]
    between = tabulated_index(520.0, (450.0, 650.0), ends)
    assert between == pytest.approx(cauchy_index(520.0, **CAUCHY), abs=1e-14)
    # What even steps in wavelength would give lies 7e-4 off.
    assert abs(between - np.interp(520.0, (450.0, 650.0), ends)) > 5e-4


def test_outside_a_table_there_is_no_index(refused):
    with refused(450, 650, 440):
        tabulated_index(440.0, (450.0, 650.0), (1.5, 1.49))


@pytest.mark.parametrize(
    ("formula", "start"),
    [
        (lambda c: cauchy_index(500.0, *c), (1.48, 0.004, 1e-4)),
        (lambda c: sellmeier_index(500.0, c[:2], c[2:]), (1.1819, 0.01, 0.011313, 90.0)),
    ],
)
def test_derivatives_in_the_coefficients(formula, start):
    start = jnp.array(start)
    forward = np.asarray(jax.jacfwd(formula)(start))
    assert np.asarray(jax.jacrev(formula)(start)) == pytest.approx(forward, rel=1e-12)
    for k in range(len(start)):
        step = 1e-6 * float(start[k]) * np.eye(len(start))[k]
        difference = (formula(start + step) - formula(start - step)) / (2 * step[k])
        assert forward[k] == pytest.approx(float(difference), rel=1e-5, abs=1e-8)
