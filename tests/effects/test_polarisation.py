"""Polarisation as an effect: declared, in the model and in the catalogue."""

import numpy as np
import pytest

from benchmarks.validation.declared_effects import CONFIG, MIE, TWO_COLOURS, scene_of
from jaxink.effects import AugmentedModel, Case
from jaxink.effects.waves import Polarisation
from jaxink.errors import InputRefusedError
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.numerics.precision import computing
from jaxink.sample import parse_sample

SHARE = "\n[effects.polarisation]\nshare = 1\n"
DENSE = MIE + "structure_factor_weight = 1\n"


@pytest.mark.parametrize("text", [MIE, DENSE])
def test_a_share_of_1_adds_the_excess_of_polarised_light(text):
    columns, scene = scene_of(parse_sample(text))
    scalar = ForwardModel(parse_sample(text), *columns, CONFIG)
    declared = evaluate(AugmentedModel(parse_sample(text + SHARE), (), scene, CONFIG))
    with computing():
        excess = np.asarray(scalar.polarised_excess())
    np.testing.assert_allclose(declared, evaluate(scalar) + excess, rtol=1e-12)
    assert np.max(np.abs(excess / declared)) > 1e-4


def test_without_interference_the_scattering_matrix_is_that_of_single_spheres():
    columns, _ = scene_of(parse_sample(MIE))
    without = DENSE.replace("structure_factor_weight = 1", "structure_factor_weight = 0")
    with computing():
        alone, dense, none = (
            np.asarray(ForwardModel(parse_sample(text), *columns, CONFIG).polarised_excess())
            for text in (MIE, DENSE, without)
        )
    np.testing.assert_allclose(none, alone, rtol=1e-8)
    assert np.max(np.abs(dense / alone - 1)) > 0.05


def test_a_phase_function_without_particles_says_nothing_of_polarisation():
    sample = parse_sample(TWO_COLOURS)
    _, scene = scene_of(sample)
    assert "Mie and Rayleigh" in Polarisation.forms(Case(sample, scene))
    with pytest.raises(InputRefusedError, match=r"effects\.polarisation.*'ink'"):
        Polarisation.of_sample(sample)
