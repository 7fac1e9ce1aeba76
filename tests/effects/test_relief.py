"""The relief of an opaque ink in a sample file, in the model and in the catalogue."""

import dataclasses

import numpy as np
import pytest

from jaxink.effects import AugmentedModel, Case, Scene
from jaxink.effects.instrument import Gain
from jaxink.effects.relief import Relief
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


def predicted(model, **values):
    table = {name.replace("__", "."): value for name, value in values.items()}
    sample = model.sample
    for name, value in table.items():
        sample = dataclasses.replace(sample, parameters=sample.parameters.replace(name, value=value))
    return evaluate(AugmentedModel(sample, (), model.scene, SIZES))


@pytest.fixture(scope="module")
def model(scene):
    return AugmentedModel(parse_sample(DECLARED), (), scene, SIZES)


def test_declared_flat_it_is_the_plane_sample(model, scene):
    points = (scene.theta_i_deg, scene.theta_o_deg, scene.phi_deg, scene.wavelength_nm, scene.is_transmission)
    plane = evaluate(ForwardModel(parse_sample(OPAQUE), *points, SIZES))
    np.testing.assert_allclose(predicted(model), plane, rtol=1e-6)
    rough = predicted(model, relief__slope_variance=0.1)
    assert np.all(np.abs(rough / plane - 1) < 0.8)
    assert np.any(np.abs(rough / plane - 1) > 0.05)


def test_it_is_mirror_symmetric(model, scene):
    mirrored = dataclasses.replace(scene, phi_deg=np.mod(360 - scene.phi_deg, 360))
    found = predicted(model, relief__slope_variance=0.1)
    other = AugmentedModel(model.sample, (), mirrored, SIZES)
    np.testing.assert_allclose(found, predicted(other, relief__slope_variance=0.1), rtol=1e-9)


def test_the_instrument_reads_the_relief(scene):
    text = DECLARED.replace("value = 0.0,", "value = 0.1,")
    plain = evaluate(AugmentedModel(parse_sample(text), (), scene, SIZES))
    wrong = parse_sample(text + "\n[effects.gain]\nrelative = 0.05\n")
    np.testing.assert_allclose(evaluate(AugmentedModel(wrong, (), scene, SIZES)), 1.05 * plain, rtol=1e-9)
    assert Gain.name == "gain"


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
