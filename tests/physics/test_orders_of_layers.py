"""Samples as they come: every order of plates, inks, coats and gaps keeps energy and is reciprocal."""

import equinox as eqx
import numpy as np
import pytest

from jaxink.optics.layers import OPAQUE_OPTICAL_THICKNESS, ClearLayer
from jaxink.solver.config import SolverConfig
from jaxink.solver.plan import plan_channels
from jaxink.solver.solve import solve_stack
from jaxink.solver.stack import Stack
from jaxink.surfaces.slopes import slope_density
from tests.physics.probe import ink

SMALL = SolverConfig(10, 8, 16, 6)
PLATE, GAP, PRIMER, COAT = (ClearLayer(n, 0.0) for n in (1.49, 1.0, 1.6, 1.42))
GREY = ClearLayer(1.49, 0.2)
WHITE, THIN = ink(1.52, 2.0, 1.0, 0.4), ink(1.5, 0.5, 1.0, -0.2)
DEEP = ink(1.52, OPAQUE_OPTICAL_THICKNESS, 1.0, 0.4)

ORDERS = {
    "without a plate": (WHITE,),
    "on the exit face": (PLATE, WHITE),
    "on the entry face": (WHITE, PLATE),
    "on both faces": (WHITE, PLATE, THIN),
    "opaque": (PLATE, DEEP),
    "opaque, without a plate": (DEEP,),
    "absorbing plate": (GREY, WHITE),
    "absorbing plate, lit from the ink": (WHITE, GREY),
    "primer": (PLATE, PRIMER, WHITE),
    "air gap": (PLATE, GAP, WHITE),
    "top coat": (PLATE, WHITE, COAT),
    "plates with air gaps": (PLATE, GAP, PLATE, WHITE),
    "rough plate": (PLATE, WHITE),
    "plate rough on both sides": (PLATE, WHITE),
}


def stack_of(name: str) -> Stack:
    """Stack of an order, in air."""
    layers = ORDERS[name]
    facets = slope_density("beckmann", 12.0)
    faces = {"rough plate": (facets, None, None), "plate rough on both sides": (facets, facets, None)}
    return Stack(layers, 1.0, 1.0, faces.get(name, ()))


@eqx.filter_jit
def light_of(stack, plan):
    """Total power of each channel, and smooth multiple scattering between channels, in reflection."""
    channels, response = solve_stack(stack, plan, SMALL, plan.grid(stack, SMALL).kappa)
    fields, escape = channels.fields_beyond, channels.escape_beyond[0]
    reflectance = fields.reflection + escape * response.reflected_power
    return reflectance, fields.transmission + escape * response.transmitted_power, response.reflection


@pytest.mark.parametrize("name", ORDERS)
def test_energy_and_reciprocity(name):
    stack, is_rough = stack_of(name), "rough" in name
    plan = plan_channels(stack)
    outside = np.asarray(plan.grid(stack, SMALL).kappa) < 1
    reflectance, transmittance, between = (np.asarray(x) for x in light_of(stack, plan))
    reflectance, transmittance = reflectance[outside], transmittance[outside]
    total = reflectance + transmittance
    if "absorbing" in name:
        assert np.all((total > 0.3) & (total < 0.99))
        assert np.mean(total) < 0.9
    elif "opaque" in name:
        # 1 / optical thickness of light still finds its way through.
        np.testing.assert_allclose(total, 1.0, atol=1e-5)
        assert np.all(np.abs(transmittance) < 1e-6)
    else:
        np.testing.assert_allclose(total, 1.0, atol=1e-8 if is_rough else 1e-10)
    if is_rough:
        # Reciprocal as far as the channels resolve its facets: the BSDF to 0.5 % at these sizes.
        return
    # Light scattered once is reciprocal by its formula.
    between = between[:, outside][:, :, outside]
    there, back_again = between, np.swapaxes(between, 1, 2)
    np.testing.assert_allclose(there, back_again, atol=1e-8 * np.max(np.abs(between)))
    assert np.all(between[0] > 0)
