"""Steps of damped least squares within a box, and searches by them, against scipy."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
import pytest
from scipy.optimize import least_squares, lsq_linear

from jaxink.fitting import BoundedLevenbergMarquardt
from jaxink.fitting.bounded import Box, Factors, bounded_step
from jaxink.fitting.compiled import Point
from jaxink.fitting.outcome import Outcome
from jaxink.fitting.stepped_search import descend


def rosenbrock(x, _):
    return jnp.concatenate([10 * (x[1:] - x[:-1] ** 2), 1 - x[:-1]])


def decay(x, data):
    t, y = data
    return x[0] * jnp.exp(-x[1] * t) + x[2] - y


def two_decays(x, data):
    t, y = data
    return x[0] * jnp.exp(-x[1] * t) + x[2] * jnp.exp(-x[3] * t) - y


def resonance(x, data):
    t, y = data
    return x[0] / (1 + ((t - x[1]) / x[2]) ** 2) + x[3] - y


def problems():
    """Twenty-four seeded problems; most have their unbounded minimum outside the box."""
    rng = np.random.default_rng(20)
    t = np.linspace(0, 4, 30)
    for k in range(6):
        upper = rng.uniform(0.2, 0.9, 2 + k % 3)
        yield f"rosenbrock-{k}", rosenbrock, (), -2.0 * np.ones_like(upper), upper, np.zeros_like(upper)
    for k in range(6):
        y = 2.0 * np.exp(-1.3 * t) + 0.5 + 0.01 * rng.normal(size=t.size)
        lower, upper = np.array([0.0, 0.0, 0.0]), np.array([5.0, rng.uniform(0.6, 1.2), 1.0])
        yield f"decay-{k}", decay, (t, y), lower, upper, np.array([1.0, 0.3, 0.1])
    for k in range(6):
        y = 1.5 * np.exp(-0.4 * t) + 1.0 * np.exp(-3.0 * t) + 0.01 * rng.normal(size=t.size)
        lower = np.array([0.0, rng.uniform(0.45, 0.7), 0.0, 1.0])
        # Near the minimum: a second amplitude of 0 makes its rate idle, which is a stationary point too.
        start = np.array([1.2, lower[1] + 0.1, 0.8, 2.5])
        yield f"two-decays-{k}", two_decays, (t, y), lower, np.full(4, 6.0), start
    for k in range(6):
        y = 3 / (1 + ((t - 2.1) / 0.4) ** 2) + 0.2 + 0.02 * rng.normal(size=t.size)
        lower = np.array([0.1, 1.0, rng.uniform(0.45, 0.8), 0.0])
        yield f"resonance-{k}", resonance, (t, y), lower, np.array([9.0, 3.0, 2.0, 0.15]), lower + 0.1


PROBLEMS = {name: rest for name, *rest in problems()}


def evaluated(residual, data, most):
    """The residual and its Jacobian at a point, at most so many times."""
    both = jax.jit(lambda x: (residual(x, data), jax.jacfwd(residual)(x, data)))
    count = 0

    def evaluate(x):
        nonlocal count
        count += 1
        assert count <= most
        rows, jacobian = map(np.asarray, both(jnp.asarray(x)))
        return Point(np.asarray(x), rows, rows, jacobian)

    return evaluate


def solve(residual, data, lower, upper, start, most=200):
    found, outcome = descend(evaluated(residual, data, most), start, lower, upper, decrement=1e-12)
    assert outcome is Outcome.CONVERGED
    return found.unit


@pytest.mark.parametrize("name", PROBLEMS)
def test_never_a_worse_minimum_than_scipy_and_first_order_conditions_hold(name):
    residual, data, lower, upper, start = PROBLEMS[name]
    data = tuple(map(jnp.asarray, data))
    found = solve(residual, data, lower, upper, start)
    assert np.all(found >= lower)
    assert np.all(found <= upper)

    def value(x):
        return np.asarray(residual(jnp.asarray(x), data))

    def slope(x):
        return np.asarray(jax.jacfwd(residual)(jnp.asarray(x), data))

    scipy_found = least_squares(
        value, start, slope, bounds=(lower, upper), method="trf", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    loss = np.sum(value(found) ** 2)
    assert loss <= 2 * scipy_found.cost * (1 + 1e-7) + 1e-12
    jacobian = slope(found)
    gradient = jacobian.T @ value(found) / (np.linalg.norm(jacobian, axis=0) * np.sqrt(loss) + 1e-300)
    inside = (found > lower) & (found < upper)
    assert np.all(np.abs(gradient[inside]) < 1e-4)
    assert np.all(gradient[found <= lower] > -1e-4)
    assert np.all(gradient[found >= upper] < 1e-4)


def test_some_of_the_problems_end_on_a_bound():
    on_bound = 0
    for residual, data, lower, upper, start in PROBLEMS.values():
        data = tuple(map(jnp.asarray, data))
        found = solve(residual, data, lower, upper, start)
        on_bound += bool(np.any((found == lower) | (found == upper)))
    assert on_bound >= 15


@pytest.mark.parametrize("seed", range(10))
def test_undamped_step_of_a_linear_problem_is_feasible_and_ends_at_scipys_solution(seed):
    rng = np.random.default_rng(seed)
    matrix, target = rng.normal(size=(12, 4)), rng.normal(size=12)
    lower, upper = np.full(4, -0.2), np.full(4, 0.2)
    y = np.zeros(4)
    for _ in range(20):
        q, triangle = np.linalg.qr(matrix)
        projected = q.T @ (matrix @ y - target)
        y = y + np.asarray(bounded_step(Factors(triangle, projected), y, Box(lower, upper), 1e-9))
        assert np.all((y >= lower) & (y <= upper))
    expected = lsq_linear(matrix, target, bounds=(lower, upper), tol=1e-14)
    assert np.sum((matrix @ y - target) ** 2) == pytest.approx(2 * expected.cost, rel=1e-8)


def test_equal_bounds_hold_a_variable_and_a_dependent_column_does_no_harm():
    matrix = np.array([[1.0, 1.0, 2.0], [2.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    q, triangle = np.linalg.qr(matrix)
    projected = q.T @ np.array([1.0, -1.0, 0.5])
    lower, upper = np.array([-9.0, -9.0, 0.3]), np.array([9.0, 9.0, 0.3])
    y = np.array([0.0, 0.0, 0.3])
    step = bounded_step(Factors(triangle, projected), y, Box(lower, upper), 0.0)
    assert step[2] == 0
    assert np.all(np.isfinite(step))
    assert step[0] == pytest.approx(step[1])
    assert step[0] + step[1] == pytest.approx(0.2)


@pytest.mark.parametrize("curvature", [-0.9, -0.75, 0.6])
def test_a_misfit_does_not_slow_the_search_down(curvature):
    """Gauss-Newton's error changes by the factor `curvature` in each step; the third variable is idle."""

    def residual(x, _):
        return jnp.stack([x[0] + 1, curvature * x[0] ** 2 + x[0] - 1, x[1] - 0.3])

    end = solve(residual, (), -np.ones(3), np.ones(3), np.array([0.2, 0.0, 0.5]), most=20)
    np.testing.assert_allclose(end[:2], [0.0, 0.3], atol=1e-6)


