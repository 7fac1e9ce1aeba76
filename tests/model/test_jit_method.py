"""`jax.jit` of a model's own methods, as a notebook calls it."""

import jax
import numpy as np
import pytest

import jaxink
from jaxink.errors import PrecisionError
from jaxink.model import evaluate


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


def test_predictions_of_one_structure_are_traced_once(model, coarse, monkeypatch):
    traced, own = [], jaxink.ForwardModel.bsdf

    def bsdf(self, values=None):
        traced.append(self)
        return own(self, values)

    points = map(np.array, ([0.0, 40.0], [10.0, 50.0], [180.0, 0.0], [550.0] * 2, [False, True]))
    columns, found = tuple(points), []
    for change in ({}, {"ink.scattering_per_mm": 50.0, "ink.thickness_um": 40.0}):
        one = jaxink.ForwardModel(model.sample.replace(change), *columns, coarse)
        with monkeypatch.context() as patch:
            patch.setattr(jaxink.ForwardModel, "bsdf", bsdf)
            found.append(evaluate(one))
        np.testing.assert_allclose(found[-1], one.bsdf(), rtol=1e-12)
    assert len(traced) == 1
    assert np.all(np.abs(found[1] / found[0] - 1) > 0.01)
