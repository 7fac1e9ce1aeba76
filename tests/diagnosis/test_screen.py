import numpy as np
import pytest
from scipy import stats

from jaxink.diagnosis import (
    Candidate,
    Projection,
    ScreenOptions,
    TangentCone,
    Testability,
    prepare_screen,
    screen,
)
from jaxink.diagnosis.statistics.null_law import NullLaw, maximum_tail, tree_links
from tests.diagnosis.designs import (
    autoregressive,
    catalogue,
    goniometer,
    lobes,
    parameters,
    smooth_function,
    within_binomial,
)

DRAWS = 400


@pytest.fixture(scope="module")
def points():
    return goniometer()


@pytest.fixture(scope="module")
def jacobian(points):
    return parameters(points, np.random.default_rng(1))


@pytest.fixture(scope="module")
def candidates(points):
    return catalogue(points, np.random.default_rng(2))


@pytest.fixture(scope="module")
def prepared(jacobian, candidates):
    return prepare_screen(jacobian, candidates)


@pytest.fixture(scope="module")
def null_p(prepared, points):
    return prepared.p_values(np.random.default_rng(3).standard_normal((DRAWS, len(points))))


def calls(prepared, residuals):
    """Data sets in which some candidate is called."""
    return int(np.sum(np.nanmin(prepared.p_values(residuals).adjusted, axis=1) <= prepared.options.level))


def test_false_alarms_of_the_family(null_p):
    raw, adjusted = (p.min(axis=1) for p in (null_p.raw, null_p.adjusted))
    called = np.sum(adjusted <= 0.05)
    assert within_binomial(called, DRAWS, 0.05), called
    # Without the adjustment, some candidate passes 5 % in a good part of all null data sets.
    assert np.sum(raw < 0.05) > 0.3 * DRAWS
    assert stats.kstest(adjusted, "uniform").pvalue > 1e-3


def test_p_is_uniform_without_an_effect(null_p, candidates):
    for p, candidate in zip(null_p.raw.T, candidates, strict=True):
        if candidate.sign == 0:
            assert stats.kstest(p, "uniform").pvalue > 1e-4
            continue
        # One sign: p = 1 where the strength would have the other; below that, uniform.
        assert stats.kstest(p[p < 0.5] / 0.5, "uniform").pvalue > 1e-4
        assert within_binomial(np.sum(p < 0.5), DRAWS, 0.5, 0.9999)


def test_many_residuals_at_once_are_those_one_by_one(prepared, points):
    residuals = np.random.default_rng(20).standard_normal((3, len(points)))
    together = prepared.p_values(residuals)
    for row, residual in enumerate(residuals):
        records = prepared.screen(residual).candidates
        np.testing.assert_allclose(together.raw[row], [record.p_raw for record in records], rtol=1e-9)
        adjusted = [record.p_adjusted for record in records]
        np.testing.assert_allclose(together.adjusted[row], adjusted, rtol=1e-9)


def test_one_sided_critical_value():
    one, both = (NullLaw(sign, np.zeros(0), np.zeros(0)) for sign in (1, 0))
    assert one.critical(0.05) ** 2 == pytest.approx(2.7055, abs=1e-4)
    assert both.critical(0.05) ** 2 == pytest.approx(3.8415, abs=1e-4)
    # Chernoff: half of chi2_1, so that 3.84 would be a test at 2.5 %.
    assert one.p_value(np.array(3.8415)) == pytest.approx(0.025, abs=1e-5)
    np.testing.assert_allclose(both.p_value(np.array([1.0, 9.0])), stats.chi2.sf([1.0, 9.0], 1), rtol=1e-12)
    assert one.p_value(np.array(0.0)) == 1


@pytest.mark.parametrize("sign", [1, 0])
def test_bound_on_the_maximum_of_two_is_exact(sign):
    for rho in (-0.5, 0.0, 0.6, 0.95):
        both = stats.multivariate_normal(cov=[[1, rho], [rho, 1]])
        c = 1.7
        lower = None if sign else np.array([-c, -c])
        exact = 1 - both.cdf(np.array([c, c]), lower_limit=lower)
        assert maximum_tail(np.array(c), np.array([rho]), sign) == pytest.approx(exact, abs=1e-5)


