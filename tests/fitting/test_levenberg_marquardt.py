"""The bounded Levenberg-Marquardt solver on problems with published minima, alone and many at once."""

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from scipy.optimize import least_squares

from jaxink.fitting import BoundedLevenbergMarquardt
from tests.fitting.nist import PROBLEMS

SOLVER = BoundedLevenbergMarquardt(rtol=1e-14)


def solved(residual, start, lower=-jnp.inf, upper=jnp.inf, most=400, solver=SOLVER):
    options = {"lower": jnp.asarray(lower), "upper": jnp.asarray(upper)}
    return optx.least_squares(
        residual, solver, jnp.asarray(start, float), options=options, max_steps=most, throw=False
    )


def sum_of_squares(residual, y):
    return float(jnp.sum(residual(y, None) ** 2))


# From their first starts, far away, searches without bounds end in other minima.
DIFFICULT = {"BoxBOD", "MGH10", "MGH17", "Eckerle4"}
CERTIFIED = [(name, number) for name in PROBLEMS for number in (0, 1) if number or name not in DIFFICULT]


@pytest.mark.parametrize(("name", "number"), CERTIFIED)
def test_certified_values_of_nist(name, number):
    problem = PROBLEMS[name]
    found = solved(problem.residual, problem.starts[number])
    assert found.result == optx.RESULTS.successful
    np.testing.assert_allclose(found.value, problem.parameters, rtol=1e-7)
    assert sum_of_squares(problem.residual, found.value) == pytest.approx(problem.sum_of_squares, rel=1e-9)


@pytest.mark.parametrize("name", sorted(DIFFICULT - {"MGH10"}))
def test_a_box_brings_difficult_starts_to_the_certified_values(name):
    problem = PROBLEMS[name]
    best = np.array(problem.parameters)
    lower, upper = best - 4 * np.abs(best), best + 4 * np.abs(best)
    found = solved(problem.residual, np.clip(problem.starts[0], lower, upper), lower, upper)
    np.testing.assert_allclose(found.value, best, rtol=1e-7)


def rosenbrock(x, _):
    return jnp.stack([10 * (x[1] - x[0] ** 2), 1 - x[0]])


def powell_singular(x, _):
    return jnp.stack(
        [
            x[0] + 10 * x[1],
            jnp.sqrt(5.0) * (x[2] - x[3]),
            (x[1] - 2 * x[2]) ** 2,
            jnp.sqrt(10.0) * (x[0] - x[3]) ** 2,
        ]
    )


def beale(x, _):
    i = jnp.arange(1, 4)
    return jnp.array([1.5, 2.25, 2.625]) - x[0] * (1 - x[1] ** i)


def helical_valley(x, _):
    angle = jnp.arctan2(x[1], x[0]) / (2 * jnp.pi)
    return jnp.stack([10 * (x[2] - 10 * angle), 10 * (jnp.hypot(x[0], x[1]) - 1), x[2]])


def bard(x, _):
    u = jnp.arange(1.0, 16)
    v, w = 16 - u, jnp.minimum(u, 16 - u)
    y = [0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39]
    return jnp.array(y) - (x[0] + u / (v * x[1] + w * x[2]))


def freudenstein_roth(x, _):
    return jnp.stack(
        [-13 + x[0] + ((5 - x[1]) * x[1] - 2) * x[1], -29 + x[0] + ((x[1] + 1) * x[1] - 14) * x[1]]
    )


def jennrich_sampson(x, _):
    i = jnp.arange(1.0, 11)
    return 2 + 2 * i - (jnp.exp(i * x[0]) + jnp.exp(i * x[1]))


def brown_dennis(x, _):
    t = jnp.arange(1.0, 21) / 5
    return (x[0] + t * x[1] - jnp.exp(t)) ** 2 + (x[2] + x[3] * jnp.sin(t) - jnp.cos(t)) ** 2


