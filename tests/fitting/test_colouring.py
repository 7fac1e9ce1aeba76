"""Derivatives along shared directions are those by each parameter."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxink.effects import ReadingEffect
from jaxink.effects.augmented import AugmentedModel
from jaxink.effects.scene import Scene
from jaxink.fitting.colouring import Colouring, colours
from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.objective import Objective, compose, make_objective
from jaxink.fitting.scaling import UnitScale
from jaxink.measurement import GonioData, noise_of
from jaxink.numerics.compiling import jit_unoptimised
from jaxink.sample import Parameter, parse_sample
from jaxink.solver.config import SolverConfig

SMALL = SolverConfig(4, 4, 8, 2)
WAVES = (500.0, 550.0, 600.0)
SAMPLE = """
schema_version = 1
wavelength_nm = [500, 550, 600]
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 50
scattering_per_mm = { per_wavelength = true, free = true, value = [50, 60, 70], min = 1, max = 400 }
absorption_per_mm = { per_wavelength = true, free = true, value = [0.5, 1, 2], min = 0.01, max = 40 }
asymmetry_parameter = { free = true, value = 0.5, min = 0, max = 0.9, prior = PRIOR }
[noise]
relative = 0.02
scan_relative = 0.01
""".replace("PRIOR", "{ mean = 0.6, standard_deviation = 0.1 }")


GAIN = "\n[effects.gain]\nrelative = { free = true, value = 0.1, min = -0.5, max = 0.5 }\n"


@pytest.fixture(scope="module")
def data():
    columns = np.meshgrid([0.0, 40.0], [5.0, 30.0, 60.0], WAVES, [False, True], indexing="ij")
    theta_i, theta_o, wave, side = (c.ravel() for c in columns)
    return GonioData(theta_i, theta_o, np.zeros(theta_i.size), wave, side, np.full(theta_i.size, 0.1))


def by_each_parameter(objective, unit):
    return np.asarray(jit_unoptimised(jax.jacfwd(lambda u: objective.residual(u)[0]))(jnp.asarray(unit)))


SMOOTH = SAMPLE.replace("max = 400 }", "max = 400, smoothness = { change = 5, over_nm = 50 } }")


@pytest.mark.parametrize("text", [SAMPLE, SAMPLE + GAIN, SMOOTH])
def test_the_jacobian_is_that_by_each_parameter(data, text):
    sample = parse_sample(text)
    with jax.enable_x64(True):
        objective = make_objective(data, sample, config=SMALL)
        compiled = CompiledObjective(objective)
        unit = np.linspace(0.3, 0.7, len(objective.free))
        expected = by_each_parameter(objective, unit)
        found = compiled.linearised(unit).jacobian
    n_shared = len(objective.free) - 6
    # Neighbouring wavelengths of the smooth quantity share theirs with the other quantity in turn.
    assert compiled.colouring.seeds.shape == (n_shared + 2, len(objective.free))
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10 * np.max(np.abs(expected)))
    assert np.count_nonzero(found[: len(data), 0]) == len(data) // 3


def groups(*of):
    """What affects what, if residuals 0, 1, 2 have a parameter each of their own, or share it (None)."""
    return np.stack([np.ones(3, bool) if group is None else np.arange(3) == group for group in of], axis=1)


def test_parameters_of_one_group_of_residuals_have_different_colours():
    # Of the groups 0 and 1 two parameters each, of the group 2 one; the second affects them all.
    assert colours(groups(0, None, 1, 0, 1, 2)).tolist() == [0, 1, 0, 2, 2, 0]
    assert colours(np.zeros((3, 2), bool)).tolist() == [0, 0]


def test_parameters_that_share_a_residual_have_different_colours():
    """Two parameters of four groups each; those of neighbours share one more residual."""
    own = np.tile(np.eye(4, dtype=bool), 2)
    shared = np.zeros((3, 8), bool)
    for k in range(3):
        shared[k, k : k + 2] = True
    assert colours(np.concatenate([own, shared])).tolist() == [0, 1, 0, 1, 1, 0, 1, 0]


def test_blocks_within_blocks_need_the_colours_of_one_block():
    """Measurements with two wavelengths: parameters of either, of both, and of all."""
    measurement, wavelength = np.divmod(np.arange(6), 2)
    columns = [measurement == m for m in range(3)] + [wavelength == w for w in range(2)]
    columns += [(measurement == m) & (wavelength == w) for m in range(3) for w in range(2)]
    columns.append(np.ones(6, bool))
    assert max(colours(np.stack(columns, axis=1))) + 1 == 4


def test_a_parameter_belongs_to_a_wavelength_of_the_measurement():
    sample = parse_sample(SAMPLE)
    assert set(sample.own_wavelengths([p.name for p in sample.parameters.free], WAVES).values()) == set(WAVES)
    assert sample.own_wavelengths(["ink.asymmetry_parameter"], WAVES) == {}
    assert sample.own_wavelengths(["ink.scattering_per_mm@500"], (550.0,)) == {}


class Mixing(ReadingEffect):
    """A reading that contains light of all wavelengths."""

    name = "mixing"
    statement = "the detector sees all wavelengths"

    @property
    def terms(self):
        return (Parameter("mixing.share", 0.2, True, 0.0, 1.0),)

    def change(self, predicted, values, field):
        share = values["mixing.share"]
        return (1 - share) * predicted + share * jnp.mean(predicted)


def test_an_effect_of_a_users_own_may_mix_wavelengths(data):
    sample = parse_sample(SAMPLE)
    scene = Scene.of(*data.directions, row=data.reading_order)
    model = AugmentedModel(sample, (Mixing(),), scene, SMALL)
    names = tuple(p.name for p in sample.parameters.free)
    constants = {n: p.value for n, p in model.sample.parameters.items() if n not in names}
    noise = noise_of(data, sample.noise)
    with jax.enable_x64(True):
        objective = compose(
            Objective, model, data, sample, noise, constants, kind="chi_square",
            scale=UnitScale.of(sample.parameters.free), free=names,
        )  # fmt: skip
        assert Colouring.of(objective).seeds.shape[0] == len(names)
        unit = np.full(len(names), 0.4)
        found = CompiledObjective(objective).linearised(unit).jacobian
        expected = by_each_parameter(objective, unit)
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-10 * np.max(np.abs(expected)))
    assert np.all(found[: len(data), 0] != 0)
