"""Particles of another material than the sample names."""

import numpy as np
import pytest

import jaxink
from jaxink.fitting import check_input
from jaxink.fitting.pigment_hypotheses import of_pigments
from tests.samples import edited

PIGMENT = """
schema_version = 1
wavelength_nm = [450, 600]
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = 15
radius_nm = 130
volume_fraction = { free = true, value = 0.05, min = 0.002, max = 0.4 }
particle_index = { material = "anatase" }
particle_absorption_index = { material = "anatase" }
[noise]
relative = 0.005
floor_per_sr = 1e-4
"""
RUTILE = PIGMENT.replace("anatase", "rutile")


def found(text):
    return {h.name.rpartition("_are_")[2]: h for h in of_pigments(jaxink.parse_sample(text))}


@pytest.fixture(scope="module")
def data():
    """Simulated with rutile."""
    theta_o = np.arange(5.0, 80.0, 10.0)
    nm = np.array([450.0, 600.0])[:, None]
    seen = jaxink.predict_at(RUTILE_SAMPLE, 0.0, theta_o, wavelength_nm=nm, accuracy=1e-2)
    noise = 0.005 * np.random.default_rng(2).standard_normal(len(seen))
    return seen.replace(bsdf_per_sr=seen.bsdf_per_sr * (1 + noise))


RUTILE_SAMPLE = jaxink.parse_sample(RUTILE)


def test_the_corrected_sample_is_that_of_the_other_material(data):
    corrected = found(PIGMENT)["rutile"].correct(data, jaxink.parse_sample(PIGMENT))
    values = corrected.sample.parameters.values_with(dict(corrected.held))
    known = RUTILE_SAMPLE.parameters.values_with({})
    for nm in (450.0, 600.0):
        here, there = corrected.sample.at_wavelength(values, nm), RUTILE_SAMPLE.at_wavelength(known, nm)
        for key in ("ink.particle_index", "ink.particle_absorption_index", "ink.radius_nm"):
            assert here[key] == pytest.approx(there[key], rel=1e-12)


def test_only_particles_of_a_named_material_are_doubted():
    assert {"rutile", "zinc_oxide", "hematite"} <= found(PIGMENT).keys()
    assert "anatase" not in found(PIGMENT)
    numbers = edited(PIGMENT, ('particle_index = { material = "anatase" }', "particle_index = 2.5"))
    assert found(numbers) == {}
    # Rutile is not known at 400 nm.
    assert "rutile" not in found(PIGMENT.replace("450", "400"))


def test_an_absorption_that_is_fitted_stays_free(data):
    given = 'particle_absorption_index = { material = "anatase" }'
    free = "particle_absorption_index = { free = true, min = 0, max = 0.1 }"
    sample = jaxink.parse_sample(edited(PIGMENT, (given, free)))
    corrected = next(h for h in of_pigments(sample) if h.name.endswith("rutile")).correct(data, sample)
    assert sorted(corrected.held) == ["ink.particle_index@450", "ink.particle_index@600"]
    assert corrected.sample.parameters["ink.particle_absorption_index"].free


def test_the_right_pigment_is_named(data, monkeypatch, told):
    # Thicknesses have a program of their own, which takes as long to compile.
    monkeypatch.setattr("jaxink.fitting.input_check.of_lengths", lambda _: ())
    options = jaxink.FitOptions(accuracy=1e-2, profile="none")
    checked = check_input(jaxink.fit(data, jaxink.parse_sample(PIGMENT), options))
    assert checked.verdict.is_misfit
    (named,) = (mistake for mistake in checked.mistakes if mistake.is_named)
    told(named.statement, "rutile", "anatase")
    told(named.remedy, "ink.particle_index")
