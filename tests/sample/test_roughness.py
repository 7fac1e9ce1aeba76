"""Rough faces in sample files: by waves, and from measured maps of heights."""

import dataclasses
import json

import numpy as np
import pytest

import jaxink
from jaxink.sample import load_sample, parse_sample, sample_from_dict, sample_to_dict

SAMPLE = """\
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 80
scattering_per_mm = 20
absorption_per_mm = 1.0
asymmetry_parameter = 0.6
front_roughness = FACE
[noise]
relative = 0.01
"""
K_CORRELATION = '{ spectrum = "k_correlation", height_rms_um = 0.3, length_b_um = 5, exponent = 3.5 }'
MAP_BY_WAVES = '{ spectrum = "height_map", heights_um = "map.csv", pitch_um = 0.5, height_scale = SCALE }'
MAP_BY_FACETS = '{ density = "height_map", heights_um = "map.npy", pitch_um = [0.5, 0.5] }'
SCALE = "{ free = true, value = 1.0, min = 0.3, max = 3, prior = { mean = 1, standard_deviation = 0.5 } }"


def with_face(face: str) -> str:
    return SAMPLE.replace("FACE", face)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """With a map of 0.25 um rms that is smooth over about 5 um, as CSV and as saved by numpy."""
    where = tmp_path_factory.mktemp("maps")
    rng = np.random.default_rng(5)
    frequency = np.hypot(*np.meshgrid(*[np.fft.fftfreq(128, 0.5)] * 2))
    heights = np.fft.ifft2(
        np.fft.fft2(rng.normal(size=(128, 128))) * np.exp(-((np.pi * 5 * frequency) ** 2) / 2)
    )
    heights = heights.real * 0.25 / heights.real.std()
    np.savetxt(where / "map.csv", heights, delimiter=",")
    np.save(where / "map.npy", heights)
    return where


def loaded(folder, face: str):
    path = folder / "sample.toml"
    path.write_text(with_face(face))
    return load_sample(path)


def test_spectrum_has_its_parameters():
    sample = parse_sample(with_face(K_CORRELATION))
    face = sample.layers[0].roughness[0]
    assert (face.spectrum, face.amplitude, face.density) == ("k_correlation", "perturbation", None)
    assert face.strength == "ink.front_roughness.height_rms_um"
    assert sample.parameters["ink.front_roughness.exponent"].value == 3.5


@pytest.mark.parametrize("face", [MAP_BY_FACETS, MAP_BY_WAVES.replace("SCALE", SCALE)])
def test_result_files_hold_what_the_map_gave(folder, face):
    sample = loaded(folder, face)
    assert len(sample.layers[0].roughness[0].nodes[0]) > 5
    again = sample_from_dict(json.loads(json.dumps(sample_to_dict(sample))))
    assert again.layers == sample.layers


def test_map_by_facets_has_its_slope_variance(folder):
    first, log_density, _ = loaded(folder, MAP_BY_FACETS).layers[0].roughness[0].nodes
    slope = np.linspace(0, first[-1], 4001)
    weight = slope * np.exp(np.interp(slope, first, log_density))
    along_one_axis = np.trapezoid(weight * slope**2, slope) / np.trapezoid(weight, slope) / 2
    heights = np.load(folder / "map.npy")
    inner = (heights[2:, 1:-1] - heights[:-2, 1:-1]) / 1.0
    assert along_one_axis == pytest.approx(np.mean(inner**2), rel=0.05)


def test_height_scale_with_a_prior_is_fitted(folder, coarse):
    """A plate whose relief is 1.4 times the map's: simulated by the model, without noise."""
    face = MAP_BY_WAVES.replace("SCALE", SCALE)
    truth = loaded(folder, face.replace("value = 1.0", "value = 1.4"))
    theta_o, phi = (a.ravel() for a in np.meshgrid([5.0, 20.0, 35.0, 50.0, 65.0], [0.0, 180.0]))
    data = jaxink.GonioData(
        theta_i_deg=np.full(10, 30.0),
        theta_o_deg=theta_o,
        phi_deg=phi,
        wavelength_nm=np.full(10, 550.0),
        is_transmission=np.zeros(10, bool),
        bsdf_per_sr=np.ones(10),
    )
    measured = dataclasses.replace(data, bsdf_per_sr=jaxink.predict(truth, data, coarse))
    result = jaxink.fit(measured, loaded(folder, face), jaxink.FitOptions(config=coarse))
    scale = result["ink.front_roughness.height_scale"]
    # The prior draws it towards 1 by the square of the ratio of the standard errors.
    assert scale.standard_error < 0.05
    assert scale.value == pytest.approx(1.4, abs=0.4 * (scale.standard_error / 0.5) ** 2 + 1e-3)


@pytest.mark.parametrize(
    ("face", "named"),
    [
        ('{ density = "ggx", spectrum = "gaussian" }', "spectrum"),
        ('{ spectrum = "gauss" }', "k_correlation"),
        ('{ spectrum = "gaussian", height_rms_um = 1 }', "correlation_length_um"),
        ('{ spectrum = "gaussian", sigma_deg = 1 }', "sigma_deg"),
        ('{ density = "height_map", pitch_um = 1 }', "heights_um"),
        ('{ density = "height_map", heights_um = "map.npy" }', "pitch_um"),
        (
            '{ density = "height_map", heights_um = "none.csv", pitch_um = 1 }',
            "none.csv",
        ),
        (
            '{ density = "height_map", heights_um = "sample.toml", pitch_um = 1 }',
            ".csv",
        ),
        (
            '{ density = "height_map", heights_um = "bad.csv", pitch_um = 1 }',
            "row 2",
        ),
        (
            '{ density = "height_map", heights_um = "short.csv", pitch_um = 1 }',
            "heights_um",
        ),
    ],
)
def test_bad_faces(folder, face, named, refused):
    (folder / "short.csv").write_text("1,2\n3,4\n")
    (folder / "bad.csv").write_text("1,2\nx,4\n")
    with refused(named):
        loaded(folder, face)
