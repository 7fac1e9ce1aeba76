"""Inverses whose derivatives are products: against NumPy, and against finite differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError

from jaxink.numerics.linear_algebra import inverse, positive_definite_inverse, resolvent, transpose

N = 5


def matrices(seed, batch=(3,)):
    return np.random.default_rng(seed).standard_normal((*batch, N, N))


def positive_definite(seed):
    root = matrices(seed)
    return jnp.asarray(root @ np.swapaxes(root, -1, -2) + np.eye(N))


def symmetric(seed, norm=0.95):
    """Symmetric matrices of that norm."""
    full = matrices(seed)
    full = full + np.swapaxes(full, -1, -2)
    return jnp.asarray(norm * full / np.linalg.norm(full, 2, axis=(-2, -1), keepdims=True))


def contraction(seed, norm=0.95):
    full = matrices(seed)
    return jnp.asarray(norm * full / np.linalg.norm(full, 2, axis=(-2, -1), keepdims=True))


DIAGONAL = jnp.array([0.0, 0.3, 1.0, 0.8, 1e-9])


def test_transpose_turns_the_last_two_axes_only():
    array = np.arange(24.0).reshape(2, 3, 4)
    np.testing.assert_array_equal(transpose(jnp.asarray(array)), np.moveaxis(array, 1, 2))


def test_positive_definite_inverse_is_the_inverse_of_each_matrix():
    given = positive_definite(1)
    np.testing.assert_allclose(positive_definite_inverse(given), np.linalg.inv(given), rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("norm", [0.0, 0.5, 0.99])
def test_inverse_of_one_minus_a_contraction(norm):
    given = np.eye(N) - contraction(2, norm)
    np.testing.assert_allclose(inverse(given), np.linalg.inv(given), rtol=1e-10, atol=1e-12)


def test_inverse_needs_no_pivot_where_a_reflection_turns_all_light_round():
    # 1 - M with M a rotation by nearly a right angle: skew, and yet of positive definite symmetric part.
    turn = 0.999 * np.array([[0.0, 1.0], [-1.0, 0.0]])
    given = jnp.asarray(np.eye(2) - turn)
    np.testing.assert_allclose(inverse(given), np.linalg.inv(given), rtol=1e-12)


@pytest.mark.parametrize("norm", [0.3, 0.999])
def test_resolvent_sums_all_reflections_to_and_fro(norm):
    given = symmetric(3, norm)
    product = np.asarray(DIAGONAL)[:, None] * np.asarray(given)
    found = np.asarray(resolvent(DIAGONAL, given))
    np.testing.assert_allclose(found, np.linalg.inv(np.eye(N) - product), rtol=1e-9, atol=1e-12)
    # The series 1 + rR + (rR)^2 + ... itself, squared away.
    total, power = np.eye(N) + product, product @ product
    for _ in range(14):
        total, power = total + total @ power, power @ power
    np.testing.assert_allclose(found, total, rtol=1e-6, atol=1e-9)
    # Turned round: (1 - R r)^-1 is its transpose.
    np.testing.assert_allclose(
        np.swapaxes(found, -1, -2), np.linalg.inv(np.eye(N) - given * DIAGONAL), rtol=1e-9, atol=1e-12
    )


GIVEN = {
    "general": (inverse, (jnp.eye(N) - contraction(5, 0.6),)),
    "positive definite": (positive_definite_inverse, (positive_definite(4),)),
    "resolvent": (resolvent, (jnp.array([0.2, 0.9, 0.5, 0.7, 0.1]), symmetric(6, 0.8))),
}


@pytest.mark.parametrize(("function", "at"), GIVEN.values(), ids=GIVEN)
def test_derivatives_are_those_of_finite_differences(function, at):
    random = np.random.default_rng(10)
    # Symmetric matrices stay symmetric.
    change = [jnp.asarray(random.standard_normal(a.shape)) for a in at]
    if function is not inverse:
        change = [a + transpose(a) if a.ndim > 1 else a for a in change]
    step = 1e-5
    ahead, behind = (
        function(*(a + way * d for a, d in zip(at, change, strict=True))) for way in (step, -step)
    )
    expected = (ahead - behind) / (2 * step)
    _, forward = jax.jvp(function, at, tuple(change))
    np.testing.assert_allclose(forward, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())
    weight = jnp.asarray(random.standard_normal(expected.shape))
    slopes = jax.grad(lambda a: jnp.vdot(weight, function(*a)))(at)
    reverse = sum(jnp.vdot(slope, d) for slope, d in zip(slopes, change, strict=True))
    np.testing.assert_allclose(reverse, jnp.vdot(weight, forward), rtol=1e-11)


def test_no_reflection_is_an_ordinary_point_of_the_resolvent():
    # The root of r has no slope at 0; (1 - r R)^-1 has: R, as d(1 - rR)^-1 = dr R there.
    given, nothing = symmetric(7), jnp.zeros(N)
    change = jnp.asarray(np.random.default_rng(8).uniform(size=N))
    found, slope = jax.jvp(lambda r: resolvent(r, given), (nothing,), (change,))
    np.testing.assert_array_equal(found, np.broadcast_to(np.eye(N), given.shape))
    np.testing.assert_allclose(slope, change[:, None] * given, rtol=1e-14)


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        (positive_definite_inverse, (positive_definite(9),)),
        (inverse, (jnp.eye(N) - contraction(9),)),
        (resolvent, (DIAGONAL, symmetric(9))),
    ],
    ids=["positive definite", "general", "resolvent"],
)
def test_derivatives_add_no_factorisation(function, arguments):
    def factorisations(of, *given):
        return str(jax.make_jaxpr(of)(*given)).count("cholesky")

    alone = factorisations(function, *arguments)
    assert alone == (function is not inverse)
    assert factorisations(lambda *x: jax.jvp(function, x, x), *arguments) == alone
    assert factorisations(jax.grad(lambda *x: function(*x).sum()), *arguments) == alone


@pytest.mark.parametrize(
    ("function", "arguments"),
    [
        (positive_definite_inverse, (jnp.ones((3, 2)),)),
        (inverse, (jnp.ones(4),)),
        (inverse, (jnp.ones((2, 3, 4)),)),
        (resolvent, (jnp.ones(3), jnp.ones((4, 4)))),
        (resolvent, (jnp.ones((2, 4)), jnp.ones((2, 4, 4)))),
        (transpose, (jnp.ones(3),)),
    ],
)
def test_wrong_shapes_are_refused(function, arguments):
    with pytest.raises(TypeCheckError):
        function(*arguments)
