"""Gradient against simplex: the same minimum with fewer calls, and one of many minima."""

import pytest


@pytest.mark.slow
def test_gradient_and_simplex(run):
    names = run("gradient_and_simplex")
    assert names["mean_calls"]["simplex"] > 5 * names["mean_calls"]["gradient"]
    lowest = min(result.merit.chi_square for result in names["mie"].values())
    assert names["mie"]["gradient"].merit.chi_square < lowest + 0.1
    for results in names["fits"].values():
        for result in results:
            assert result.searches[0].path.loss[-1] == pytest.approx(result.merit.chi_square, abs=1e-3)
    assert [step for step, _ in names["scanned"]] == list(range(1, len(names["scanned"]) + 1))
