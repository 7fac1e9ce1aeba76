"""Standard errors where a fit ended."""

import numpy as np

from jaxink.fitting.uncertainty import covariance


def test_covariance_is_the_inverse_of_the_information():
    jacobian = np.random.default_rng(1).standard_normal((40, 3))
    triangle = np.linalg.qr(jacobian)[1]
    found = covariance(triangle, np.full(3, 0.5), np.zeros(3))
    np.testing.assert_allclose(found.matrix, np.linalg.inv(jacobian.T @ jacobian), rtol=1e-10)


def test_a_parameter_that_its_bound_holds_has_no_spread_and_leaves_the_others_theirs():
    jacobian = np.random.default_rng(2).standard_normal((40, 3))
    triangle = np.linalg.qr(jacobian)[1]
    found = covariance(triangle, np.array([0.5, 1.0, 0.5]), np.array([0.0, -3.0, 0.0]))
    assert found.held.tolist() == [False, True, False]
    rest = np.delete(jacobian, 1, axis=1)
    np.testing.assert_allclose(found.matrix[np.ix_([0, 2], [0, 2])], np.linalg.inv(rest.T @ rest), rtol=1e-10)
    assert found.deviation[1] == 0


def test_without_derivatives_nothing_is_known():
    found = covariance(np.full((2, 2), np.nan), np.array([0.5, 0.5]), np.full(2, np.nan))
    assert np.all(np.isinf(found.deviation))
    assert np.all(np.isnan(found.correlation))