def test_bound_on_the_maximum_over_a_grid_is_sharp_in_the_tail(points):
    directions = lobes(points, 40.0, np.geomspace(2, 40, 12))
    correlation = np.corrcoef(directions.T)
    root = np.linalg.cholesky(correlation + 1e-12 * np.eye(12))
    largest = (np.random.default_rng(4).standard_normal((400_000, 12)) @ root.T).max(axis=1)
    for c in (2.0, 2.5, 3.0):
        share = np.mean(largest > c)
        bound = maximum_tail(np.array(c), tree_links(correlation, 1), 1)
        # Standard error of the share of 400 000 draws at c = 3: 2 %.
        assert 0.94 * share < bound < 1.15 * share
        assert bound > 1.2 * stats.norm.sf(c)


def test_step_strength_and_drop_are_those_of_the_linear_refit(points, jacobian, candidates):
    rng = np.random.default_rng(5)
    residual = rng.standard_normal(len(points)) + 0.5 * smooth_function(points, rng)
    result = screen(residual, jacobian, candidates)
    before = np.linalg.lstsq(jacobian, residual, rcond=None)[1][0]
    projection = Projection(TangentCone.of(jacobian).basis)
    assert np.sum(projection.remove(residual) ** 2) == pytest.approx(before, rel=1e-10)
    assert projection.basis.shape == (len(points), 6)
    for candidate, record in zip(candidates, result.candidates, strict=True):
        design = np.column_stack([candidate.directions[:, record.inner], jacobian])
        solution, square = np.linalg.lstsq(design, residual, rcond=None)[:2]
        assert record.strength == pytest.approx(solution[0], rel=1e-6)
        covariance = np.linalg.inv(design.T @ design)
        assert record.standard_error == pytest.approx(np.sqrt(covariance[0, 0]), rel=1e-6)
        assert record.z == pytest.approx(record.strength / record.standard_error, rel=1e-9)
        admissible = candidate.sign == 0 or candidate.sign * solution[0] > 0
        drop = before - square[0] if admissible else 0.0
        assert record.predicted_delta_chi_square == pytest.approx(drop, rel=1e-6, abs=1e-8)
        rest = np.linalg.lstsq(jacobian, design[:, 0], rcond=None)[1][0]
        assert record.degenerate_fraction == pytest.approx(1 - rest / (design[:, 0] @ design[:, 0]), abs=1e-9)


def test_best_inner_value_has_the_largest_drop(points, jacobian):
    directions = lobes(points, 40.0, np.array([3.0, 9.0, 27.0]))
    residual = 2 * directions[:, 1] + np.random.default_rng(6).standard_normal(len(points))
    found = screen(residual, jacobian, [Candidate("lobe", directions, 1)])["lobe"]
    assert found.inner == 1
    assert found.strength == pytest.approx(2, abs=4 * found.standard_error)
    # The other sign is not admissible, and its best is where it fits least badly.
    wrong = screen(residual, jacobian, [Candidate("lobe", directions, -1)])["lobe"]
    assert wrong.predicted_delta_chi_square == 0
    assert wrong.p_raw == 1


def test_power_at_the_detection_limit(prepared, points, candidates):
    rng = np.random.default_rng(7)
    noise = rng.standard_normal((200, len(points)))
    for name in ("plain_0", "plain_1", "lobe_0"):
        candidate = next(c for c in candidates if c.name == name)
        inner = candidate.directions.shape[1] // 2
        limit = prepared.screen(noise[0])[name].detection_limits[inner]
        sign = candidate.sign or 1
        shares = []
        for multiple in (1, 2):
            shift = sign * multiple * limit * candidate.directions[:, inner]
            adjusted = prepared.p_values(shift + noise).adjusted[:, candidates.index(candidate)]
            shares.append(int(np.sum(adjusted <= 0.05)))
        # Half at the limit itself by definition, more where several inner values have their chance.
        assert shares[0] >= stats.binom.ppf(0.005, 200, 0.5)
        if candidate.directions.shape[1] == 1:
            assert within_binomial(shares[0], 200, 0.5)
        assert shares[1] >= stats.binom.ppf(0.005, 200, 0.98)


def test_critical_z_is_the_family_threshold(prepared, points, jacobian, candidates):
    position = 2
    direction = candidates[position].directions[:, 0]
    unit = direction - jacobian @ np.linalg.lstsq(jacobian, direction, rcond=None)[0]
    unit /= np.linalg.norm(unit)
    critical = prepared.screen(np.zeros(len(points)) + unit).candidates[position].critical_z
    assert critical > 2.5
    for factor, is_called in ((0.999, False), (1.001, True)):
        record = prepared.screen(factor * critical * candidates[position].sign * unit).candidates[position]
        assert (record.p_adjusted <= 0.05) is is_called


