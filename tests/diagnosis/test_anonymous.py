"""Smooth descriptions of a residual that name no cause."""

import numpy as np
import pytest

from jaxink.diagnosis import Points, Projection
from jaxink.diagnosis.findings.assembly import best_anonymous
from jaxink.residual import ResidualPoints

SIGMA = 0.01


def best(change):
    """Best description of a relative change, with noise, in the plane of incidence on both sides."""
    axes = [0.0, 20.0, 40.0, 60.0], np.arange(-80.0, 81.0, 5.0), [False, True]
    theta_i, signed, side = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    columns = theta_i, np.abs(signed), np.where(signed < 0, 0.0, 180.0), np.full(signed.size, 550.0), side
    scan = (theta_i / 20 + 4 * side).astype(int)
    noise = SIGMA * np.random.default_rng(8).standard_normal(signed.size)
    relative = change(*np.deg2rad(columns[:2]), side) + noise
    ones = np.ones(signed.size)
    residual = ResidualPoints(*columns, scan, relative, SIGMA * ones, 0.0, relative / SIGMA, ones)
    points = Points(scan, *columns, np.arange(float(signed.size)))
    return best_anonymous(residual, points, Projection(np.full((signed.size, 1), signed.size**-0.5)))


@pytest.mark.parametrize(
    ("change", "variable"),
    [
        (lambda _, o, __: -0.1 * np.sin(o) ** 6, "the angle of view"),
        (lambda _, o, side: np.where(side, 0.0, -0.1 * np.sin(o) ** 6), "the angle of view on side R"),
        (lambda i, _, __: -0.05 / np.cos(i), "the angle of incidence"),
        (
            lambda i, o, side: np.where(side, 0.2 * (np.sin(i) * np.sin(o)) ** 2, 0.0),
            "incidence and view on side T",
        ),
    ],
)
def test_what_a_change_depends_on_is_found(change, variable):
    found = best(change)
    assert found.variable.endswith(variable)
    assert found.penalised(264) > 50


def test_noise_is_not_worth_its_amplitudes():
    assert best(lambda i, _, __: 0 * i).penalised(264) < 0
