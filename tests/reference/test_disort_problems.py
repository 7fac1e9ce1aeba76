"""Test problems 1 to 5 and 9 of DISORT to 89 degrees, at the sizes chosen for an accuracy."""

import numpy as np
import pytest

from benchmarks.validation.accuracy.disort_problems import (
    column,
    is_transmission,
    radiances,
    read_problems,
    stack_of,
)
from jaxink.solver.resolution import choose_sizes

PROBLEMS = read_problems()
# The printed values of problems 3 to 5 are outputs of 16 to 48 streams.
PUBLISHED = 0.012
# Less than this share of the light comes through problem 1d: 32 optical thicknesses, of albedo 0.2.
DARK, DARK_ACCURACY = 1e-12, 1e-4


@pytest.mark.parametrize("accuracy", [1e-4, 1e-6])
@pytest.mark.parametrize("name", PROBLEMS)
def test_problem(name, accuracy):
    rows = PROBLEMS[name]
    found, converged = radiances(rows, choose_sizes(stack_of(rows), accuracy)), column(rows, "converged")
    assert np.all(found > 0)
    allowed = np.where(converged < DARK, DARK_ACCURACY, accuracy) + 5 * column(rows, "change")
    np.testing.assert_array_less(np.abs(found / converged - 1), allowed)
    printed = [k for k, row in enumerate(rows) if row["published"]]
    rows = [rows[k] for k in printed]
    radiance = found[printed] * column(rows, "irradiance")
    np.testing.assert_allclose(radiance, column(rows, "published"), rtol=PUBLISHED)


@pytest.mark.parametrize("accuracy", [1e-4, 1e-6])
@pytest.mark.parametrize("name", ["3b", "4a", "5a"])
def test_a_beam_along_the_normal_looks_the_same_from_all_azimuths(name, accuracy):
    once = [row for row in PROBLEMS[name] if row["phi_deg"] == "0"]
    rows = [row | {"phi_deg": azimuth} for azimuth in ("0", "77", "180") for row in once]
    first, *others = np.split(radiances(rows, choose_sizes(stack_of(rows), accuracy)), 3)
    for other in others:
        np.testing.assert_allclose(other, first, rtol=1e-9)


def test_all_problems_of_light_that_leaves_are_there():
    assert list(PROBLEMS) == [
        *("1a", "1b", "1c", "1d", "1e", "1f", "2a", "2b", "2c", "2d"),
        *("3a", "3b", "4a", "4b", "4c", "5a", "9a", "9b"),
    ]
    for rows in PROBLEMS.values():
        assert set(is_transmission(rows)) == {False, True}
        assert np.min(column(rows, "mu")) < np.cos(np.deg2rad(88.9))
        assert sum(bool(row["published"]) for row in rows) >= 4
