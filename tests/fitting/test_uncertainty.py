"""Standard errors where a fit ended."""

import numpy as np

import jaxink
from jaxink.data import simulated_example
from jaxink.fitting import assembly, minimisation
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


def test_what_fails_after_the_search_costs_no_fit(coarse, monkeypatch, told):
    def profiled(engine, best, position, deviation, original=minimisation.profile):
        if position == 1:
            raise np.linalg.LinAlgError("SVD did not converge")
        return original(engine, best, position, deviation)

    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(minimisation, "profile", profiled)
    monkeypatch.setattr(assembly, "neglected_polarisation", fail)
    monkeypatch.setattr(assembly, "_derived", fail)
    result = jaxink.fit(*simulated_example(), jaxink.FitOptions(config=coarse, profile="all"))
    free = [parameter.name for parameter in result.sample.parameters.free]
    assert [curve.name for curve in result.profiles] == [name for name in free if name != free[1]]
    assert result.converged
    assert result[free[1]].standard_error > 0
    assert result.derived == ()
    assert result.neglected_polarisation is None
    missing = [note for note in result.notes if "failed" in note]
    assert len(missing) == 3
    for note in missing:
        told(note)
