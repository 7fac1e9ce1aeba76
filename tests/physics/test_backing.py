"""A diffuse reflector behind the sample: R = Rs + T rho T' / (1 - rho Rs'), energy, simulated data."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.ink.stacks import reversed_stack
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.numerics.quadrature import gauss_legendre_unit
from jaxink.optics.directions import Directions
from jaxink.optics.layers import ClearLayer
from jaxink.sample import parse_sample
from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power, regular_power
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import plan_channels
from jaxink.solver.stack import Stack
from jaxink.surfaces.slopes import slope_density
from tests.physics.probe import ink, printed
from tests.physics.simulated import simulated
from tests.samples import PLATE_AND_INK

SMALL = SolverConfig(10, 8, 16, 6)
REFLECTANCE = 0.7
ROUGH = Stack(
    (ClearLayer(1.5, 0.0), ink(1.5, albedo=1.0)),
    1.0,
    1.0,
    faces=(None, None, slope_density("beckmann", 10.0)),
)


def with_backing(stack, reflectance=REFLECTANCE):
    return dataclasses.replace(stack, backing=jnp.asarray(reflectance))


def powers_of_channels(stack):
    """Reflectance and transmittance of every channel that the front has, and their weights."""
    grid = plan_channels(stack).grid(stack, SMALL)
    inside = np.asarray(grid.kappa) < float(stack.index_front)
    sines = grid.kappa[inside] / stack.index_front
    powers = (np.asarray(power) for power in hemispherical_power(stack, sines, SMALL))
    return *powers, np.asarray(grid.etendue_weight)[inside] / float(stack.index_front) ** 2


def test_plate_that_only_absorbs():
    plate = printed(ink(1.5, 0.2, albedo=0.0), 1.5, plate_thickness=0.1)
    node, weight = gauss_legendre_unit(200)
    reflected, transmitted = regular_power(plate, np.sqrt(1 - node**2))
    from_behind = [float(np.sum(2 * node * weight * power)) for power in (reflected, transmitted)]
    a, b = np.deg2rad([0.0, 35.0, 70.0]), np.deg2rad([20.0, 50.0, 80.0])
    through_in, through_out = (np.asarray(regular_power(plate, np.sin(x))[1]) for x in (a, b))
    gain = REFLECTANCE / (1 - REFLECTANCE * from_behind[0])
    points = Directions.from_degrees(np.rad2deg(a), np.rad2deg(b), [0.0, 90.0, 180.0], [False] * 3)
    found = diffuse_bsdf(with_backing(plate), points, SolverConfig(24, 16, 16, 6))
    np.testing.assert_allclose(found, through_in * through_out * gain / np.pi, rtol=2e-6)


def test_reflectance_from_what_the_stack_does_alone():
    stack = printed(ink(), 1.6)
    reflected, transmitted, _ = powers_of_channels(stack)
    behind, returned, share = powers_of_channels(reversed_stack(stack))
    mean_behind, mean_returned = (2 * np.sum(share * power) for power in (behind, returned))
    expected = reflected + transmitted * REFLECTANCE * mean_returned / (1 - REFLECTANCE * mean_behind)
    backed, alone, _ = powers_of_channels(with_backing(stack))
    np.testing.assert_allclose(backed, expected, rtol=1e-9)
    np.testing.assert_allclose(alone, transmitted, rtol=1e-14)


@pytest.mark.parametrize(
    ("stack", "tolerance"),
    [
        (printed(ink(albedo=1.0), 1.6), 1e-10),
        # In optical contact: the medium behind is that of the last layer.
        (Stack((ink(1.5, albedo=1.0),), 1.0, 1.5), 1e-10),
        # A rough interface keeps the power of every channel, but is reciprocal to 3e-6 only at these sizes.
        (ROUGH, 1e-5),
    ],
    ids=["plate", "contact", "rough"],
)
def test_white_backing_sends_everything_back(stack, tolerance):
    reflected, _, _ = powers_of_channels(with_backing(stack, 1.0))
    np.testing.assert_allclose(reflected, 1.0, atol=tolerance)


BACKING = "[backing]\nreflectance = {albedo}\n"


def test_simulated_measurement_with_a_backing_in_reflection_only(shared_data):
    truth, numbers, angles, side = simulated(shared_data, "undeclared_backing")
    sample = parse_sample((PLATE_AND_INK + BACKING).format(**numbers, **truth["effects"]["E5"]))
    model = ForwardModel(sample, *angles, [550.0] * len(side), side)
    deviation = (evaluate(model) - truth["noise_free"]) / truth["monte_carlo_se"]
    for seen in (side, ~side):
        assert np.max(np.abs(deviation[seen])) < 3
        assert np.mean(deviation[seen] ** 2) < 1.5


def test_model_of_a_sample_file(refused):
    angles = ([30.0, 30.0], [50.0, 40.0], [0.0, 180.0], [550.0, 550.0])
    numbers = {"d_mm": 0.05, "mus": 80.0, "mua": 0.5, "g": 0.5, "albedo": 0.6}
    alone, in_air, touching = (
        parse_sample((PLATE_AND_INK + more).format(**numbers))
        for more in ("", BACKING, BACKING + "contact = true\n")
    )
    bare = evaluate(ForwardModel(alone, *angles, [False, True], SMALL))
    backed = evaluate(ForwardModel(in_air, *angles, [False, True], SMALL))
    assert backed[1] == pytest.approx(bare[1], rel=1e-12)
    assert backed[0] > 1.05 * bare[0]
    with refused("backing"):
        ForwardModel(touching, *angles, [False, True], SMALL)
    # The last face reflects most diffuse light totally, unless the backing touches it.
    assert evaluate(ForwardModel(touching, *angles, [False, False], SMALL))[0] < 0.9 * backed[0]