# Start, and the sum of squares that Moré, Garbow, Hillstrom 1981 ACM Trans. Math. Softw. 7, 17 print.
PUBLISHED = {
    "rosenbrock": (rosenbrock, [-1.2, 1.0], 0.0),
    "freudenstein_roth": (freudenstein_roth, [0.5, -2.0], 48.9842),
    "beale": (beale, [1.0, 1.0], 0.0),
    "jennrich_sampson": (jennrich_sampson, [0.3, 0.4], 124.362),
    "helical_valley": (helical_valley, [-1.0, 0.0, 0.0], 0.0),
    "bard": (bard, [1.0, 1.0, 1.0], 8.21487e-3),
    "powell_singular": (powell_singular, [3.0, -1.0, 0.0, 1.0], 0.0),
    "brown_dennis": (brown_dennis, [25.0, 5.0, -5.0, -1.0], 85822.2),
}
# Boxes that leave the minimum outside.
BOXES = {
    "rosenbrock": ([-2.0, -1.0], [0.5, 2.0]),
    "freudenstein_roth": ([0.0, -20.0], [10.0, -0.95]),
    "beale": ([0.6, 0.2], [2.0, 1.0]),
    "jennrich_sampson": ([0.26, 0.0], [0.5, 0.5]),
    "helical_valley": ([-100.0, -1.0, -1.0], [0.8, 1.0, 1.0]),
    "bard": ([0.1, 0.0, 0.0], [50.0, 1.5, 100.0]),
    "powell_singular": ([0.1, -20.0, -1.0, 0.2], [100.0, 20.0, 1.0, 50.0]),
    "brown_dennis": ([-10.0, 0.0, -100.0, -20.0], [100.0, 15.0, 0.0, 0.2]),
}


# Far from the minimum of Brown and Dennis, no model of first derivatives holds: it takes thousands of steps.
@pytest.mark.parametrize("name", sorted(PUBLISHED.keys() - {"brown_dennis"}))
def test_published_minima_of_more_garbow_and_hillstrom(name):
    residual, start, expected = PUBLISHED[name]
    found = solved(residual, start)
    assert found.result == optx.RESULTS.successful
    assert sum_of_squares(residual, found.value) == pytest.approx(expected, rel=1e-5, abs=1e-12)


