"""All methods on the same objective: the same minimum, limits, goals and paths."""

import dataclasses

import numpy as np
import pytest
from scipy import optimize

import jaxink
from jaxink.fitting import METHODS, Outcome
from jaxink.fitting.scaling import UnitScale

# Ends where its simplex, or its linear model, is small, wherever that is.
ENDS_ANYWHERE = ("cobyla", "optimistix_nelder_mead")
# Take thousands of evaluations.
SLOW = ("differential_evolution",)


@pytest.fixture(scope="module")
def found(inputs, coarse):
    """Fit by a method, once each."""
    kept = {}

    def fit(method, **options):
        key = (method, *options.items())
        if key not in kept:
            chosen = jaxink.FitOptions(method=method, config=coarse, profile="none", **options)
            kept[key] = jaxink.fit(*inputs, chosen)
        return kept[key]

    return fit


@pytest.mark.parametrize("method", [m for m in METHODS if m not in (*SLOW, "gradient")])
def test_every_method_minimises_the_same_objective_from_the_same_start(found, method):
    best, other = found("gradient"), found(method)
    (search,) = other.searches
    assert search.loss_start == pytest.approx(best.searches[0].loss_start, rel=0.01)
    # A search ends when chi-square could fall by no more than 1e-6 per degree of freedom.
    assert search.loss >= best.searches[0].loss * (1 - 1e-5)
    if method not in ENDS_ANYWHERE:
        assert other.converged
        assert search.loss == pytest.approx(best.searches[0].loss, rel=1e-4)
    kind = METHODS[method]
    assert (search.jacobians > 0) == kind.has_jacobian
    for one, same in zip(other.parameters.free, best.parameters.free, strict=True):
        assert (one.standard_error is not None) == kind.has_jacobian
        if kind.has_jacobian:
            assert one.value == pytest.approx(same.value, abs=0.02 * same.standard_error)
            assert one.standard_error == pytest.approx(same.standard_error, rel=0.01)
        assert one.minimum <= one.value <= one.maximum
    if not kind.has_jacobian:
        assert any(kind.title in note for note in other.notes)


@pytest.mark.parametrize("method", SLOW)
def test_a_method_that_needs_many_evaluations_ends_at_a_limit_near_the_minimum(found, method):
    best, other = found("gradient"), found(method)
    assert other.outcome in (Outcome.CONVERGED, Outcome.MAX_EVALUATIONS)
    assert other.searches[0].loss == pytest.approx(best.searches[0].loss, rel=0.1)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_ends_at_the_limit_of_evaluations(found, method):
    result = found(method, max_evaluations=5)
    (search,) = result.searches
    assert result.outcome is Outcome.MAX_EVALUATIONS
    # A compiled step of a simplex counts its evaluations at its end, and a best point is completed.
    assert 5 <= search.evaluations + search.jacobians <= 7
    assert search.loss <= search.loss_start


def test_path_falls_from_the_start_to_the_end(found):
    for method in ("gradient", "simplex"):
        (search,) = found(method).searches
        path = search.path
        assert path.loss[0] == search.loss_start
        assert path.loss[-1] == search.loss
        assert np.all(np.diff(path.loss) < 0)
        assert np.all(np.diff(path.seconds) > 0)
        assert path.seconds[-1] <= search.run_seconds
        assert np.all(np.diff(path.evaluations) + np.diff(path.jacobians) > 0)
        for name, value in search.values.items():
            assert path.values[name][-1] == pytest.approx(value, rel=1e-12)
            assert path.values[name][0] == pytest.approx(search.start[name], rel=1e-12)


def test_limits_of_steps_and_seconds_say_which_option_to_change(found):
    for limits, outcome, option in (
        ({"max_steps": 2}, Outcome.MAX_STEPS, "--max-steps"),
        ({"max_seconds": 1e-6}, Outcome.MAX_SECONDS, "--max-seconds"),
        ({"max_evaluations": 3}, Outcome.MAX_EVALUATIONS, "--max-evaluations"),
    ):
        result = found("gradient", **limits)
        assert result.outcome is outcome
        assert option in result.verdict.sentence
        assert result.verdict.code == "not_converged"
        assert not result.verdict.standard_errors_hold


