import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.numerics.quadrature import (
    barycentric_matrix,
    gauss_legendre_unit,
    logarithmic_matrix,
)

TARGETS = np.array([0.0, 1e-3, 0.02, 0.3, 0.77, 0.999, 1.0])


@pytest.mark.parametrize("n_nodes", [1, 6, 32])
def test_nodes_integrate_polynomials(n_nodes):
    nodes, weights = gauss_legendre_unit(n_nodes)
    for power in range(2 * n_nodes):
        np.testing.assert_allclose(weights @ nodes**power, 1 / (power + 1), rtol=1e-13)


@pytest.mark.parametrize("scale", [1.0, 0.7, 1e-3])
def test_barycentric_interpolation_is_exact_for_polynomials(scale):
    nodes = jnp.asarray(scale * gauss_legendre_unit(7)[0])
    rows = np.asarray(barycentric_matrix(nodes, jnp.asarray(scale * TARGETS)))
    np.testing.assert_allclose(rows.sum(axis=1), 1.0, rtol=1e-13)
    for power in range(7):
        np.testing.assert_allclose(rows @ (nodes / scale) ** power, TARGETS**power, atol=1e-13)


def test_barycentric_interpolation_at_the_nodes_themselves():
    nodes = jnp.asarray(gauss_legendre_unit(9)[0])
    np.testing.assert_array_equal(barycentric_matrix(nodes, nodes), np.eye(9))


# Radiance towards grazing is of such a form; beyond the outermost node, at 0, rounding is magnified.
@pytest.mark.parametrize(("first", "rounding"), [(1, 1e-10), (0, 1e-8)])
@pytest.mark.parametrize("n_nodes", [8, 16, 32, 64])
def test_logarithmic_interpolation(n_nodes, first, rounding):
    nodes, targets = gauss_legendre_unit(n_nodes)[0], TARGETS[first:]
    rows = np.asarray(logarithmic_matrix(n_nodes, jnp.asarray(targets)))
    np.testing.assert_allclose(rows.sum(axis=1), 1.0, atol=rounding)
    for power in (0, 1, 5):
        np.testing.assert_allclose(rows @ nodes**power, targets**power, atol=rounding)
    safe = np.where(targets > 0, targets, 1.0)
    for power in (1, 2):
        expected = targets**power * np.log(safe)
        np.testing.assert_allclose(rows @ (nodes**power * np.log(nodes)), expected, atol=rounding)
