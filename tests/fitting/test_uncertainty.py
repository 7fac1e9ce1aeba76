"""Standard errors where a fit ended."""

import numpy as np

import jaxink
from jaxink.data import simulated_example
from jaxink.fitting import assembly, multistart
from jaxink.fitting.uncertainty import Covariance, covariance


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
    def profiled(engine, best, position, deviation, original=multistart.profile):
        if position == 1:
            raise np.linalg.LinAlgError("SVD did not converge")
        return original(engine, best, position, deviation)

    def fail(*_):
        raise MemoryError

    monkeypatch.setattr(multistart, "profile", profiled)
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


def test_of_many_weak_parameters_the_weakest_are_followed():
    deviation = np.full(40, 0.2)
    deviation[[3, 30]] = 0.01, np.inf
    deviation[10:20] = 0.3
    held = np.arange(40) == 39
    errors = Covariance(np.diag(np.where(held, 0.0, deviation**2)), held)
    followed, others = multistart._to_follow(errors, "auto")
    assert followed == [10, 11, 12, 13, 30, 39]
    assert others == [i for i in range(40) if i not in (3, *followed)]
    assert multistart._to_follow(errors, "all") == (list(range(40)), [])


def test_weak_parameters_without_a_profile_are_counted_and_keep_their_errors(coarse, monkeypatch, told):
    monkeypatch.setattr(multistart, "_WIDE", 1e-12)
    monkeypatch.setattr(multistart, "_MOST_PROFILES", 1)
    seen = []
    data, sample = simulated_example()
    options = jaxink.FitOptions(config=coarse)
    result = jaxink.fit(data, sample, options, progress=lambda what, step, _: seen.append(f"{what}: {step}"))
    (curve,) = result.profiles
    assert seen[-1] == f"profile of {curve.name}: 1 of 1"
    told(next(note for note in result.notes if note.startswith("Profile likelihoods")))
    plain = jaxink.fit(data, sample, jaxink.FitOptions(config=coarse, profile="none"))
    for parameter in result.sample.parameters.free:
        assert result[parameter.name].standard_error == plain[parameter.name].standard_error > 0
