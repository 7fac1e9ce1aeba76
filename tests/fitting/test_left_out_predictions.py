"""Predictions of points that a fit has not seen."""

import numpy as np
import pytest

import jaxink
from jaxink.fitting import predict_left_out


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
