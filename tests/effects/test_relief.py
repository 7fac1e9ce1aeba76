"""The relief of an opaque ink in a sample file, in the model and in the catalogue."""

import dataclasses

import numpy as np
import pytest

from jaxink.effects import AugmentedModel, Case, Scene
from jaxink.effects.surfaces import Relief
from jaxink.errors import InputRefusedError
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.sample import parse_sample
from jaxink.solver.config import SolverConfig
from tests.samples import PRINTED_INK

SIZES = SolverConfig(16, 8, 16, 12)
OPAQUE = """
schema_version = 1
wavelength_nm = [500, 600]

[[layers]]
name = "body"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.3
thickness_um = "opaque"
single_scattering_albedo = { per_wavelength = true, value = [0.999, 0.9] }
asymmetry_parameter = 0.3
"""
DECLARED = (
    OPAQUE + "\n[effects.relief]\nslope_variance = { free = true, value = 0.0, min = 0.0, max = 0.5 }\n"
)


@pytest.fixture(scope="module")
def scene():
    """Both azimuths, in and out of plane, at two wavelengths; no specular direction."""
    theta_i = np.repeat([20.0, 60.0], 8)
    theta_o = np.tile([0.0, 30.0, 50.0, 70.0], 4)
    phi = np.tile([0.0, 60.0, 300.0, 180.0], 4)
    return Scene.of(theta_i, theta_o, phi, np.tile([500.0, 600.0], 8), np.zeros(16, bool), np.arange(16))


def predicted(scene, variance):
    text = DECLARED.replace("value = 0.0,", f"value = {variance},")
    return evaluate(AugmentedModel(parse_sample(text), (), scene, SIZES))


def test_declared_flat_it_is_the_plane_sample(scene):
    points = (scene.theta_i_deg, scene.theta_o_deg, scene.phi_deg, scene.wavelength_nm, scene.is_transmission)
    plane = evaluate(ForwardModel(parse_sample(OPAQUE), *points, SIZES))
    np.testing.assert_allclose(predicted(scene, 0.0), plane, rtol=1e-6)
    # Facets mirror light towards the only points near the specular direction; the darker ink shows it most.
    change = predicted(scene, 0.1) / plane - 1
    near = (scene.theta_i_deg == 60) & (scene.theta_o_deg == 70)
    assert np.all(change[near] > 1.0)
    assert np.all(np.abs(change[~near]) < 0.2)
    assert np.any(np.abs(change[~near]) > 0.05)


def test_it_is_mirror_symmetric(scene):
    mirrored = dataclasses.replace(scene, phi_deg=np.mod(360 - scene.phi_deg, 360))
    np.testing.assert_allclose(predicted(scene, 0.1), predicted(mirrored, 0.1), rtol=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        PRINTED_INK,
        OPAQUE + '\n[layers.front_roughness]\ndensity = "ggx"\nsigma_deg = 5\n',
        OPAQUE + "\n[instrument]\nsource_half_angle_deg = 0.5\ndetector_half_angle_deg = 0.5\n",
    ],
)
def test_samples_that_it_does_not_suit(text, scene):
    sample = parse_sample(text)
    assert isinstance(Relief.forms(Case(sample, scene)), str)
    with pytest.raises(InputRefusedError, match=r"effects\.relief"):
        Relief.of_sample(sample)
    assert Relief.forms(Case(parse_sample(OPAQUE), scene)) == (Relief(),)