def test_what_the_parameters_imitate_is_never_called(points, jacobian, told):
    rng = np.random.default_rng(8)
    inside = jacobian @ rng.standard_normal(6)
    nearly = inside / np.linalg.norm(inside) + 0.1 * rng.standard_normal(len(points)) / np.sqrt(len(points))
    broken = np.where(np.arange(len(points)) == 5, np.nan, 1.0)
    half_broken = np.column_stack([broken, smooth_function(points, rng)])
    candidates = [
        Candidate("inside", inside, 1),
        Candidate("nearly", nearly, 0),
        Candidate("zero", np.zeros(len(points)), 0),
        Candidate("broken", broken, 0),
        Candidate("half", half_broken, 0),
    ]
    result = screen(50 * inside + rng.standard_normal(len(points)), jacobian, candidates)
    assert result["inside"].status is Testability.NOT
    assert result["inside"].degenerate_fraction == 1
    told(result["inside"].reason)
    assert result["nearly"].status is Testability.HARDLY
    assert result["nearly"].degenerate_fraction == pytest.approx(0.99, abs=0.003)
    told(result["zero"].reason)
    told(result["broken"].reason)
    assert (result["half"].status, result["half"].inner) == (Testability.TESTABLE, 1)
    assert np.isnan(result["half"].standard_errors[0])
    assert {c.name for c in result.candidates if c.status is not Testability.NOT} == {"nearly", "half"}
    assert not any(c.p_adjusted <= result.options.level for c in result.candidates)


def test_nearly_dependent_parameters_do_no_harm(points, jacobian, candidates):
    rng = np.random.default_rng(9)
    residual = rng.standard_normal(len(points))
    doubled = np.column_stack([jacobian, jacobian @ rng.standard_normal(6), 1e9 * jacobian[:, 0]])
    doubled[:, 6] *= 1 + 1e-13 * rng.standard_normal(len(points))
    plain, with_copies = screen(residual, jacobian, candidates), screen(residual, doubled, candidates)
    assert TangentCone.of(doubled).basis.shape == TangentCone.of(jacobian).basis.shape
    for one, other in zip(plain.candidates, with_copies.candidates, strict=True):
        assert other.z == pytest.approx(one.z, abs=1e-6)


def test_correlated_noise_taken_for_white_raises_false_alarms(points, jacobian, candidates, prepared):
    rng = np.random.default_rng(10)
    root, whitening = autoregressive(points, 0.9)
    noise = rng.standard_normal((200, len(points)))
    assert calls(prepared, noise @ root.T) > 0.8 * 200
    moved = [Candidate(c.name, whitening @ c.directions, c.sign) for c in candidates]
    called = calls(prepare_screen(whitening @ jacobian, moved), noise)
    assert within_binomial(called, 200, 0.05), called


def bounded_design(rho):
    """60 rows, two free parameters, one on its lower bound, and a candidate correlated with it."""
    rng = np.random.default_rng(12)
    q = np.linalg.qr(rng.standard_normal((60, 4)))[0]
    candidate = rho * q[:, 2] + np.sqrt(1 - rho**2) * q[:, 3]
    return q[:, :3], Candidate("e", candidate, 1)


@pytest.mark.parametrize("rho", [-0.9, 0.0, 0.9])
def test_parameter_on_its_bound(rho):
    jacobian, candidate = bounded_design(rho)
    prepared = prepare_screen(jacobian, [candidate], at_bound=np.array([0, 0, -1]))
    noise = np.random.default_rng(13).standard_normal((4000, 60))
    p = prepared.p_values(noise).raw[:, 0]
    assert within_binomial(np.sum(p < 0.05), 4000, 0.05, 0.999), np.mean(p < 0.05)
    # The usual law ignores that the parameter is free in one half of the cases and held in the other.
    held = noise @ jacobian[:, 2] < 0
    inside = candidate.directions[:, 0] @ jacobian[:, 2]
    z = noise @ candidate.directions[:, 0]
    z = np.where(held, z, (z - inside * (noise @ jacobian[:, 2])) / np.sqrt(1 - inside**2))
    naive = np.mean(z > stats.norm.isf(0.05))
    if rho == -0.9:
        assert naive > 0.06
    if rho == 0.9:
        assert naive < 0.04