def test_a_goal_ends_the_search_and_no_minimum_is_claimed(found):
    whole, at_goal = found("gradient"), found("gradient", goal=5.0)
    points = whole.merit.points
    # In standard deviations of the noise, per point.
    assert whole.searches[0].loss < 25 * points
    assert at_goal.searches[0].loss <= 25 * points
    assert at_goal.searches[0].jacobians < whole.searches[0].jacobians
    assert at_goal.outcome is Outcome.GOAL
    assert not at_goal.converged
    assert at_goal.verdict.code == "not_judged"
    assert not at_goal.verdict.standard_errors_hold
    assert at_goal["ink.scattering_per_mm"].standard_error is None


def test_scan_may_precede_any_method_and_shares_its_limits(inputs, coarse):
    data, sample = inputs
    table = sample.parameters.replace("ink.asymmetry_parameter", multimodal=True)
    rugged = dataclasses.replace(sample, parameters=table)

    def methods(**options):
        chosen = jaxink.FitOptions(config=coarse, profile="none", **options)
        return [search.method for search in jaxink.fit(data, rugged, chosen).searches]

    assert methods(method="simplex") == ["simplex"]
    assert methods(method="simplex", scan=True)[-1] == "scan"
    assert methods(scan=False) == ["gradient"]
    limited = jaxink.FitOptions(config=coarse, profile="none", max_evaluations=30)
    result = jaxink.fit(data, rugged, limited)
    assert result.outcome is Outcome.MAX_EVALUATIONS
    assert sum(search.jacobians for search in result.searches) <= 32


@pytest.mark.parametrize(
    "wrong",
    [
        {"method": "newton"},
        {"max_steps": 0},
        {"max_evaluations": -3},
        {"max_seconds": -1.0},
        {"goal": 0.0},
        {"goal": float("inf")},
    ],
)
def test_invalid_options_are_rejected_by_name(wrong, refused):
    with refused(next(iter(wrong))):
        jaxink.FitOptions(**wrong)


def test_the_first_simplex_has_the_steps_that_are_asked_for(inputs, coarse, monkeypatch):
    seen = {}
    search = optimize.minimize

    def spy(loss, start, **given):
        seen.update(given["options"])
        return search(loss, start, **given)

    monkeypatch.setattr(optimize, "minimize", spy)
    # The second step leaves the range at either end: it is taken downwards, to the end.
    steps = {"ink.scattering_per_mm": 10.0, "ink.asymmetry_parameter": 0.95}
    options = jaxink.FitOptions(method="simplex", config=coarse, simplex_steps=steps, max_evaluations=6)
    result = jaxink.fit(*inputs, options)
    free = [p for p in inputs[1].parameters.values() if p.free]
    first, *corners = map(UnitScale.of(tuple(free)).to_physical, seen["initial_simplex"])
    np.testing.assert_allclose(first, [p.value for p in free], rtol=1e-12)
    moved = {p.name: corner[i] - p.value for i, (p, corner) in enumerate(zip(free, corners, strict=True))}
    assert moved["ink.scattering_per_mm"] == pytest.approx(10)
    (asymmetry,) = (p for p in free if p.name == "ink.asymmetry_parameter")
    assert moved[asymmetry.name] == pytest.approx(asymmetry.minimum - asymmetry.value)
    assert moved["ink.absorption_per_mm"] > 0
    assert result.outcome is Outcome.MAX_EVALUATIONS


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"simplex_steps": {"ink.scattering_per_mm": 10.0}}, ("gradient", "simplex")),
        ({"method": "simplex", "simplex_steps": {"ink.scattering_per_mm": 0}}, ("ink.scattering_per_mm",)),
        ({"method": "simplex", "simplex_steps": {"ink.thickness_um": 1}}, ("ink.thickness_um",)),
    ],
    ids=["method", "zero", "name"],
)
def test_bad_steps_are_refused(inputs, coarse, options, named, refused):
    with refused(*named):
        jaxink.fit(*inputs, jaxink.FitOptions(config=coarse, **options))
