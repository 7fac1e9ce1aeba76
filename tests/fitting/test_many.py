"""Searches that run at once end where each ends alone."""

import numpy as np
import pytest

import jaxink
from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.gradient import Descent, starts
from jaxink.fitting.inputs import prepare_data
from jaxink.fitting.limits import SearchLimits
from jaxink.fitting.many import searches_at_once, searches_of_sheets
from jaxink.fitting.method import search
from jaxink.fitting.outcome import Outcome
from jaxink.numerics.precision import computing


@pytest.fixture(scope="module")
def compiled(inputs, coarse):
    data, sample = inputs
    with computing():
        return CompiledObjective(
            jaxink.fitting.make_objective(prepare_data(data, sample), sample, config=coarse)
        )


def test_searches_at_once_are_those_made_alone(compiled):
    points = starts(np.array([0.5, 0.1, 0.2]), 5, seed=3)
    told = []
    with computing():
        alone = [search(Descent(), compiled, start) for start in points]
        # The second run has two starts, and repeats them.
        together = searches_at_once(compiled, points, 3, progress=lambda *said: told.append(said))
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_allclose(other.unit, one.unit, rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(other.predicted, one.predicted, rtol=1e-8)
        np.testing.assert_allclose(
            other.triangle.T @ other.triangle, one.triangle.T @ one.triangle, rtol=1e-6, atol=1e-6
        )
        assert other.loss == pytest.approx(one.loss, rel=1e-8)
        assert other.loss_start == pytest.approx(one.loss_start, rel=1e-8)
        assert (other.outcome, other.jacobians) == (one.outcome, one.jacobians)
    assert [count for count, _ in told] == [3, 5]
    assert told[-1][1] == min(one.loss for one in together)


def test_sheets_of_one_structure_are_searched_at_once(inputs, coarse):
    data, sample = inputs
    samples = [sample, sample.replace({"plate.thickness_mm": 2.5}), sample]
    factors = [1.0, 0.9, 1.1]
    with computing():
        sheets = []
        for one, factor in zip(samples, factors, strict=True):
            read = prepare_data(data, one)
            read = read.replace(bsdf_per_sr=factor * read.bsdf_per_sr)
            sheets.append(CompiledObjective(jaxink.fitting.make_objective(read, one, config=coarse)))
        points = starts(np.array([0.5, 0.1, 0.2]), 3, seed=5)
        alone = [search(Descent(), one, start) for one, start in zip(sheets, points, strict=True)]
        together = searches_of_sheets(sheets, points, 2)
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_allclose(other.unit, one.unit, rtol=1e-8, atol=1e-8)
        assert other.loss == pytest.approx(one.loss, rel=1e-8)
        assert (other.outcome, other.jacobians) == (one.outcome, one.jacobians)
    assert len({round(one.loss, 3) for one in together}) == 3


def test_unlike_sheets_are_refused(inputs, coarse, compiled):
    data, sample = inputs
    fewer = data.select(side="T")
    with computing():
        other = CompiledObjective(
            jaxink.fitting.make_objective(prepare_data(fewer, sample), sample, config=coarse)
        )
        with pytest.raises(ValueError, match="no program in common"):
            searches_of_sheets([compiled, other], [np.full(3, 0.5)] * 2, 2)


def test_each_search_has_its_limit_of_steps(compiled):
    points = starts(np.array([0.5, 0.1, 0.2]), 3, seed=4)
    with computing():
        alone = [search(Descent(), compiled, start, own=SearchLimits(steps=3)) for start in points]
        together = searches_at_once(compiled, points, 3, most_steps=3)
    assert {one.outcome for one in together} == {Outcome.MAX_STEPS}
    assert [one.jacobians for one in together] == [3, 3, 3]
    assert [one.loss for one in together] == pytest.approx([one.loss for one in alone], rel=1e-8)


def test_a_fit_from_starts_is_the_same_at_once(inputs, coarse, monkeypatch):
    options = jaxink.FitOptions(config=coarse, profile="none", starts=6)
    alone = jaxink.fit(*inputs, options)
    monkeypatch.setattr("jaxink.fitting.multistart._at_once", lambda *_: 3)
    together = jaxink.fit(*inputs, options)
    assert together.merit.chi_square == pytest.approx(alone.merit.chi_square, rel=1e-9)
    assert together.values == pytest.approx(alone.values, rel=1e-6)
    assert together.minima.starts == alone.minima.starts == 6
    assert together.minima.found[0].starts >= 1
    assert len(together.searches) >= 6


@pytest.mark.parametrize(
    ("options", "n_random", "backend", "expected"),
    [
        ({}, 20, "cpu", None),
        ({}, 5000, "cpu", None),
        ({}, 20, "gpu", 20),
        ({}, 5000, "gpu", 1024),
        ({"max_evaluations": 1000}, 5000, "gpu", None),
        ({"goal": 2.0}, 5000, "gpu", None),
        ({"method": "trf"}, 5000, "gpu", None),
    ],
)
def test_when_searches_run_at_once(inputs, coarse, monkeypatch, options, n_random, backend, expected):
    from jaxink.fitting import multistart

    data, sample = inputs
    objective = jaxink.fitting.make_objective(prepare_data(data, sample), sample, config=coarse)
    monkeypatch.setattr("jax.default_backend", lambda: backend)
    assert multistart._at_once(objective, jaxink.FitOptions(**options), n_random) == expected
