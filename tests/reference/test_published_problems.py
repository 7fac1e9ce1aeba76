"""The published reconstructions as problems: their stand-ins are what they are said to be."""

from pathlib import Path

import numpy as np

import jaxink
from benchmarks.validation.published import problems
from benchmarks.validation.published.judgement import truth_values
from benchmarks.validation.published.problems import EVERYTHING, PROTOCOL, SHEET, problem
from benchmarks.validation.published.spectral_shape import (
    diffuse_reflectance,
    shape_of_absorption_index,
    shape_of_scattering,
)
from jaxink.fitting.fit_objective import compile_objective
from jaxink.measurement import GonioData
from jaxink.numerics.precision import computing

SHEET_FOLDER = Path(problems.__file__).parent / SHEET


def test_the_sheet_of_2018_lit_from_both_faces_is_explained_by_its_truth():
    one = problem(f"{SHEET}-mie", EVERYTHING)
    objective, truth = one.objective(), truth_values(one.name)
    at_truth = objective.scale.to_unit(np.array([truth[name] for name in objective.free]))
    elsewhere = objective.scale.to_unit(np.array([p.value for p in one.sample.parameters.free]))
    # 20 scans: five incidences, two sides, two lit faces.
    assert objective.n_points == 432
    assert [part.n_scans for part in objective.parts] == [10, 10]
    with computing():
        programs = compile_objective(objective)
        assert abs(programs.residual(at_truth).loss - 432) < 4 * np.sqrt(2 * 432)
        assert programs.residual(elsewhere).loss > 1e4


def test_the_project_file_of_2018_is_the_same_problem():
    one = problem(f"{SHEET}-mie", EVERYTHING)
    project = jaxink.load_project(SHEET_FOLDER / "project.toml")
    free = {p.name: (p.value, p.minimum, p.maximum) for p in one.sample.parameters.free}
    assert {p.name: (p.value, p.minimum, p.maximum) for p in project.free} == free
    for given, (data, sample) in zip(project.measurements, one.measurements, strict=True):
        np.testing.assert_array_equal(given.data.bsdf_per_sr, data.bsdf_per_sr)
        assert given.sample.layers == sample.layers
        assert given.sample.noise == sample.noise


def test_start_and_ranges_of_2018_are_those_printed():
    table = problem(f"{SHEET}-mie", PROTOCOL).sample.parameters
    printed = {
        "ink.volume_fraction": (0.03, 0.02, 0.04),
        "ink.radius_nm": (500, 100, 1000),
        "ink.particle_index": (1.7, 1.5, 2.0),
        "ink.thickness_um": (200, 100, 300),
    }
    assert {p.name: (p.value, p.minimum, p.maximum) for p in table.free} == printed


def test_the_shape_follows_from_the_reflectance_of_diffusers():
    theta_i, theta_o, wavelength = (
        axis.ravel() for axis in np.meshgrid([0.0, 30.0], np.arange(-85.0, 86.0, 5.0), [500.0, 600.0])
    )
    reflectance = np.where(wavelength == 500, 0.8, 0.4)
    phi = np.where(theta_o < 0, 0.0, 180.0)
    data = GonioData(theta_i, np.abs(theta_o), phi, wavelength, theta_i < 0, reflectance / np.pi)
    found = diffuse_reflectance(data)
    np.testing.assert_allclose([found[500.0], found[600.0]], [0.8, 0.4], rtol=1e-4)
    k = -np.array([500 * np.log(0.8), 600 * np.log(0.4)])
    np.testing.assert_allclose(shape_of_absorption_index(data), k / k.mean(), rtol=1e-3)
    np.testing.assert_allclose(shape_of_scattering(data), [4 / 3, 2 / 3], rtol=1e-4)
