"""Second derivatives of the BSDF in every nesting of forward and reverse mode, by kind of layer and face."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.validation.accuracy.second_derivatives import KINDS, MODES, errors
from jaxink.particles.phase_function import HenyeyGreenstein
from jaxink.solver.layer_response import layer_response

# Each shows what the others do not: equal eigenvalues (ink on ink), an eigenvalue of 0, powers of 0,
# a finite field; the page has all kinds, and what is not right yet.
SHOWN = ["ink on ink of lower index", "thick, without absorption", "isotropic"]
SLOW = ["finite beam and field of view", "Mie, dense"]


@pytest.mark.parametrize("kind", [*SHOWN, *(pytest.param(kind, marks=pytest.mark.slow) for kind in SLOW)])
def test_second_derivatives_equal_differences_of_the_first(kind):
    found = errors(KINDS[kind])
    assert list(found) == list(MODES)
    assert max(found.values()) < 1e-6


def layer(x):
    """A layer with two equal eigenvalues that x[0] moves apart, and an eigenvalue of 0 for x[1] = 0."""
    b = jnp.diag(jnp.array([1.0, 1.0, 0.0])) + x[0] * jnp.array([[0, 1, 0], [1, 0.5, 0], [0, 0, 0.0]])
    b = b + x[1] ** 2 * jnp.ones((3, 3))
    return layer_response(jnp.diag(jnp.array([1.0, 1.0, 2.0]))[None], b[None], 0.7 + x[2])


def test_third_derivatives_at_equal_and_vanishing_eigenvalues():
    weights = jnp.asarray(np.random.default_rng(2).normal(size=(2, 1, 3, 3)))

    def value(x):
        return jnp.sum(weights * jnp.stack(layer(x)))

    second = jax.jit(jax.jacfwd(jax.grad(value)))
    third = jax.jit(jax.jacrev(jax.jacfwd(jax.grad(value))))(jnp.zeros(3))
    h = 1e-3
    for k in range(3):
        step = h * jnp.eye(3)[k]
        around = [second(i * step) for i in (-2, -1, 1, 2)]
        difference = (around[0] - 8 * around[1] + 8 * around[2] - around[3]) / (12 * h)
        np.testing.assert_allclose(third[..., k], difference, atol=1e-6)


def test_a_batch_of_second_derivatives_is_each_of_them():
    def curvature(x):
        return jax.jvp(
            lambda y: jax.jvp(lambda z: layer(z)[0], (y,), (jnp.ones(3),))[1], (x,), (jnp.ones(3),)
        )[1]

    points = jnp.asarray(np.random.default_rng(3).uniform(0, 0.1, (4, 3)))
    each = jnp.stack([jax.jit(curvature)(point) for point in points])
    np.testing.assert_allclose(jax.jit(jax.vmap(curvature))(points), each, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("asymmetry", [0.0, 0.5, -0.3])
def test_second_derivatives_of_powers(asymmetry):
    second = jax.jacfwd(jax.jacrev(lambda g: HenyeyGreenstein(g).moments(6)))(asymmetry)
    expected = [l * (l - 1) * (asymmetry ** (l - 2) if l > 1 else 0.0) for l in range(6)]
    np.testing.assert_allclose(second, expected, rtol=1e-14)
