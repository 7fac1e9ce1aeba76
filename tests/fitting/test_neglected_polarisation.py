"""The error of the scalar theory beside a fit."""

import dataclasses

import numpy as np
import pytest

import jaxink
from benchmarks.validation.declared_effects import CONFIG, MIE, TWO_COLOURS, scene_of
from jaxink.measurement import GonioData
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.numerics.precision import computing
from jaxink.sample import parse_sample

NOISE = "\n[noise]\nrelative = 0.01\n"


def fitted(text: str) -> jaxink.FitResult:
    """Fit of one free number to the scalar model itself."""
    sample = parse_sample(text + NOISE)
    columns, _ = scene_of(sample)
    scalar = dataclasses.replace(sample, effects=(), parameters=parse_sample(MIE).parameters)
    measured = evaluate(ForwardModel(scalar if sample.effects else sample, *columns, CONFIG))
    return jaxink.fit(GonioData(*columns, measured), sample, jaxink.FitOptions(config=CONFIG))


def test_a_fit_of_particles_says_what_the_scalar_theory_neglects(tmp_path):
    result = fitted(MIE)
    model = result.forward_model()
    with computing():
        relative = (np.asarray(model.polarised_excess()) / np.asarray(model.bsdf()))[result.data.used]
    neglected = result.neglected_polarisation
    assert neglected.rms == pytest.approx(np.sqrt(np.mean(relative**2)), rel=1e-6)
    assert neglected.largest == pytest.approx(np.max(np.abs(relative)), rel=1e-6)
    assert neglected.rms > 1e-4
    assert neglected.sentence in result.notes
    assert 0 < result.mie_check.largest_relative_difference < 1e-6
    result.save(tmp_path)
    assert jaxink.load_result(tmp_path).neglected_polarisation == pytest.approx(neglected)
    assert jaxink.load_result(tmp_path).mie_check == pytest.approx(result.mie_check)


@pytest.mark.parametrize("text", [TWO_COLOURS, MIE + "\n[effects.polarisation]\nshare = 1\n"])
def test_without_particles_or_with_the_effect_it_says_nothing(text):
    result = fitted(text)
    assert result.neglected_polarisation is None
    assert not any("polarisation" in note for note in result.notes)
