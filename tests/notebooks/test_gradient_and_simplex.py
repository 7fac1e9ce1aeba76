"""Gradient against simplex: the same minimum with fewer calls, and one of many minima."""

import pytest


@pytest.mark.slow
def test_gradient_and_simplex(run):
    names = run("gradient_and_simplex")
    assert names["calls"]["simplex"] > 5 * names["calls"]["gradient"]
    assert names["gradient"].merit.chi_square < names["simplex"].merit.chi_square + 0.1
    for fits in names["fits"].values():
        for result, follower in fits:
            assert follower.first_search()[1][-1] == pytest.approx(result.merit.chi_square, abs=0.1)