def test_parameter_pushed_against_its_bound_is_held():
    jacobian, candidate = bounded_design(0.5)
    # Misfit that a smaller parameter would remove: not allowed, so the candidate must not be told to.
    residual = -5 * jacobian[:, 2] + np.random.default_rng(14).standard_normal(60)
    lower, upper = np.array([0, 0, -1]), np.array([0, 0, 1])
    held = screen(residual, jacobian, [candidate], at_bound=lower)
    alone = screen(residual, jacobian[:, :2], [candidate])
    assert not TangentCone.of(jacobian, lower).active(residual[None, :]).any()
    assert held["e"].z == pytest.approx(alone["e"].z, rel=1e-9)
    # On the upper bound the same misfit pulls it inside.
    free = screen(residual, jacobian, [candidate], at_bound=upper)
    assert TangentCone.of(jacobian, upper).active(residual[None, :]).all()
    assert free["e"].z == pytest.approx(screen(residual, jacobian, [candidate])["e"].z, rel=1e-9)


def test_parameter_close_to_its_bound_but_inside_is_free():
    jacobian, candidate = bounded_design(0.5)
    basis = np.linalg.qr(jacobian)[0]
    noise = np.random.default_rng(21).standard_normal((20, 60))
    # At a minimum the pull of such a parameter is rounding, of either sign.
    fitted = noise - noise @ basis @ basis.T
    prepared = prepare_screen(jacobian, [candidate], at_bound=np.array([0, 0, -1]))
    alone = prepare_screen(jacobian, [candidate])
    for residual in fitted:
        result = prepared.screen(residual)
        assert prepared.cone.active(residual[None, :]).all()
        assert result["e"].z == pytest.approx(alone.screen(residual)["e"].z, abs=1e-9)


def test_family_with_parameters_on_bounds(points, jacobian, candidates):
    prepared = prepare_screen(jacobian, candidates, at_bound=np.array([0, -1, 0, 1, 0, 0]))
    called = calls(prepared, np.random.default_rng(15).standard_normal((DRAWS, len(points))))
    assert within_binomial(called, DRAWS, 0.05), called


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"names": ("a", "a")}, "a"),
        ({"rows": 9}, "9"),
        ({"jacobian": np.nan}, "1"),
        ({"residual": np.inf}, "row 3"),
    ],
)
def test_refusals(change, named, refused):
    jacobian = np.random.default_rng(18).standard_normal((10, 2))
    residual = np.ones(10)
    names = change.get("names", ("a", "b"))
    candidates = [
        Candidate(names[0], np.ones(10), 1),
        Candidate(names[1], np.ones(change.get("rows", 10)), 1),
    ]
    jacobian[4, 1] = change.get("jacobian", 1.0)
    residual[3] = change.get("residual", 1.0)
    with refused(named):
        screen(residual, jacobian, candidates)


def test_refused_descriptions(refused):
    with refused("candidate a", 2):
        Candidate("a", np.ones(3), 2)
    with refused("candidate a"):
        Candidate("a", np.ones((3, 0)), 1)
    with refused("level", 0.7):
        ScreenOptions(level=0.7)
    with refused("n_bootstrap"):
        ScreenOptions(n_bootstrap=100)
    many = np.random.default_rng(19).standard_normal((30, 13))
    with refused("13"):
        screen(np.ones(30), many, [], at_bound=np.full(13, -1))


def test_scores_in_noise_of_an_uncertain_level_follow_students_t(points, jacobian, candidates):
    rng, freedom = np.random.default_rng(6), 16
    options = ScreenOptions(noise_freedom=freedom)
    estimated, exact = (prepare_screen(jacobian, candidates, options=o) for o in (options, ScreenOptions()))
    residuals = rng.standard_normal((DRAWS, len(points)))
    residuals /= np.sqrt(rng.chisquare(freedom, (DRAWS, 1)) / freedom)
    raw = estimated.p_values(residuals).raw
    # One candidate of one direction and both signs: its score has exactly the law of t.
    alone = next(i for i, c in enumerate(candidates) if c.sign == 0 and c.directions.shape[1] == 1)
    z = np.array([exact.screen(r).candidates[alone].z for r in residuals[:20]])
    np.testing.assert_allclose(raw[:20, alone], 2 * stats.t.sf(np.abs(z), freedom), rtol=1e-6)
    called, taken_as_exact = calls(estimated, residuals), calls(exact, residuals)
    assert called <= stats.binom.ppf(0.999, DRAWS, options.level)
    assert taken_as_exact > called
    found, before = (test.screen(residuals[0]).candidates[alone].critical_z for test in (estimated, exact))
    assert stats.t.sf(found, freedom) == pytest.approx(stats.norm.sf(before), rel=1e-6)