@pytest.mark.parametrize("name", BOXES)
def test_minima_within_a_box_are_those_of_scipy(name):
    residual, start, _ = PUBLISHED[name]
    lower, upper = map(np.array, BOXES[name])
    start = np.clip(start, lower + 1e-3, upper - 1e-3)
    found = solved(residual, start, lower, upper)
    value = np.asarray(found.value)
    assert found.result == optx.RESULTS.successful
    assert np.all((value >= lower) & (value <= upper))
    assert np.any((value == lower) | (value == upper))
    slope = jax.jit(jax.jacfwd(lambda y: residual(y, None)))
    other = least_squares(
        lambda y: np.asarray(residual(jnp.asarray(y), None)),
        start,
        lambda y: np.asarray(slope(y)),
        bounds=(lower, upper),
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    assert sum_of_squares(residual, value) <= 2 * other.cost * (1 + 1e-7) + 1e-12


@pytest.mark.parametrize("name", ["rosenbrock", "bard", "jennrich_sampson"])
def test_many_searches_at_once_end_where_each_alone_does(name):
    residual, start, _ = PUBLISHED[name]
    lower, upper = (jnp.array(bound) for bound in BOXES[name])
    share = np.random.default_rng(3).uniform(size=(6, len(start)))
    starts = lower + share * (upper - lower)
    alone = [solved(residual, at, lower, upper) for at in starts]
    together = jax.vmap(lambda at: solved(residual, at, lower, upper))(starts)
    assert jnp.all(together.result == optx.RESULTS.successful)
    np.testing.assert_allclose(together.value, [one.value for one in alone], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["Misra1a", "Rat43", "Thurber"])
def test_many_searches_at_once_reach_certified_values(name):
    problem = PROBLEMS[name]
    starts = jnp.array(problem.starts, float)
    together = jax.vmap(lambda at: solved(problem.residual, at))(starts)
    alone = [solved(problem.residual, at).value for at in starts]
    np.testing.assert_allclose(together.value, alone, rtol=1e-12)
    np.testing.assert_allclose(together.value, [problem.parameters] * 2, rtol=1e-7)


def test_variables_in_a_tree_with_bounds_for_some():
    def residual(y, target):
        return {"a": y["scale"] * jnp.ones((2, 2)) - target, "b": y["offsets"] - 3.0}, y["scale"] + 1

    start = {"scale": 0.5, "offsets": jnp.zeros(2)}
    options = {"upper": {"scale": 1.5, "offsets": jnp.array([2.0, jnp.inf])}}
    found = optx.least_squares(
        residual, BoundedLevenbergMarquardt(), start, 2.0, options, has_aux=True, max_steps=20
    )
    assert found.value["scale"] == pytest.approx(1.5)
    np.testing.assert_allclose(found.value["offsets"], [2.0, 3.0], rtol=1e-6)
    assert found.aux == found.value["scale"] + 1
    assert found.stats["decrement"] <= 1e-6


def test_equal_bounds_hold_a_variable_and_a_number_bounds_all():
    found = solved(rosenbrock, [-1.0, 0.25], [-2.0, 0.25], [2.0, 0.25])
    assert found.value[1] == 0.25
    # 10 (x^2 - 1/4) 2 x = (1 - x) / 10 has one root nearby.
    x = float(found.value[0])
    assert 200 * x * (x**2 - 0.25) == pytest.approx(1 - x, abs=1e-6)
    inside = solved(rosenbrock, [-1.0, 0.25], -2.0, 0.5)
    assert float(inside.value[0]) == 0.5


def test_a_dependent_and_an_idle_variable_do_no_harm():
    def residual(y, _):
        along = y[0] + 2 * y[1]
        return jnp.stack([along - 1, 2 * along - 2.5, along**2 - 1])

    found = solved(residual, [0.3, 0.1, 0.7], -1.0, 1.0)
    assert found.result == optx.RESULTS.successful
    assert found.value[2] == 0.7
    gradient = jax.grad(lambda y: jnp.sum(residual(y, None) ** 2))(found.value)
    np.testing.assert_allclose(gradient, 0.0, atol=1e-6)


def test_what_is_not_finite_ends_with_a_code():
    found = solved(lambda y, _: jnp.log(y - 1), [0.5], 0.0, 1.0)
    assert found.result == optx.RESULTS.nonfinite
    # One trial point beyond the edge of the domain is only refused.
    found = solved(lambda y, _: jnp.concatenate([jnp.log(y) - 1, y - 5]), [0.2])
    assert found.result == optx.RESULTS.successful


def test_a_search_without_a_way_down_ends_with_a_code():
    def residual(y, _):
        return jnp.stack([1 + 2 * y[0] - 4 * jax.lax.stop_gradient(y[0]), 1.0])

    found = solved(residual, [0.2], 0.0, 1.0, most=60)
    assert found.result == optx.RESULTS.nonlinear_divergence


def test_the_function_is_traced_once_for_a_search():
    traced = 0

    def residual(y, _):
        nonlocal traced
        traced += 1
        return rosenbrock(y, None)

    def in_loop(y):
        # What a compiled search holds of the function: one primal evaluation with its tangents.
        return solved(residual, y).value

    text = str(jax.make_jaxpr(in_loop)(jnp.array([-1.2, 1.0])))
    assert traced == 1
    assert text.count("integer_pow") == 1 or text.count("square") == 1


def test_implicit_derivatives_inside_the_box():
    def minimum(target):
        found = optx.least_squares(
            lambda y, args: jnp.concatenate([y**3 - args, 0 * y]),
            SOLVER,
            jnp.array([0.5]),
            target,
            {"lower": 0.0, "upper": 3.0},
        )
        return found.value[0]

    assert float(jax.grad(minimum)(8.0)) == pytest.approx(1 / 12, rel=1e-6)
