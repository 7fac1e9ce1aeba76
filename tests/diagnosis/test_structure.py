import numpy as np
import pytest
from scipy import stats

from jaxink.diagnosis import Points, ScreenOptions, find_structure, prepare_structure
from jaxink.diagnosis.statistics.structure import ljung_box, moran, runs_z
from jaxink.measurement import GonioData
from tests.diagnosis.designs import autoregressive, goniometer, parameters, within_binomial

ONE_SCAN = np.array([0])


@pytest.fixture(scope="module")
def points():
    return goniometer(views=15)


@pytest.fixture(scope="module")
def jacobian(points):
    return parameters(points, np.random.default_rng(1))


@pytest.fixture(scope="module")
def prepared(points, jacobian):
    return prepare_structure(jacobian, points)


def test_runs_by_hand():
    # + + - - - + - + + -: 5 of either sign, 6 runs; mean 2*25/10 + 1 = 6, variance 5*4/9.
    signs = np.array([[1, 1, 0, 0, 0, 1, 0, 1, 1, 0], [1, 1, 1, 1, 1, 0, 0, 0, 0, 0]], bool)
    once = runs_z(signs, ONE_SCAN)
    expected = [0.0, (2 - 6) / np.sqrt(20 / 9)]
    np.testing.assert_allclose(once.per_scan[:, 0], expected)
    np.testing.assert_allclose(once.pooled, expected)
    # The same twice as two scans: no run passes from one to the next.
    twice = runs_z(np.hstack([signs, signs]), np.array([0, 10]))
    np.testing.assert_allclose(twice.per_scan, np.stack([expected, expected], axis=1))
    np.testing.assert_allclose(twice.pooled, np.sqrt(2) * np.array(expected))
    assert runs_z(np.ones((1, 10), bool), ONE_SCAN).per_scan[0, 0] == 0


def test_runs_have_mean_0_and_variance_1_of_noise():
    signs = np.random.default_rng(2).standard_normal((20_000, 40)) > 0
    z = runs_z(signs, ONE_SCAN).per_scan[:, 0]
    assert z.mean() == pytest.approx(0, abs=4 / np.sqrt(20_000))
    assert z.std() == pytest.approx(1, abs=0.02)


def test_ljung_box_by_its_definition():
    rng = np.random.default_rng(3)
    values = rng.standard_normal(30)
    power = np.sum(values**2)
    expected = 0.0
    for lag in range(1, 11):
        rho = sum(values[t] * values[t + lag] for t in range(30 - lag)) / power
        expected += 30 * 32 * rho**2 / (30 - lag)
    assert ljung_box(values[None, :], ONE_SCAN, 10)[0, 0] == pytest.approx(expected, rel=1e-12)
    both = np.concatenate([values, values[:20]])[None, :]
    assert ljung_box(both, np.array([0, 30]), 10)[0] == pytest.approx(
        [expected, ljung_box(values[None, :20], ONE_SCAN, 10)[0, 0]]
    )
    many = ljung_box(rng.standard_normal((4000, 200)), ONE_SCAN, 10)[:, 0]
    assert stats.kstest(many, stats.chi2(10).cdf).pvalue > 1e-3


def test_moran_by_its_definition(points):
    rng = np.random.default_rng(4)
    values = rng.standard_normal(len(points))
    weight = points.neighbours.toarray()
    weight = weight + weight.T
    assert set(np.unique(weight)) == {0.0, 1.0}
    assert np.all(weight.sum(axis=1) >= 4)
    # Pairs lie within a scan, and closer than 10 degrees but across the normal and at the horizon.
    a, b = np.nonzero(weight)
    assert np.array_equal(points.scan[a], points.scan[b])
    likeness = moran(values[None, :], points.neighbours, points.scan)
    expected = len(points) / weight.sum() * (values @ weight @ values) / (values @ values)
    assert likeness.pooled[0] == pytest.approx(expected, rel=1e-12)
    first = points.scan == 0
    inner, own = weight[np.ix_(first, first)], values[first]
    expected = own.size / inner.sum() * (own @ inner @ own) / (own @ own)
    assert likeness.per_scan[0, 0] == pytest.approx(expected, rel=1e-12)


def test_neighbouring_scans(points):
    a, b = points.across_incidence.nonzero()
    # Two sides, steps 0 to 30 and 30 to 60 degrees, 60 directions each.
    assert a.size == 2 * 2 * 60
    assert np.array_equal(points.is_transmission[a], points.is_transmission[b])
    np.testing.assert_allclose(points.theta_i_deg[b] - points.theta_i_deg[a], 30)
    np.testing.assert_allclose(points.direction[a], points.direction[b], atol=1e-12)
    assert points.across_wavelength.nnz == 0
    coloured = goniometer(incidences=(0.0, 50.0), views=5, wavelengths=(450.0, 550.0, 650.0))
    a, b = coloured.across_wavelength.nonzero()
    assert a.size == 2 * 2 * 2 * 20
    np.testing.assert_allclose(coloured.wavelength_nm[b] - coloured.wavelength_nm[a], 100)


def test_path_goes_from_horizon_to_horizon():
    plane = np.array([180, 0, 180, 0, 0, 90, -90, 90.0])
    theta = np.array([10, 60, 60, 10, 30, 20, 20, 70.0])
    settings = (np.zeros(8), theta, plane, np.full(8, 550.0), np.zeros(8, bool), np.arange(8.0))
    one = Points(np.zeros(8, int), *settings)
    # phi 180 counts as negative angles of the plane 0; the next plane runs back.
    assert one.path.tolist() == [2, 0, 3, 4, 1, 7, 5, 6]
    # More planes than rings: round the rings.
    ring = Points(np.zeros(4, int), np.zeros(4), np.full(4, 40.0), np.array([90, -30, 10, 170.0]), *_rest(4))
    assert ring.path.tolist() == [1, 2, 0, 3]


