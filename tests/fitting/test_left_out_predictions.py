"""Predictions of points that a fit has not seen."""

import numpy as np
import pytest

import jaxink
from jaxink.diagnosis import scan_folds
from jaxink.errors import NotFiniteError
from jaxink.fitting import exclusion, predict_left_out
from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.exclusion import fit_near, objective_of, solution_of, without
from jaxink.fitting.gradient import GradientSearch
from jaxink.numerics.precision import computing


def test_left_out_scan_is_predicted_as_by_a_fit_without_it(example_result, coarse):
    result = example_result
    incidence = result.data.theta_i_deg[result.data.used]
    angles = np.unique(incidence)
    fold = incidence == angles[-1]
    (predicted,) = predict_left_out(result, fold[None])

    others = result.data.select(theta_i_deg=list(angles[:-1]))
    alone = jaxink.fit(others, result.sample, jaxink.FitOptions(config=coarse))
    expected = jaxink.predict(alone.sample, result.data, coarse)[result.data.used]
    np.testing.assert_allclose(predicted, expected, rtol=1e-5)
    # It is another fit, and one that has not seen the points is no better there.
    measured, sigma = result.data.bsdf_per_sr[result.data.used], result.sigma_per_sr
    seen, unseen = (np.sum(((p - measured) / sigma)[fold] ** 2) for p in (result.predicted_per_sr, predicted))
    assert unseen > seen
    assert predicted[fold] == pytest.approx(result.predicted_per_sr[fold], rel=0.05)


def test_jacobian_of_all_points_serves_for_the_first_step_of_every_fold(example_result):
    objective = objective_of(example_result)
    with computing():
        search, start = GradientSearch(objective), solution_of(objective, example_result)
        end, efforts = search.linearised(start), []
        for fold in scan_folds(objective.scan):
            rest = without(objective, fold)
            found = fit_near(search.on(rest), rest, end)
            anew = search.on(rest).run(start)
            assert found.outcome.converged
            # As close to the minimum as the search from the solution, whose end criterion is 1e-6.
            assert found.loss == pytest.approx(anew.loss, abs=2e-6)
            efforts.append((found.jacobians, anew.jacobians))
    mine, plain = np.mean(efforts, axis=0)
    assert mine <= 2 < plain


def test_a_first_step_that_leads_nowhere_is_not_made(example_result, monkeypatch):
    objective = objective_of(example_result)
    fold = np.asarray(objective.scan) == 0
    with computing():
        search, rest = GradientSearch(objective), without(objective, fold)
        end = search.linearised(solution_of(objective, example_result))
        expected = fit_near(search.on(rest), rest, end)
        monkeypatch.setattr(
            exclusion, "linear_minimum", lambda point, lower, upper: np.full_like(lower, 0.99)
        )
        found = fit_near(search.on(rest), rest, end)
    np.testing.assert_array_equal(found.start, end.unit)
    np.testing.assert_allclose(found.unit, expected.unit, atol=1e-5)


@pytest.mark.parametrize("where", ["before", "after"])
def test_a_fit_without_slope_is_no_fit(example_result, monkeypatch, where, told):
    """Where it ended the points that are left out have been seen; it must not pass for a prediction."""
    objective = objective_of(example_result)
    fold = np.asarray(objective.scan) == 0
    with computing():
        search, rest = GradientSearch(objective), without(objective, fold)
        end = search.linearised(solution_of(objective, example_result))
        if where == "before":
            end = end._replace(jacobian=np.where(np.arange(end.jacobian.shape[1]) == 1, np.nan, end.jacobian))
        else:
            original = CompiledObjective.linearised
            monkeypatch.setattr(
                CompiledObjective,
                "linearised",
                lambda self, unit: original(self, unit)._replace(jacobian=np.full_like(end.jacobian, np.nan)),
            )
        with pytest.raises(NotFiniteError) as problem:
            fit_near(search.on(rest), rest, end)
    told(str(problem.value))
