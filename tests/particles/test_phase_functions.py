import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.numerics.legendre import moments_of_function
from jaxink.particles.phase_function import (
    PHASE_FUNCTIONS,
    HenyeyGreenstein,
    Rayleigh,
    TabulatedByAngle,
    TabulatedByMoments,
    TwoTermHenyeyGreenstein,
)

DEGREES = np.linspace(0, 180, 181)
COSINES = np.cos(np.deg2rad(DEGREES))
NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)


def henyey_greenstein_table(asymmetry_parameter, cosines=COSINES):
    return np.asarray(HenyeyGreenstein(asymmetry_parameter).value(cosines))


ALL = {
    "isotropic": HenyeyGreenstein(0.0),
    "forward": HenyeyGreenstein(0.9),
    "backward": HenyeyGreenstein(-0.6),
    "two-term": TwoTermHenyeyGreenstein(0.8, -0.3, 0.25),
    "rayleigh": Rayleigh(),
    "by angle": TabulatedByAngle(COSINES, henyey_greenstein_table(0.7)),
    "by moments": TabulatedByMoments(0.5 ** np.arange(40)),
}


def test_every_phase_function_of_a_sample_file_is_checked():
    assert {type(phase) for phase in ALL.values()} >= set(PHASE_FUNCTIONS.values())


@pytest.mark.parametrize("phase", ALL.values(), ids=ALL.keys())
def test_mean_is_one_and_moments_are_those_of_the_value(phase):
    moments = phase.moments(12)
    assert moments.shape == (12,)
    assert float(moments[0]) == pytest.approx(1, abs=1e-14)
    expected = moments_of_function(phase.value(NODES), NODES, WEIGHTS, 12)
    # The spline has steps in its third derivative, which Gauss-Legendre nodes meet at random.
    np.testing.assert_allclose(moments, expected, atol=1e-5 if phase is ALL["by angle"] else 1e-12)


@pytest.mark.parametrize("n_moments", [1, 2, 3, 70])
@pytest.mark.parametrize("phase", ALL.values(), ids=ALL.keys())
def test_any_number_of_moments(phase, n_moments):
    np.testing.assert_allclose(phase.moments(n_moments)[:2], phase.moments(12)[:n_moments][:2], atol=1e-12)
    assert phase.moments(n_moments).shape == (n_moments,)


@pytest.mark.parametrize("g", [-0.7, 0.0, 0.5])
def test_henyey_greenstein_formula_and_mirror(g):
    expected = (1 - g**2) / (1 + g**2 - 2 * g * COSINES) ** 1.5
    np.testing.assert_allclose(henyey_greenstein_table(g), expected, rtol=1e-13)
    np.testing.assert_allclose(henyey_greenstein_table(-g), henyey_greenstein_table(g)[::-1], rtol=1e-12)


def test_narrow_peak_keeps_its_digits():
    g = 1 - 1e-9
    assert float(HenyeyGreenstein(g).value(1.0)) == pytest.approx((1 + g) / (1 - g) ** 2, rel=1e-6)
    assert float(HenyeyGreenstein(-g).value(-1.0)) == pytest.approx((1 + g) / (1 - g) ** 2, rel=1e-6)


@pytest.mark.parametrize("g", [-0.6, 0.0, 0.4])
def test_derivative_of_henyey_greenstein_moments(g):
    degree = np.arange(6)
    expected = degree * np.power(g, np.maximum(degree - 1, 0))
    forward = jax.jacfwd(lambda v: HenyeyGreenstein(v).moments(6))(g)
    np.testing.assert_allclose(forward, expected, atol=1e-15)
    np.testing.assert_allclose(jax.jacrev(lambda v: HenyeyGreenstein(v).moments(6))(g), expected, atol=1e-15)


def test_derivative_of_henyey_greenstein_at_zero_asymmetry():
    # 1 + 3 g cos to first order.
    slope = jax.jacfwd(lambda g: HenyeyGreenstein(g).value(COSINES))(0.0)
    np.testing.assert_allclose(slope, 3 * COSINES, atol=1e-14)


def test_two_term_is_the_weighted_sum():
    mixed = TwoTermHenyeyGreenstein(0.8, -0.3, 0.25)
    first, second = HenyeyGreenstein(0.8), HenyeyGreenstein(-0.3)
    np.testing.assert_allclose(
        mixed.value(COSINES), 0.75 * first.value(COSINES) + 0.25 * second.value(COSINES), rtol=1e-13
    )
    assert float(mixed.moments(2)[1]) == pytest.approx(0.75 * 0.8 - 0.25 * 0.3)


