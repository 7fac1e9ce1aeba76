"""Variables between 0 and 1 for parameters between their bounds."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.fitting.scaling import UnitScale
from jaxink.sample import Parameter

PARAMETERS = (
    Parameter("even", 1.5, True, 1.4, 1.6),
    Parameter("log", 50.0, True, 1.0, 1000.0, scale="log"),
    Parameter("log_from_zero", 0.5, True, 0.0, 50.0, scale="log"),
    Parameter("asymmetry", 0.5, True, -0.9, 0.95, scale="one_minus"),
    Parameter("albedo", 0.9, True, 0.0, 1.0, scale="one_minus"),
    Parameter("narrow", 220.0, True, 200.0, 240.0, scale="log"),
)


@pytest.fixture(scope="module")
def scale():
    return UnitScale.of(PARAMETERS)


def test_ends_are_the_bounds(scale):
    assert scale.to_physical(jnp.zeros(6)) == pytest.approx([p.minimum for p in PARAMETERS], abs=1e-12)
    assert scale.to_physical(jnp.ones(6)) == pytest.approx([p.maximum for p in PARAMETERS], abs=1e-12)


def test_round_trip_is_exact(scale):
    unit = np.random.default_rng(1).uniform(size=6)
    assert scale.to_unit(np.asarray(scale.to_physical(jnp.asarray(unit)))) == pytest.approx(unit, rel=1e-12)


@pytest.mark.parametrize("at", [0.0, 0.3, 1.0])
def test_slope_is_the_derivative_positive_and_finite_to_the_very_ends(scale, at):
    unit = jnp.full(6, at)
    derivative = np.diag(jax.jacfwd(scale.to_physical)(unit))
    assert scale.slope(np.asarray(unit)) == pytest.approx(derivative, rel=1e-12)
    assert np.all(derivative > 0)


def test_reduced_scattering_is_a_straight_line():
    scattering = Parameter("scattering", 50.0, True, 5.0, 400.0, scale="log")
    scale = UnitScale.of((scattering, PARAMETERS[3]))
    scattering = np.array([10.0, 40.0, 160.0])
    points = np.array([scale.to_unit(np.array([s, 1 - 5.0 / s])) for s in scattering])
    first, second = np.diff(points, axis=0)
    assert first == pytest.approx(second, rel=1e-12)
