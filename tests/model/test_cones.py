"""Averages over the cones of source and detector."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.model.forward import ForwardModel, evaluate
from jaxink.model.instrument import Cones, cone_rays
from jaxink.sample import parse_sample
from jaxink.solver.bsdf import regular_power
from jaxink.solver.config import SolverConfig

SMALL = SolverConfig(8, 6, 16, 4)
SAMPLE = parse_sample(
    """
    schema_version = 1
    [[layers]]
    name = "plate"
    kind = "clear"
    refractive_index = 1.5
    thickness_mm = 1
    [[layers]]
    name = "ink"
    kind = "scattering"
    phase_function = "henyey_greenstein"
    refractive_index = 1.5
    thickness_um = 20
    scattering_per_mm = 60
    absorption_per_mm = 1
    asymmetry_parameter = 0.6
    """
)


def predicted(points, source_deg=0.0, detector_deg=0.0):
    """BSDF at rows of (theta_i, theta_o, phi, is_transmission)."""
    sample = dataclasses.replace(
        SAMPLE, source_half_angle_deg=source_deg, detector_half_angle_deg=detector_deg
    )
    theta_i, theta_o, phi, side = np.array(points, float).T
    return evaluate(
        ForwardModel(sample, theta_i, theta_o, phi, np.full(len(points), 550.0), side > 0.5, SMALL)
    )


AWAY_FROM_PEAKS = [(0, 40, 0, 0), (30, 60, 0, 0), (30, 10, 90, 1), (50, 20, 180, 1)]


def test_a_small_cone_changes_as_the_square_of_its_angle():
    ideal = predicted(AWAY_FROM_PEAKS)
    change = [np.abs(predicted(AWAY_FROM_PEAKS, a, a) - ideal) for a in (1.0, 2.0)]
    assert np.all(change[1] < 0.01 * ideal)
    assert change[1].sum() / change[0].sum() == pytest.approx(4, rel=0.1)


def test_weights_average_and_leave_out_what_is_below_the_horizon():
    rays = cone_rays(Cones(1.0, 3.0), [0.0, 80.0], [10.0, 88.5], [0.0, 180.0], [False, False])
    assert rays.weights.sum(axis=1) == pytest.approx(1)
    assert np.any(rays.weights[1] == 0)
    assert np.asarray(rays.average(jnp.ones(rays.weights.size))) == pytest.approx(1)


@pytest.mark.parametrize(("source", "detector"), [(0.0, 2.0), (1.0, 0.0), (1.0, 2.0), (2.0, 2.0)])
@pytest.mark.parametrize("side", [0, 1])
def test_the_peak_holds_the_regular_power(source, detector, side):
    """Sum of peak times cosine over the solid angle is the regular reflectance or transmittance."""
    theta_i, reach = 20.0, source + detector + 0.5
    x = np.linspace(-reach, reach, 61)
    tilt, turn = (a.ravel() for a in np.meshgrid(x, x))
    # Directions around the peak by two small angles.
    theta = np.deg2rad(theta_i + tilt)
    vector = np.stack([np.sin(theta), np.sin(np.deg2rad(turn)), np.cos(theta)])
    vector = vector / np.linalg.norm(vector, axis=0)
    theta_o = np.rad2deg(np.arccos(vector[2]))
    phi = 180 - np.rad2deg(np.arctan2(vector[1], vector[0]))
    rays = cone_rays(
        Cones(source, detector), np.full(theta_o.size, theta_i), theta_o, phi, np.full(phi.size, side)
    )
    solid_angle = np.deg2rad(x[1] - x[0]) ** 2
    power = np.sum(rays.regular_share * np.cos(np.deg2rad(theta_o))) * solid_angle
    assert power == pytest.approx(1, rel=0.03)


def test_only_points_within_reach_see_the_peak():
    points = [(20, 20, 180, 0), (20, 24, 180, 0), (20, 20, 0, 0), (20, 20, 180, 1)]
    peak = predicted(points, 0.5, 1.0) - predicted(points)
    sample = dataclasses.replace(SAMPLE, source_half_angle_deg=0.5, detector_half_angle_deg=1.0)
    model = ForwardModel(sample, [20.0], [20.0], [180.0], [550.0], [False], SMALL)
    values = {name: jnp.asarray(v, float) for name, v in sample.parameters.values_with({}).items()}
    reflected, transmitted = regular_power(model.builder.stack(values, 550.0), np.sin(np.deg2rad([20.0])))
    whole = 1 / (np.pi * np.sin(np.deg2rad(1.0)) ** 2 * np.cos(np.deg2rad(20)))
    assert peak[0] == pytest.approx(float(reflected[0]) * whole, rel=0.01)
    assert peak[3] == pytest.approx(float(transmitted[0]) * whole, rel=0.01)
    assert np.abs(peak[1:3]).max() < 1e-3


def test_cones_between_different_surroundings_are_refused(refused):
    table = SAMPLE.parameters.replace("surroundings.index_back", value=1.33)
    sample = dataclasses.replace(SAMPLE, parameters=table, detector_half_angle_deg=1.0)
    with refused():
        ForwardModel(sample, [0.0], [10.0], [0.0], [550.0], [False])