def test_rayleigh_moments():
    np.testing.assert_array_equal(Rayleigh().moments(5), [1, 0, 0.1, 0, 0])
    assert float(Rayleigh().value(1.0)) == 1.5


@pytest.mark.parametrize(("g", "tolerance"), [(0.5, 1e-7), (-0.5, 1e-7), (0.9, 1e-4)])
def test_table_of_henyey_greenstein_reproduces_it(g, tolerance):
    table = TabulatedByAngle(COSINES, henyey_greenstein_table(g))
    between = np.cos(np.deg2rad(np.linspace(0, 180, 977)))
    np.testing.assert_allclose(table.value(between), henyey_greenstein_table(g, between), rtol=tolerance)
    np.testing.assert_allclose(table.moments(32), g ** np.arange(32), atol=tolerance)


def test_order_of_the_table_does_not_matter():
    values = henyey_greenstein_table(0.6)
    falling, rising = TabulatedByAngle(COSINES, values), TabulatedByAngle(COSINES[::-1], values[::-1])
    np.testing.assert_array_equal(falling.value(NODES), rising.value(NODES))


def test_small_error_of_normalisation_is_removed():
    table = TabulatedByAngle(COSINES, 1.005 * henyey_greenstein_table(0.6))
    np.testing.assert_allclose(table.value(NODES), henyey_greenstein_table(0.6, NODES), rtol=1e-6)


def test_traced_table_values():
    slope = jax.jacfwd(lambda values: TabulatedByAngle(COSINES, values).moments(2))(jnp.ones(181))
    # A table of ones scaled stays 1; one value raised shifts only the first moment.
    np.testing.assert_allclose(slope @ np.ones(181), [0, 0], atol=1e-12)
    assert float(slope[1, 40]) > 0 > float(slope[1, 140])


def test_slope_of_the_table_between_and_at_its_ends():
    table = TabulatedByAngle(COSINES, henyey_greenstein_table(0.4))
    points = jnp.array([-1.0, 0.2, 1.0])
    slope = jax.vmap(jax.grad(table.value))(points)
    expected = jax.vmap(jax.grad(HenyeyGreenstein(0.4).value))(points)
    np.testing.assert_allclose(slope, expected, rtol=1e-4)


def test_moments_beyond_the_table_are_zero():
    np.testing.assert_array_equal(TabulatedByMoments([1.0, 0.2, 0.1]).moments(5), [1, 0.2, 0.1, 0, 0])


def test_traced_parameters_pass_through_jit_and_vmap():
    moments = jax.jit(jax.vmap(lambda g: HenyeyGreenstein(g).moments(3)))(jnp.array([0.1, -0.5]))
    np.testing.assert_allclose(moments, [[1, 0.1, 0.01], [1, -0.5, 0.25]])
    value = jax.jit(lambda w: TwoTermHenyeyGreenstein(0.5, 0.0, w).value(0.0))(1.0)
    assert float(value) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: HenyeyGreenstein(1.0), "asymmetry_parameter"),
        (lambda: HenyeyGreenstein(np.nan), "asymmetry_parameter"),
        (lambda: TwoTermHenyeyGreenstein(0.5, -1.2, 0.1), "second_asymmetry_parameter"),
        (lambda: TwoTermHenyeyGreenstein(0.5, 0.2, 1.5), "second_weight"),
        (lambda: TabulatedByAngle(COSINES, np.full(181, 1.02)), "1.02"),
        (lambda: TabulatedByAngle(COSINES, np.full(180, 1.0)), "181"),
        (lambda: TabulatedByAngle(COSINES, -np.ones(181)), "1"),
        (lambda: TabulatedByAngle([1.0, 0.0, -1.0], np.ones(3)), "4"),
        (lambda: TabulatedByAngle([1.0, 0.1, 0.5, -1.0], np.ones(4)), ""),
        (
            lambda: TabulatedByAngle(COSINES[:171], np.ones(171)),
            "0",
        ),
        (
            lambda: TabulatedByAngle(COSINES[::15], henyey_greenstein_table(0.8)[::15]),
            "",
        ),
        (lambda: TabulatedByMoments([0.9, 0.1]), "0"),
        (lambda: TabulatedByMoments([1.0, 1.5, 1.25]), "2"),
        (lambda: TabulatedByMoments(0.9 ** np.arange(16)), ""),
    ],
)
def test_wrong_values_are_refused_with_a_sentence(make, named, refused):
    with refused(named):
        make()
