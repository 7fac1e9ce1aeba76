"""The whitened residual of a fit: its definition, and that its squares are chi-square."""

import dataclasses

import numpy as np
import pytest

from jaxink.fitting.objective import whiten_scans


def pieces(result):
    """(measured - predicted) / sigma and r s / sigma of each used point, and the number of its scan."""
    data, sigma = result.data, result.sigma_per_sr
    residual = (data.bsdf_per_sr[data.used] - result.predicted_per_sr) / sigma
    common = result.noise["scan_relative"] * result.predicted_per_sr / sigma
    return residual, common, data.scan_index[data.used]


def test_it_is_the_residual_times_the_inverse_root_of_the_covariance(example_result):
    assert example_result.noise["scan_relative"] > 0
    residual, common, scans = pieces(example_result)
    for scan in np.unique(scans):
        here = scans == scan
        square, vectors = np.linalg.eigh(np.eye(here.sum()) + np.outer(common[here], common[here]))
        inverse_root = vectors @ np.diag(square**-0.5) @ vectors.T
        np.testing.assert_allclose(
            example_result.whitened_residual[here], inverse_root @ residual[here], rtol=1e-7, atol=1e-9
        )


def test_the_sum_of_its_squares_is_chi_square(example_result):
    squares = np.sum(example_result.whitened_residual**2)
    assert squares == pytest.approx(example_result.merit.chi_square, rel=1e-12)
    # The same from the covariance of each scan, without a root of it.
    residual, common, scans = pieces(example_result)
    total = 0.0
    for scan in np.unique(scans):
        here = scans == scan
        covariance = np.eye(here.sum()) + np.outer(common[here], common[here])
        total += residual[here] @ np.linalg.solve(covariance, residual[here])
    assert squares == pytest.approx(total, rel=1e-9)


def test_without_a_factor_of_the_scans_it_is_the_residual_over_sigma(example_result):
    residual, _, scans = pieces(example_result)
    whitened = whiten_scans(residual, np.zeros(residual.size), scans, int(scans.max()) + 1)
    np.testing.assert_allclose(whitened, residual, rtol=1e-6)


def test_it_is_a_copy_and_refused_where_the_noise_is_unknown(example_result, refused):
    example_result.whitened_residual[:] = 0
    assert np.any(example_result.whitened_residual)
    with refused("noise"):
        _ = dataclasses.replace(example_result, whitened=None).whitened_residual


def test_values_are_a_plain_dict(example_result):
    values = example_result.values
    assert type(values) is dict
    assert set(values) == set(example_result.parameters)
    assert values["ink.scattering_per_mm"] == example_result["ink.scattering_per_mm"].value
    assert all(type(value) is float for value in values.values())
