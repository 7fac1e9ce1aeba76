"""A diagnosis takes declared effects as part of the model, and does not look for them again."""

import numpy as np
import pytest

import jaxink
from jaxink.diagnosis.search.problem import SearchProblem
from jaxink.effects import CATALOGUE, Scene
from jaxink.measurement import FitNoise, GonioData
from jaxink.numerics.precision import computing
from jaxink.sample import parse_sample
from jaxink.solver.config import SolverConfig
from tests.samples import STRAY_LIGHT, STRAY_PER_SR

CONFIG = SolverConfig(5, 4, 10, 3)
DECLARED = f"""{STRAY_LIGHT}
[effects.stray_light]
level_per_sr = {{ value = {STRAY_PER_SR}, free = true, min = 0, max = 0.02 }}
[effects.gain]
relative = 0.1
"""


@pytest.fixture(scope="module")
def problem():
    """A measurement simulated with the declared effects, and the problem that it poses."""
    sample = parse_sample(DECLARED)
    signed = np.linspace(-70, 70, 15)
    columns = (
        np.full(15, 20.0),
        np.abs(signed),
        np.where(signed > 0, 180.0, 0.0),
        np.full(15, 550.0),
        np.arange(15) % 2 > 0,
    )
    data = GonioData(*columns, np.ones(15))
    data = data.replace(bsdf_per_sr=jaxink.predict(sample, data, CONFIG))
    noise = FitNoise(0.01 * data.bsdf_per_sr, 0.0, "declared")
    options = jaxink.DiagnosisOptions()
    scene = Scene.of(*data.directions, row=data.reading_order)
    return SearchProblem(sample, data, noise, CONFIG, scene, CATALOGUE, options.screen)


def test_declared_effects_are_not_looked_for(problem):
    listed = problem.listed(())
    names = {form.name for form in listed.forms} | set(listed.not_testable)
    assert not {"stray_light", "gain"} & names
    assert {"signal_floor", "blur"} <= names


def test_declared_effects_are_in_the_model_and_their_parameters_are_free(problem):
    with computing():
        objective = problem.objective((), len(problem.sample.parameters.free))
        predicted = objective.predict(objective.start)
    np.testing.assert_allclose(predicted, problem.data.bsdf_per_sr, rtol=1e-12)
    assert "stray_light.level_per_sr" in objective.base_free
    # The range is that of the file, not that of a search.
    assert objective.terms["stray_light.level_per_sr"].maximum == 0.02
