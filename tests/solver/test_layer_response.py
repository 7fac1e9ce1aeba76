"""Response of a single layer on its own: functions of the eigenvalues, derivatives, known operators."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.solver.layer_response import (
    _divided_differences,
    _even,
    _odd,
    doubled_response,
    layer_method,
    layer_response,
)

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
COSINE, WEIGHT = (NODES + 1) / 2, WEIGHTS / 2
response = jax.jit(layer_response)
doubled = jax.jit(doubled_response)


def isotropic(albedo):
    """A and B of an isotropically scattering layer, one azimuthal order, scaled by sqrt(w mu)."""
    scale = np.sqrt(WEIGHT / COSINE)
    phase = albedo * np.outer(scale, scale)
    return jnp.asarray(np.diag(1 / COSINE))[None], jnp.asarray(np.diag(1 / COSINE) - phase)[None]


def test_what_a_thick_absorbing_layer_transmits_keeps_its_digits():
    # Far below rounding of the reflection; half of it twice, as the product of two layers.
    a_matrix, b_matrix = isotropic(0.3)
    reflection, transmission = response(a_matrix, b_matrix, 10.0)
    inner = np.eye(6) - reflection @ reflection
    twice = transmission @ np.linalg.solve(inner, transmission)
    _, found = response(a_matrix, b_matrix, 20.0)
    assert np.max(np.abs(found)) < 1e-15
    np.testing.assert_allclose(found, twice, rtol=1e-8)


EXTENDED = np.longdouble


def quotient_by_long_double(x, y, half, function):
    """(f(x^2) - f(y^2)) / (x^2 - y^2) with the roots x, y, in 64-bit mantissas."""
    x, y, half = EXTENDED(x), EXTENDED(y), EXTENDED(half)
    if abs(x - y) * half < 1e-6:
        middle = (x + y) / 2
        x, y = middle + EXTENDED(1e-6) / half, middle - EXTENDED(1e-6) / half
    return (function(x, half) - function(y, half)) / ((x - y) * (x + y))


@pytest.mark.parametrize("half", [1e-3, 1.0, 40.0])
@pytest.mark.parametrize(
    "roots",
    # apart; equal; nearly equal; both sides of the switch to the series at root * half = 0.05; large
    [(0.4, 3.0), (1.7, 1.7), (1.7, 1.7 + 1e-9), (0.0499, 0.0501), (0.01, 0.02), (1e-3, 6.0), (20.0, 21.0)],
)
def test_divided_differences(roots, half):
    x, y = np.array(roots) / half
    even, odd = _divided_differences(jnp.array([x, y]), half)
    expected_even = quotient_by_long_double(x, y, half, lambda r, h: r * np.tanh(r * h))
    expected_odd = quotient_by_long_double(x, y, half, lambda r, h: r / np.tanh(r * h))
    np.testing.assert_allclose(even[0, 1], float(expected_even), rtol=1e-9)
    np.testing.assert_allclose(odd[0, 1], float(expected_odd), rtol=1e-9)
    np.testing.assert_array_equal(even, even.T)


def test_divided_differences_at_vanishing_eigenvalues():
    even, odd = _divided_differences(jnp.array([0.0, 0.0, 1e-12, 5.0]), 2.0)
    # d/ds sqrt(s) tanh(sqrt(s) h) = h at s = 0, and h / 3 for the odd function.
    np.testing.assert_allclose(even[:3, :3], 2.0, rtol=1e-12)
    np.testing.assert_allclose(odd[:3, :3], 2 / 3, rtol=1e-12)
    np.testing.assert_allclose(even[0, 3], np.tanh(10.0) / 5.0, rtol=1e-12)
    np.testing.assert_allclose(odd[0, 3], (5 / np.tanh(10.0) - 1 / 2) / 25, rtol=1e-12)


def test_scalar_functions_are_continuous_where_the_series_begins():
    half = 3.0
    for function in (_even, _odd):
        below, above = function(jnp.array([0.99999e-4, 1.00001e-4]) / half, half)
        np.testing.assert_allclose(below, above, rtol=1e-4 if function is _even else 1e-12)
    np.testing.assert_allclose(_odd(jnp.array(0.0), half), 1 / half, rtol=1e-15)


@pytest.mark.parametrize("thickness", [0.0, 1e-6, 0.1, 2.0, 100.0, 1e4])
@pytest.mark.parametrize("albedo", [0.0, 0.8, 1.0])
def test_adding_doubling_agrees_with_discrete_ordinates(albedo, thickness):
    optics = *isotropic(albedo), thickness / 2
    np.testing.assert_allclose(doubled(*optics), response(*optics), atol=1e-10, rtol=1e-8)


def test_doubling_agrees_with_the_star_product_of_thin_layers():
    # The textbook's way to the same operators: start with first order, double 24 times.
    a, b = (np.asarray(m[0]) for m in isotropic(0.8))
    thin = 2.0 / 2**24
    # u' = -A v, v' = -B u: to first order T = 1 - (A + B)/2 tau, R = (A - B)/2 tau.
    identity = np.eye(len(a))
    reflection, transmission = (a - b) / 2 * thin, identity - (a + b) / 2 * thin
    for _ in range(24):
        between = np.linalg.solve(identity - reflection @ reflection, transmission)
        reflection = reflection + transmission @ reflection @ between
        transmission = transmission @ between
    for method in (response, doubled):
        found = method(*isotropic(0.8), 1.0)
        np.testing.assert_allclose(found[0][0], reflection, atol=1e-6)
        np.testing.assert_allclose(found[1][0], transmission, atol=1e-6)


def test_a_layer_method_that_does_not_exist_is_refused(refused):
    with refused("layer_method"):
        layer_method("monte_carlo")


@pytest.mark.parametrize("thickness", [0.0, 1e-6, 1.0, 100.0, 1e4])
def test_layer_without_absorption_conserves_energy(thickness):
    field = np.sqrt(WEIGHT * COSINE)
    for method in (response, doubled):
        reflection, transmission = method(*isotropic(1.0), thickness / 2)
        total = (reflection + transmission)[0] @ field
        np.testing.assert_allclose(total, field, rtol=1e-13 * (10 + thickness))


def test_layer_that_does_not_scatter_attenuates():
    reflection, transmission = response(*isotropic(0.0), 0.35)
    np.testing.assert_allclose(reflection[0], 0.0, atol=1e-15)
    np.testing.assert_allclose(transmission[0], np.diag(np.exp(-0.7 / COSINE)), atol=1e-15)


@functools.partial(jax.jit, static_argnums=0)
def both_derivatives(method, a, b, half, d_a, d_b, d_half, weights):
    """Derivative of a weighted sum of the response along a direction, in both modes."""

    def weighted(a, b, half):
        reflection, transmission = method(a, b, half)
        return jnp.sum(weights[0] * reflection + weights[1] * transmission)

    _, forward = jax.jvp(weighted, (a, b, half), (d_a, d_b, d_half))
    slopes = jax.grad(weighted, (0, 1, 2))(a, b, half)
    reverse = sum(jnp.sum(s * d) for s, d in zip(slopes, (d_a, d_b, d_half), strict=True))
    return weighted(a, b, half), forward, reverse


def degenerate():
    """Three equal eigenvalues."""
    identity = jnp.eye(6)[None]
    return 2.0 * identity, jnp.diag(jnp.array([1.0, 1.0, 1.0, 2.0, 3.0, 4.0]))[None]


CASES = {
    "absorbing": (isotropic(0.9), 1.0),
    "conservative": (isotropic(1.0), 1.0),
    "conservative, thick": (isotropic(1.0), 5e3),
    "thin": (isotropic(0.9), 5e-7),
    "no thickness": (isotropic(0.9), 0.0),
    "no scattering": (isotropic(0.0), 0.5),
    "equal eigenvalues": (degenerate(), 0.7),
    "thick": (isotropic(0.9), 5e3),
}


@pytest.mark.parametrize("method", [layer_response, doubled_response])
@pytest.mark.parametrize("case", CASES)
def test_derivatives(case, method):
    (a, b), half = CASES[case]
    random = np.random.default_rng(3)

    def symmetric(scale):
        matrix = random.normal(size=(1, 6, 6))
        return jnp.asarray(scale * (matrix + matrix.swapaxes(1, 2)))

    weights = jnp.asarray(random.normal(size=(2, 1, 6, 6)))
    # B has to stay positive: from a conservative layer only into absorption.
    positive = symmetric(0.3)
    direction = symmetric(0.3), positive @ positive, 0.4 * max(half, 1e-6)
    value, forward, reverse = both_derivatives(method, a, b, half, *direction, weights)
    assert np.isfinite([value, forward, reverse]).all()
    np.testing.assert_allclose(reverse, forward, rtol=1e-10, atol=1e-14)

    def along(t):
        moved = (x + t * d for x, d in zip((a, b, half), direction, strict=True))
        return float(both_derivatives(method, *moved, *direction, weights)[0])

    # One-sided and of fourth order, since half the cases lie on an edge of what is physical.
    h = 1e-4 if half < 100 else 1e-8
    coefficients = np.array([-25, 48, -36, 16, -3]) / 12
    difference = sum(c * along(k * h) for k, c in enumerate(coefficients)) / h
    rtol, atol = (1e-5, 1e-9) if half < 100 else (1e-4, 1e-4)
    np.testing.assert_allclose(forward, difference, rtol=rtol, atol=atol)