def not_finite(x, _):
    return jnp.stack([jnp.log(x[0] - 1), x[0]])


def without_slope(x, _):
    return jnp.stack([1 + jnp.sqrt(jnp.abs(x[0] - 0.25)), x[1]])


def against_its_derivatives(x, _):
    """A residual that rises where its derivatives, which are wrong, promise a fall."""
    return jnp.stack([1 + 2 * x[0] - 4 * jax.lax.stop_gradient(x[0]), jnp.ones(())])


@pytest.mark.parametrize(
    ("residual", "start", "outcome"),
    [
        (not_finite, [0.5], Outcome.NOT_FINITE),
        (without_slope, [0.25, 0.5], Outcome.NO_SLOPE),
        (against_its_derivatives, [0.2], Outcome.STALLED),
    ],
)
def test_a_search_that_finds_no_minimum_says_so(residual, start, outcome):
    start = np.array(start)
    box = np.zeros_like(start), np.ones_like(start)
    assert descend(evaluated(residual, (), 30), start, *box)[1] is outcome


def with_a_kink(x, _):
    """A residual whose minimum lies at a kink, so that its derivatives never tell that it is reached."""
    return jnp.stack([10 * (x[0] - 0.3), 1 + 0.05 * jnp.abs(x[0] - 0.3)])


def test_a_search_ends_where_the_model_is_no_smoother():
    start, box = np.array([0.8]), (np.zeros(1), np.ones(1))
    point, outcome = descend(evaluated(with_a_kink, (), 30), start, *box)
    assert outcome is Outcome.STALLED
    # In standard errors, the first residual is the distance.
    assert abs(point.residual[0]) < 0.01
    solver = BoundedLevenbergMarquardt()
    found = optx.least_squares(with_a_kink, solver, jnp.asarray(start), max_steps=30, throw=False)
    assert found.result == optx.RESULTS.successful


@pytest.mark.parametrize("name", ["rosenbrock-1", "two-decays-1", "resonance-3"])
def test_the_solver_of_optimistix_takes_the_same_steps(name):
    residual, data, lower, upper, start = PROBLEMS[name]
    data = tuple(map(jnp.asarray, data))
    steps = []

    def follow():
        steps.append(1)

    by_steps, _ = descend(evaluated(residual, data, 200), start, lower, upper, 1e-12, follow)
    solver, box = BoundedLevenbergMarquardt(rtol=1e-12), {"lower": lower, "upper": upper}
    compiled = optx.least_squares(residual, solver, jnp.asarray(start), data, box)
    assert compiled.stats["num_steps"] == len(steps)
    np.testing.assert_allclose(compiled.value, by_steps.unit, rtol=1e-9, atol=1e-12)


def test_a_fit_searches_by_the_solver_of_optimistix():
    code = "import sys, jaxink; jaxink.fit; sys.exit('optimistix' not in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