def _rest(count):
    return np.full(count, 550.0), np.zeros(count, bool), np.arange(float(count))


def test_points_of_a_measurement():
    data = GonioData(
        np.array([0, 0, 30, 30.0]),
        np.array([10, 20, 10, 20.0]),
        np.full(4, 180.0),
        np.full(4, 550.0),
        np.array([False, False, True, True]),
        np.ones(4),
        mask=np.array([0, 1, 0, 0]),
    )
    points = Points.of(data)
    assert points.scan.tolist() == [0, 1, 1]
    assert points.order.tolist() == [2, 4, 5]
    np.testing.assert_allclose(points.from_forward_deg, [10, 20, 10], atol=1e-9)
    np.testing.assert_allclose(points.from_retro_deg, [10, np.nan, np.nan], atol=1e-9)


def test_noise_shows_no_structure(prepared, points, jacobian):
    noise = np.random.default_rng(5).standard_normal((400, len(points)))
    results = [prepared.find(eps) for eps in noise]
    p = np.array([result.p_value for result in results])
    assert within_binomial(np.sum(p <= 0.05), 400, 0.05)
    assert stats.kstest(p, "uniform").pvalue > 1e-3
    for name in ("chi_square", "runs", "ljung_box", "neighbours", "incidence"):
        pooled = [result[name].p_value for result in results]
        assert stats.kstest(pooled, "uniform").pvalue > 1e-4
    worst = [result["neighbours"].worst_p_value for result in results]
    assert stats.kstest(worst, "uniform").pvalue > 1e-4
    left = noise[0] - jacobian @ np.linalg.lstsq(jacobian, noise[0], rcond=None)[0]
    assert results[0].chi_square == pytest.approx(left @ left)
    assert results[0].degrees_of_freedom == len(points) - 6
    assert results[0]["chi_square"].p_value == pytest.approx(stats.chi2.sf(left @ left, len(points) - 6))


def test_correlated_noise_is_found_and_whitened_noise_is_not(points, jacobian, prepared):
    root, whitening = autoregressive(points, 0.9)
    noise = np.random.default_rng(6).standard_normal((200, len(points)))
    found = [prepared.find(root @ eps).p_value for eps in noise]
    assert np.mean(np.array(found) <= 0.05) > 0.99
    right = prepare_structure(whitening @ jacobian, points)
    rest = np.array([right.find(eps).p_value for eps in noise])
    assert within_binomial(np.sum(rest <= 0.05), 200, 0.05)


def test_wave_in_one_scan_is_found_there(points, jacobian, prepared):
    wave = np.where(points.scan == 4, np.cos(np.deg2rad(6 * points.theta_o_deg)), 0.0)
    residual = np.random.default_rng(7).standard_normal(len(points)) + 2.5 * wave
    result = prepared.find(residual)
    assert result.p_value < 0.002
    assert result["neighbours"].worst_scan == 4
    assert result["neighbours"].worst_p_value < 0.01
    # Half of the noise that was believed hides it from chi-square, not from the order of the points.
    weak = prepared.find(0.5 * residual)
    assert weak["chi_square"].p_value > 0.99
    assert weak["neighbours"].p_value == result["neighbours"].p_value
    strong = find_structure(5 * residual, jacobian, points)
    assert strong["chi_square"].p_value < 1e-10
    assert strong.leading == "chi_square"


def test_rows_of_priors_and_parameters_on_bounds(points):
    rng = np.random.default_rng(8)
    rows = np.vstack([parameters(points, rng, 4), np.eye(4)])
    options = ScreenOptions(n_bootstrap=500)
    prepared = prepare_structure(rows, points, at_bound=np.array([0, -1, 0, 1]), options=options)
    noise = rng.standard_normal((300, len(rows)))
    results = [prepared.find(eps) for eps in noise]
    called = sum(result.p_value <= 0.05 for result in results)
    assert within_binomial(called, 300, 0.05), called
    freedom = {result.degrees_of_freedom for result in results}
    assert freedom == {len(rows) - count for count in (2, 3, 4)}


def test_short_scans_are_told_by_chi_square_alone():
    points = goniometer(incidences=(0.0, 20.0), views=1)
    result = find_structure(3 * np.ones(len(points)), np.ones((len(points), 0)), points)
    assert [statistic.name for statistic in result.statistics] == ["chi_square"]
    assert result.chi_square == pytest.approx(9 * len(points))
    assert result.p_value < 0.002


def test_noise_of_an_uncertain_level_is_no_structure(points, jacobian):
    rng, freedom, sets = np.random.default_rng(4), 16, 200
    options = ScreenOptions(n_bootstrap=1000, noise_freedom=freedom)
    exact, estimated = (
        prepare_structure(jacobian, points, options=o) for o in (ScreenOptions(n_bootstrap=1000), options)
    )
    residuals = rng.standard_normal((sets, len(points)))
    residuals /= np.sqrt(rng.chisquare(freedom, (sets, 1)) / freedom)
    p = np.array([[test.find(r)["chi_square"].p_value for test in (exact, estimated)] for r in residuals])
    # Uniform if the level is taken for what it is; taken as exact, far too many are significant.
    assert np.mean(p[:, 1] < 0.05) < 0.05 + 3 * np.sqrt(0.05 * 0.95 / sets)
    assert np.mean(p[:, 0] < 0.05) > 0.25
    family = np.array([estimated.find(r).p_value for r in residuals])
    assert np.mean(family < 0.05) < 0.05 + 3 * np.sqrt(0.05 * 0.95 / sets)
