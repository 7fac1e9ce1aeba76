import dataclasses

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from jaxink.diagnosis import HeldOutGain, Observations, block_folds, held_out_gain, scan_folds
from tests.diagnosis.designs import goniometer


@pytest.fixture
def observations():
    rng = np.random.default_rng(1)
    scan = np.array([0, 1, 0, 1, 2, 2, 0, 1, 2, 2])
    return Observations(rng.uniform(0.1, 1, 10), rng.uniform(0.01, 0.1, 10), scan, 0.07)


def dense(observations, predicted, chosen):
    """Log density by the covariance of all points, scans independent."""
    scan = observations.scan[chosen]
    factor = observations.scan_relative * predicted[chosen]
    covariance = np.diag(observations.sigma_per_sr[chosen] ** 2)
    covariance += np.where(scan[:, None] == scan[None, :], np.outer(factor, factor), 0.0)
    return multivariate_normal(predicted[chosen], covariance).logpdf(observations.measured_per_sr[chosen])


def test_density_of_whole_scans_is_the_multivariate_normal(observations):
    predicted = observations.measured_per_sr * np.linspace(0.9, 1.1, 10)
    for numbers in ([0], [2], [0, 2], [0, 1, 2]):
        held = np.isin(observations.scan, numbers)
        exact = dense(observations, predicted, held)
        assert observations.log_density(predicted, held) == pytest.approx(exact, abs=1e-10)


def test_a_scan_counts_as_often_as_its_weight_says(observations):
    predicted = observations.measured_per_sr * np.linspace(0.9, 1.1, 10)
    weighted = dataclasses.replace(observations, weight=np.array([2.0, 0.5, 0.0]))
    each = [observations.log_density(predicted, observations.scan == scan) for scan in range(3)]
    assert weighted.log_density(predicted, np.ones(10, bool)) == pytest.approx(2 * each[0] + 0.5 * each[1])


def test_density_of_a_block_is_conditional_on_the_rest_of_its_scan(observations):
    predicted = observations.measured_per_sr * np.linspace(0.9, 1.1, 10)
    held = np.zeros(10, bool)
    held[[0, 2]] = True
    whole = observations.scan == 0
    exact = dense(observations, predicted, whole) - dense(observations, predicted, whole & ~held)
    assert observations.log_density(predicted, held) == pytest.approx(exact, abs=1e-10)


def test_a_factor_of_a_scan_costs_nothing_where_the_scan_is_marginalised():
    scan = np.repeat([0, 1], 50)
    shape = np.linspace(1, 2, 100)
    measured = shape * np.where(scan == 1, 1.1, 1.0)
    with_factor = Observations(measured, 0.001 * shape, scan, 0.1)
    without = Observations(measured, 0.001 * shape, scan, 0.0)
    held = scan == 1
    # 10 % of a factor whose standard deviation is 10 %, against 100 standard deviations at each point.
    lost = with_factor.log_density(measured, held) - with_factor.log_density(shape, held)
    assert lost == pytest.approx(0.5, abs=0.2)
    assert without.log_density(measured, held) - without.log_density(shape, held) > 1e5


def test_folds_hold_out_every_point_once():
    points = goniometer(views=10)
    whole = scan_folds(points.scan)
    assert whole.shape == (6, 240)
    blocks = block_folds(points, 5)
    for folds in (whole, blocks):
        np.testing.assert_array_equal(folds.sum(axis=0), 1)
    for scan in range(6):
        path = points.path[points.scan[points.path] == scan]
        for fold in blocks:
            # Neighbours along the scan, 8 of its 40 points.
            assert np.flatnonzero(fold[path]).tolist() == list(
                range(np.argmax(fold[path]), np.argmax(fold[path]) + 8)
            )


def test_gain_over_folds():
    points = goniometer(views=10)
    rng = np.random.default_rng(2)
    truth = 1 + 0.3 * np.cos(np.deg2rad(points.theta_o_deg))
    sigma = np.full(240, 0.02)
    observations = Observations(truth + sigma * rng.standard_normal(240), sigma, points.scan, 0.0)
    folds = scan_folds(points.scan)
    right, off = np.tile(truth, (6, 1)), np.tile(truth + 0.02, (6, 1))
    gain = held_out_gain(observations, folds, off, right)
    # 40 points, each off by one standard deviation: 20 a fold, plus or minus sqrt(40).
    assert gain.mean == pytest.approx(20, abs=3 * np.sqrt(40 / 6))
    assert gain.improves
    assert not held_out_gain(observations, folds, right, off).improves
    assert not held_out_gain(observations, folds, right, right).improves


def test_standard_error_of_the_gain():
    gain = HeldOutGain(np.array([1.0, 2.0, 3.0, 6.0]))
    assert gain.mean == 3
    assert gain.standard_error == pytest.approx(np.sqrt((4 + 1 + 0 + 9) / 3 / 4))
    assert not HeldOutGain(np.array([5.0])).improves


def test_refusals(refused):
    with refused():
        scan_folds(np.zeros(5, int))
    with refused("n_blocks"):
        block_folds(goniometer(views=5), 99)
