"""Derivatives by few inputs, and through them by many variables."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.errors import NoDerivativeError
from jaxink.numerics.own_derivatives import by_own_inputs, differentiable_once, point_by_point


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


@pytest.mark.parametrize("derivative", [jax.jacfwd, jax.jacrev])
def test_derivatives_by_several_parts_add_up(derivative):
    def of_parts(inputs):
        return by_own_inputs(lambda x, rest, fixed: expensive((x, rest)) | {"c": fixed}, *inputs, jnp.ones(2))

    def plain(inputs):
        return expensive(inputs) | {"c": jnp.ones(2)}

    def both(function):
        return lambda v: function((v[0] * v[1], (v[1] + v[2], "name")))

    found, expected = (derivative(both(f))(jnp.asarray(AT)) for f in (of_parts, plain))
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


def test_a_function_of_points_has_the_same_derivatives_and_is_repeated_for_its_columns_only():
    shapes = []

    def function(a, b):
        shapes.append(a)
        return jnp.stack([jnp.sin(a) * b, a**2, b + 0 * a], axis=1)

    a, b = jnp.linspace(0.1, 2.0, 5), jnp.linspace(1.0, 3.0, 5)
    weights = jnp.arange(30.0).reshape(5, 6)

    def of_variables(x, made):
        return made(a + weights @ x, b)

    x = jnp.full(6, 0.01)
    expected = jax.jacfwd(lambda x: of_variables(x, function))(x)
    shapes.clear()
    found = jax.jacfwd(lambda x: of_variables(x, lambda *columns: point_by_point(function, *columns)))(x)
    assert not any(6 in np.shape(one) for one in shapes)
    np.testing.assert_allclose(found, expected, rtol=1e-13)
    # A column that does not vary has no derivative.
    np.testing.assert_allclose(found[:, 2], 0.0, atol=0)


@pytest.mark.parametrize("which", range(3))
def test_a_value_that_does_not_depend_on_what_varies_in_a_batch(which):
    """In compiled code, JAX gave its value the shape of its change."""

    def of(own):
        def function(x, y):
            return {"both": x * y, "one": y**2, "neither": jnp.asarray(2.0)}

        def value(variables):
            def at(factor):
                factors = [factor if part == which else 1.0 for part in range(3)]
                x, y, z = variables * jnp.stack([jnp.asarray(f) for f in factors])
                found = by_own_inputs(function, x, y) if own else function(x, y)
                return jax.vmap(lambda k: (k * found["both"] + z) / found["neither"] + found["one"])(
                    jnp.arange(2.0)
                )

            return jax.vmap(at)(jnp.arange(1.0, 4.0))

        return jax.jit(value)

    found, expected = (jax.jit(jax.jacfwd(of(own)))(jnp.asarray(AT)) for own in (True, False))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def guarded(x):
    """A product whose first factor may be differentiated once."""
    (once,) = differentiable_once((x[0],), "no second derivatives by the first")
    return once**2 * x[1] ** 2


@pytest.mark.parametrize("derivative", [jax.jacfwd, jax.jacrev, lambda f: jax.jit(jax.vmap(jax.grad(f)))])
def test_what_is_differentiable_once_has_first_derivatives(derivative):
    at = jnp.array([3.0, 2.0])
    found = (
        derivative(guarded)(at)
        if derivative in (jax.jacfwd, jax.jacrev)
        else derivative(guarded)(at[None])[0]
    )
    np.testing.assert_array_equal(found, [24.0, 36.0])


@pytest.mark.parametrize("outer", [jax.jacfwd, jax.jacrev])
@pytest.mark.parametrize("inner", [jax.jacfwd, jax.jacrev])
def test_second_derivatives_of_it_are_refused_and_others_are_not(outer, inner):
    with pytest.raises(NoDerivativeError, match="no second derivatives by the first"):
        outer(inner(guarded))(jnp.array([3.0, 2.0]))
    np.testing.assert_array_equal(outer(inner(lambda y: guarded((3.0, y))))(2.0), 18.0)


def test_a_derivative_by_it_may_be_differentiated_by_another_number():
    def by_first(y):
        return jax.grad(lambda x: guarded((x, y)))(3.0)

    assert jax.grad(by_first)(2.0) == 24.0
