"""The comparison of methods: intervals, what it says of its starts, and its problems as plain functions."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.optimisers.adapters import fitbenchmarking_problem, optimagic_problems
from benchmarks.optimisers.judgement import share_words, wilson
from benchmarks.optimisers.kept import RESULTS, kept
from benchmarks.optimisers.page import starts_sentence
from benchmarks.optimisers.plain import plain_problem

PAGE = Path(__file__).parents[2] / "docs" / "validation" / "optimisers.md"


@pytest.mark.parametrize(
    ("reached", "of", "interval"),
    # Newcombe 1998 Stat. Med. 17, 857, table I, score method without continuity correction.
    [
        (81, 263, (0.2553, 0.3662)),
        (15, 148, (0.0624, 0.1605)),
        (0, 20, (0.0, 0.1611)),
        (1, 29, (0.0061, 0.1718)),
    ],
)
def test_intervals_are_the_published_ones(reached, of, interval):
    assert wilson(reached, of) == pytest.approx(interval, abs=5e-5)


def test_an_interval_follows_its_share():
    assert share_words(20, 20) == "20 of 20 (84-100 %)"


def test_the_page_says_from_how_many_starts_the_files_say():
    names = [file.stem for file in sorted(RESULTS.glob("*.jsonl"))]
    assert len(names) == 19
    # Its problems are in another order.
    listed = [name for name in dict.fromkeys(part for part in PAGE.read_text().split("`")) if name in names]
    sentence = starts_sentence({name: kept(name) for name in listed})
    assert " ".join(sentence.split()) in " ".join(PAGE.read_text(encoding="utf-8").split())


@pytest.fixture(scope="module")
def plain():
    return plain_problem("plain_hg")


def test_a_plain_problem_has_its_derivatives_and_its_best_minimum(plain):
    best, middle = plain.best, np.full(3, 0.5)
    assert np.sum(plain.residual(best.unit) ** 2) == pytest.approx(best.loss, rel=1e-7)
    assert len(plain.starts) == 20
    assert all(np.all((plain.lower <= start) & (start <= plain.upper)) for start in plain.starts)
    step = 1e-6 * np.eye(3)
    differences = [(plain.residual(middle + one) - plain.residual(middle - one)) / 2e-6 for one in step]
    slopes = plain.jacobian(middle)
    np.testing.assert_allclose(np.transpose(differences), slopes, atol=1e-6 * np.max(np.abs(slopes)))


def test_optimagic_solves_them(plain):
    om = pytest.importorskip("optimagic")
    problems = optimagic_problems(plain, range(2))
    assert list(problems) == ["plain_hg-0", "plain_hg-1"]
    one = problems["plain_hg-0"]
    found = om.minimize(algorithm="scipy_ls_trf", **one["inputs"])
    assert float(found.fun) == pytest.approx(one["solution"]["value"], rel=1e-6)
    assert np.asarray(found.params) == pytest.approx(one["solution"]["params"], abs=1e-3)


def test_fitbenchmarking_takes_them(plain):
    pytest.importorskip("fitbenchmarking")
    made = fitbenchmarking_problem(plain)
    assert made.value_ranges == [(0.0, 1.0)] * 3
    assert len(made.starting_values) == 20
    start = plain.starts[0]
    assert made.eval_model(start) == pytest.approx(plain.residual(start))
    assert made.jacobian(made.data_x, start) == pytest.approx(plain.jacobian(start))
