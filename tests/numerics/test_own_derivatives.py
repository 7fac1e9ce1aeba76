"""Derivatives by few inputs, and through them by many variables."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.numerics.own_derivatives import by_own_inputs


@pytest.fixture(autouse=True)
def _in_64_bits():
    with jax.enable_x64(True):
        yield


def expensive(inputs):
    x, (y, name) = inputs
    assert name == "name"
    return {"a": jnp.sin(x * jnp.arange(1.0, 6.0)) * y, "b": jnp.exp(y)}


def of_variables(function):
    def value(variables):
        return function((variables[0] * variables[1], (jnp.asarray(0.3), "name"))), variables[2]

    return value


AT = np.array([0.7, 1.2, 5.0])
OWN, PLAIN = of_variables(lambda inputs: by_own_inputs(expensive, inputs)), of_variables(expensive)


@pytest.mark.parametrize(
    "derivative", [jax.jacfwd, jax.jacrev, lambda f: jax.jacfwd(jax.jacfwd(f)), lambda f: f]
)
def test_derivatives_are_those_of_the_function(derivative):
    found, expected = (jax.jit(derivative(f))(jnp.asarray(AT)) for f in (OWN, PLAIN))
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14), found, expected)


def test_within_a_batch():
    batch = jnp.stack([jnp.asarray(AT), 2 * jnp.asarray(AT)])
    found, expected = (jax.vmap(jax.jacfwd(f))(batch) for f in (OWN, PLAIN))
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-14), found, expected)


def test_the_function_is_differentiated_by_the_inputs_that_vary_only():
    """Three variables act on one input: the tangent of the sine is computed once."""

    def sizes_of_products(function):
        jaxpr = jax.make_jaxpr(jax.jacfwd(function))(jnp.asarray(AT))
        return [v.aval.size for e in jaxpr.eqns if e.primitive.name == "mul" for v in e.outvars]

    assert max(sizes_of_products(PLAIN)) == 15
    assert max(sizes_of_products(OWN)) == 5
