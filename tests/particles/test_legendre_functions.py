import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import gammaln, lpmv

from jaxink.numerics.legendre import associated_legendre, legendre_series, moments_of_function


def test_series_is_the_sum_of_polynomials():
    moments = np.array([1.0, 0.7, -0.2, 0.1])
    cosines = np.linspace(-1, 1, 9)
    expected = np.polynomial.legendre.legval(cosines, (2 * np.arange(4) + 1) * moments)
    np.testing.assert_allclose(legendre_series(jnp.asarray(moments), cosines), expected, atol=1e-14)


def test_series_slope_at_the_end_points():
    # P_l'(1) = l (l + 1) / 2 and P_l'(-1) = (-1)^(l + 1) times it.
    moments = jnp.array([0.0, 0.0, 1 / 5, 1 / 7])
    slope = jax.vmap(jax.grad(lambda c: legendre_series(moments, c)))(jnp.array([-1.0, 1.0]))
    np.testing.assert_allclose(slope, [-3 + 6, 3 + 6], rtol=1e-13)


def test_moments_invert_the_series():
    moments = 0.8 ** np.arange(12)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    values = legendre_series(jnp.asarray(moments), nodes)
    np.testing.assert_allclose(moments_of_function(values, nodes, weights, 12), moments, atol=1e-13)


def test_associated_functions_are_those_of_scipy_without_the_alternating_sign():
    n_moments, n_orders = 20, 18
    cosines = np.array([-1.0, -0.4, 0.0, 0.3, 0.95, 1.0])
    result = np.asarray(associated_legendre(n_moments, n_orders, cosines))
    assert result.shape == (n_orders, n_moments, cosines.size)
    for m in range(n_orders):
        assert np.all(result[m, :m] == 0)
        for l in range(m, n_moments):
            norm = np.exp((gammaln(l - m + 1) - gammaln(l + m + 1)) / 2)
            expected = (-1) ** m * norm * lpmv(m, l, cosines)
            np.testing.assert_allclose(result[m, l], expected, atol=1e-12, err_msg=f"l={l} m={m}")


@pytest.mark.parametrize(("mu", "mu_prime"), [(0.3, 0.7), (-0.999, 0.999), (0.0, 0.05), (1.0, 0.4)])
def test_addition_theorem_up_to_degree_300(mu, mu_prime):
    n = 301
    azimuth = 1.234
    cosine = mu * mu_prime + np.sqrt((1 - mu**2) * (1 - mu_prime**2)) * np.cos(azimuth)
    tables = associated_legendre(n, n, jnp.array([mu, mu_prime]))
    orders = np.arange(n)
    factors = np.where(orders == 0, 1.0, 2.0) * np.cos(orders * azimuth)
    total = jnp.einsum("m,ml,ml->l", factors, tables[:, :, 0], tables[:, :, 1])
    expected = np.polynomial.legendre.legvander(np.array([cosine]), n - 1)[0]
    np.testing.assert_allclose(total, expected, atol=1e-12)


def test_derivative_of_associated_functions():
    def table(cosine):
        return associated_legendre(12, 12, cosine)

    for cosine in (0.0, 0.37, -0.8):
        step = 1e-6
        numeric = (table(cosine + step) - table(cosine - step)) / (2 * step)
        forward = jax.jacfwd(table)(cosine)
        np.testing.assert_allclose(forward, numeric, atol=1e-6)
        np.testing.assert_allclose(jax.jacrev(table)(cosine), forward, atol=1e-12)


def test_derivative_at_normal_incidence():
    slope = jax.jacfwd(lambda c: associated_legendre(6, 6, c))(1.0)
    assert np.all(np.isfinite(slope))
    degree = np.arange(6)
    np.testing.assert_allclose(slope[0], degree * (degree + 1) / 2, rtol=1e-13)
    # Lambda_2^2 = sqrt(3/8) (1 - mu^2).
    np.testing.assert_allclose(slope[2, 2], -2 * np.sqrt(3 / 8), rtol=1e-13)


def test_any_shape_of_points():
    cosines = np.linspace(0.1, 0.9, 6).reshape(2, 3)
    flat = associated_legendre(5, 4, cosines.ravel())
    np.testing.assert_array_equal(associated_legendre(5, 4, cosines), flat.reshape(4, 5, 2, 3))
