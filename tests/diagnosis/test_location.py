import numpy as np
import pytest
from scipy import stats

from jaxink.diagnosis import Points, ScreenOptions, TangentCone, locate, smooth_part
from jaxink.diagnosis.statistics.discrepancy import (
    _VARIANCES,
    _kernel_root,
    _likelihood_gain,
    _modes,
    misfit_deviation,
)
from jaxink.diagnosis.statistics.variance_analysis import division_p, divisions_of
from tests.diagnosis.designs import goniometer, parameters

FEW = ScreenOptions(n_bootstrap=400)


@pytest.fixture(scope="module")
def points():
    return goniometer(views=25)


@pytest.fixture(scope="module")
def jacobian(points):
    return parameters(points, np.random.default_rng(1), 4)


@pytest.fixture(scope="module")
def noise(points):
    return np.random.default_rng(2).standard_normal(len(points))


def lobe(distance_deg, width_deg):
    return np.exp(-0.5 * (np.nan_to_num(distance_deg, nan=180.0) / width_deg) ** 2)


def test_low_rank_kernel_is_the_kernel():
    points = goniometer(incidences=(0.0, 40.0), views=6)
    root = _kernel_root(points, 30.0)
    chord = 2 * np.sin(np.deg2rad(15))
    square = np.sum((points.direction[:, None] - points.direction[None, :]) ** 2, axis=2) / chord**2
    square += ((points.theta_i_deg[:, None] - points.theta_i_deg[None, :]) / 20) ** 2
    kernel = np.exp(-0.5 * square)
    kernel *= points.is_transmission[:, None] == points.is_transmission[None, :]
    np.testing.assert_allclose(root @ root.T, kernel, atol=2e-3)


def test_a_misfit_shifts_parameters_by_about_as_much_as_is_said(points, jacobian):
    rng = np.random.default_rng(6)
    root = _kernel_root(points, 12.0)
    scores = []
    for _ in range(20):
        misfit = 20 * root @ rng.standard_normal(root.shape[1]) + rng.standard_normal(len(points))
        shift, *_ = np.linalg.lstsq(jacobian, misfit, rcond=None)
        smooth = smooth_part(misfit - jacobian @ shift, jacobian, points, options=FEW)
        scores.append(shift / misfit_deviation(smooth, jacobian, points))
    # 80 normal deviates, up to the error of the variance that is estimated.
    assert 0.75 < np.sqrt(np.mean(np.square(scores))) < 1.25


def test_a_parameter_on_a_bound_is_not_shifted(points, jacobian, noise):
    smooth = smooth_part(noise + 5 * lobe(points.theta_o_deg, 30), jacobian, points, options=FEW)
    held = misfit_deviation(smooth, jacobian, points, at_bound=np.array([0, 1, 0, 0]))
    others = misfit_deviation(smooth, np.delete(jacobian, 1, axis=1), points)
    assert np.isnan(held[1])
    np.testing.assert_allclose(np.delete(held, 1), others, rtol=1e-9)


def test_likelihood_is_that_of_the_dense_covariance():
    points = goniometer(incidences=(0.0, 40.0), views=6)
    rng = np.random.default_rng(3)
    jacobian = parameters(points, rng, 3)
    projection = TangentCone.of(jacobian).projection(np.zeros(0, bool))
    mode = _modes(points, 12.0, projection)
    residual = projection.remove(rng.standard_normal(len(points)) + lobe(points.theta_o_deg, 30))
    gains = _likelihood_gain((residual[None, :] @ mode.vectors) ** 2, mode.square)[0]
    # Coordinates in which the projected noise is white and the rest is not there.
    complement = np.linalg.svd(jacobian)[0][:, 3:]
    root = complement.T @ _kernel_root(points, 12.0)
    seen = complement.T @ residual
    unit = np.eye(seen.size)
    nothing = stats.multivariate_normal(cov=unit).logpdf(seen)
    for number in (0, 10, 20):
        dense = stats.multivariate_normal(cov=unit + _VARIANCES[number] * root @ root.T).logpdf(seen)
        assert gains[number] == pytest.approx(2 * (dense - nothing), abs=1e-6)


