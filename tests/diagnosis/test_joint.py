from itertools import product

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import lsq_linear

from jaxink.diagnosis import Candidate, ScreenOptions, joint_drop, pairs_that_imitate, screen
from tests.diagnosis.designs import goniometer, parameters, smooth_function

FEW = ScreenOptions(n_bootstrap=200)


def brute_force(residual, jacobian, directions, signs, bound):
    """Least chi-square over all choices of what is zero, of those whose signs are right."""
    columns = np.hstack([jacobian, directions])
    allowed = np.concatenate([-bound, signs])
    limited = np.flatnonzero(allowed)
    best, best_solution = np.inf, None
    for chosen in product((False, True), repeat=limited.size):
        free = np.ones(allowed.size, bool)
        free[limited] = chosen
        solution = np.zeros(allowed.size)
        solution[free] = np.linalg.lstsq(columns[:, free], residual, rcond=None)[0]
        square = np.sum((residual - columns @ solution) ** 2)
        if np.all(solution * allowed >= -1e-12) and square < best:
            best, best_solution = square, solution
    return best, best_solution[bound.size :]


def test_joint_drop_is_that_of_brute_force():
    rng = np.random.default_rng(1)
    for _ in range(60):
        jacobian, directions = rng.standard_normal((40, 3)), rng.standard_normal((40, 4))
        # Strongly correlated strengths, so that signs matter to each other.
        directions += 2 * directions[:, :1]
        residual = rng.standard_normal(40) + directions[:, 1]
        signs, bound = rng.integers(-1, 2, 4), rng.integers(-1, 2, 3)
        found = joint_drop(residual, jacobian, directions, signs, at_bound=bound, options=FEW)
        before, _ = brute_force(residual, jacobian, np.zeros((40, 0)), np.zeros(0, int), bound)
        after, strengths = brute_force(residual, jacobian, directions, signs, bound)
        assert found.drop == pytest.approx(before - after, abs=1e-9)
        np.testing.assert_allclose(found.strengths, strengths, atol=1e-9)
        low = np.where(np.concatenate([-bound, signs]) > 0, 0, -np.inf)
        high = np.where(np.concatenate([-bound, signs]) < 0, 0, np.inf)
        columns = np.hstack([jacobian, directions])
        scipy = lsq_linear(columns, residual, (low, high), method="bvls", tol=1e-14)
        np.testing.assert_allclose(found.strengths, scipy.x[3:], atol=1e-7)


def test_joint_standard_errors_are_those_of_the_active_columns():
    rng = np.random.default_rng(2)
    jacobian, directions = rng.standard_normal((50, 2)), rng.standard_normal((50, 2))
    residual = directions @ np.array([3.0, -3.0])
    found = joint_drop(residual, jacobian, directions, np.array([1, 1]), options=FEW)
    active = np.column_stack([jacobian, directions[:, 0]])
    error = np.sqrt(np.linalg.inv(active.T @ active)[2, 2])
    assert found.standard_errors[0] == pytest.approx(error, rel=1e-9)
    assert np.isnan(found.standard_errors[1])
    assert found.strengths[1] == 0


def test_joint_p_value_is_chi_bar_square():
    # Two orthogonal strengths of one sign: weights 1/4, 1/2, 1/4.
    q = np.linalg.qr(np.random.default_rng(3).standard_normal((30, 4)))[0]
    jacobian, directions = q[:, :2], q[:, 2:]
    options = ScreenOptions(n_bootstrap=20_000)
    for z in (0.5, 1.0, 2.0):
        found = joint_drop(directions @ [z, z], jacobian, directions, np.array([1, 1]), options=options)
        assert found.drop == pytest.approx(2 * z**2)
        exact = 0.5 * stats.chi2.sf(2 * z**2, 1) + 0.25 * stats.chi2.sf(2 * z**2, 2)
        assert found.p_value == pytest.approx(exact, abs=4 * np.sqrt(exact / 20_000))
    nothing = joint_drop(-directions @ [1.0, 1.0], jacobian, directions, np.array([1, 1]), options=FEW)
    assert (nothing.drop, nothing.p_value) == (0.0, 1.0)


def test_pairs_that_imitate():
    points = goniometer(views=20)
    rng = np.random.default_rng(4)
    jacobian = parameters(points, rng, 3)
    a, c, b = (smooth_function(points, rng) for _ in range(3))
    b *= np.linalg.norm(2 * a) / np.linalg.norm(b)
    candidates = [
        Candidate("sum", 2 * a - b + jacobian[:, 0], 1),
        Candidate("a", a, 1),
        Candidate("b", b, -1),
        Candidate("c", c, 0),
        Candidate("b_of_the_other_sign", b, 1),
        Candidate("copy", 3 * (2 * a - b), 1),
    ]
    result = screen(rng.standard_normal(len(points)), jacobian, candidates, options=FEW)
    (pair,) = pairs_that_imitate(result, "sum")
    # Neither the pair of the wrong sign, nor one with the copy, which needs no partner.
    assert pair.names == ("a", "b")
    assert pair.share == pytest.approx(1, abs=1e-9)
    assert pair.ratios == pytest.approx((2.0, -1.0), rel=1e-6)
    assert pairs_that_imitate(result, "c") == ()
