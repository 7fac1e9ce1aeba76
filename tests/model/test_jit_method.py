"""`jax.jit` of a model's own methods, as a notebook calls it."""

import jax
import numpy as np
import pytest

import jaxink
from jaxink.errors import PrecisionError


@pytest.fixture(scope="module")
def model(coarse):
    from jaxink.data import simulated_example

    _, sample = simulated_example()
    here = ([0.0, 30.0, 60.0], [30.0, 10.0, 45.0], [180.0, 0.0, 90.0], [550.0] * 3, [False, True, False])
    return jaxink.ForwardModel(jaxink.load_sample(sample), *map(np.array, here), coarse)


def test_a_compiled_method_gives_the_same_bsdf(model):
    values = {p.name: p.value for p in model.sample.parameters.free}
    compiled = jax.jit(model.bsdf)(values)
    assert compiled.dtype == np.float64
    np.testing.assert_allclose(compiled, model.bsdf(values), rtol=1e-12)
    changed = {**values, "ink.scattering_per_mm": 2 * values["ink.scattering_per_mm"]}
    np.testing.assert_allclose(jax.jit(model.bsdf)(changed), model.bsdf(changed), rtol=1e-12)


def test_in_32_bits_it_says_what_to_do(model):
    with jax.enable_x64(False), pytest.raises(PrecisionError):
        jax.jit(model.bsdf)({"ink.scattering_per_mm": 50.0})


def test_the_methods_of_two_models_are_compiled_apart(model, coarse):
    other = jaxink.ForwardModel(model.sample, [0.0], [20.0], [180.0], [550.0], [False], coarse)
    assert jax.jit(other.bsdf)({}).shape == (1,)
    assert jax.jit(model.bsdf)({}).shape == (3,)