def test_smooth_part_recovers_a_smooth_misfit(points, jacobian, noise):
    misfit = 3 * lobe(points.from_forward_deg, 15) * points.is_transmission
    found = smooth_part(noise + misfit, jacobian, points)
    rest = misfit - jacobian @ np.linalg.lstsq(jacobian, misfit, rcond=None)[0]
    assert found.p_value < 0.001
    # What is left of the noise is what the process says, a tenth of it.
    error = np.sum((found.values - rest) ** 2)
    assert error == pytest.approx(np.sum(found.noise_power), rel=0.4)
    assert error < 0.15 * len(points)
    share = np.sum(rest**2) / (np.sum(rest**2) + len(points))
    assert found.share == pytest.approx(share, abs=0.08)
    # What the parameters imitate is theirs.
    np.testing.assert_allclose(jacobian.T @ found.values, 0, atol=1e-8 * np.abs(jacobian.T @ misfit).max())
    nothing = smooth_part(noise + jacobian @ np.full(4, 100.0), jacobian, points)
    alone = smooth_part(noise, jacobian, points)
    assert nothing.p_value == alone.p_value
    assert nothing.share == pytest.approx(alone.share, abs=1e-8)


@pytest.mark.parametrize(("name", "phi_deg"), [("forward", 180.0), ("retro", 0.0)])
def test_a_reading_on_the_edge_of_a_band_is_within_it(name, phi_deg, told):
    edges = np.array([5.0, 15.0, 30.0, 60.0])
    incidence, distance = (part.ravel() for part in np.meshgrid(np.arange(0.0, 30.0, 5.0), edges))
    n = incidence.size
    same = np.zeros(n, int), incidence, incidence + distance
    points = Points(
        *same, np.full(n, phi_deg), np.full(n, 550.0), np.zeros(n, bool), np.arange(n, dtype=float)
    )
    band, words = divisions_of(points)[name]
    np.testing.assert_array_equal(band, np.searchsorted(edges, distance))
    told(words[0], 5)


@pytest.mark.parametrize(
    ("misfit", "named"),
    [
        (
            lambda p: 3 * lobe(p.from_forward_deg, 8) * p.is_transmission * (1 + (p.theta_i_deg == 60)),
            ("positive", "T", "15", "60"),
        ),
        (
            lambda p: -3 * lobe(p.from_retro_deg, 15),
            ("negative", "R", "30"),
        ),
        (
            lambda p: 3 * lobe(p.from_forward_deg, 8) * ~p.is_transmission,
            ("positive", "R", "15"),
        ),
        (
            lambda p: 4 * lobe(90 - p.theta_o_deg, 8) * p.is_transmission,
            ("positive", "T", "20"),
        ),
        (
            lambda p: 3.0 * ((p.theta_i_deg == 30) & p.is_transmission),
            ("positive", "T", "30"),
        ),
        (
            lambda p: 2.0 * np.cos(np.deg2rad(12 * p.theta_o_deg)),
            (),
        ),
        (lambda p: np.zeros(len(p)), ()),
    ],
)
def test_words(points, noise, misfit, named, told):
    found = locate(noise + misfit(points), np.ones((len(points), 1)), points, options=FEW)
    told(found.sentence, *named)


def test_opposite_sides(points, noise, told):
    found = locate(
        noise + np.where(points.is_transmission, 1.0, -1.0), np.ones((len(points), 1)), points, options=FEW
    )
    told(found.sentence, "R", "T")
    side = next(factor for factor in found.factors if factor.name == "side")
    assert side.levels == ("R", "T")
    assert side.means == pytest.approx([-1, 1], abs=0.2)
    assert side.share > 0.9
    assert side.p_value < 1e-20


def test_wavelength_and_time(told):
    coloured = goniometer(incidences=(0.0, 50.0), views=10, wavelengths=(450.0, 550.0, 650.0))
    noise = np.random.default_rng(4).standard_normal(len(coloured))
    blue = (1.0 + 3 * (coloured.wavelength_nm == 450)) * lobe(coloured.from_forward_deg, 20)
    found = locate(noise + 2 * blue, np.zeros((len(coloured), 0)), coloured, options=FEW)
    told(found.sentence, "450 nm")
    # Measured in an order of its own, with a drift.
    order = np.random.default_rng(5).permutation(len(coloured)).astype(float)
    fields = (coloured.theta_i_deg, coloured.theta_o_deg, coloured.phi_deg, coloured.wavelength_nm)
    shuffled = Points(coloured.scan, *fields, coloured.is_transmission, order)
    late = order > 0.75 * len(order)
    found = locate(noise + 1 + 3 * late, np.zeros((len(order), 0)), shuffled, options=FEW)
    told(found.sentence)


def test_factors_have_exact_p_values(points, jacobian):
    projection = TangentCone.of(jacobian).projection(np.zeros(0, bool))
    left = projection.remove(np.random.default_rng(6).standard_normal((len(points), 300)))
    for name, (labels, levels) in divisions_of(points).items():
        if len(levels) > 1:
            p = [division_p(labels, projection, column) for column in left.T]
            assert stats.kstest(p, "uniform").pvalue > 1e-3, name
