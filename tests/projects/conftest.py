"""A project of a few simulated points: one ink, printed thin and thick, the thick one lit from both sides."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.measurement import GonioData
from jaxink.projects import Project, parse_project
from jaxink.sample import Sample
from jaxink.sample.turning import turned_over

SAMPLE = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 30
scattering_per_mm = { free = true, min = 1, max = 500, value = 90 }
absorption_per_mm = { free = true, min = 0, max = 50, value = 2 }
asymmetry_parameter = { free = true, min = -0.9, max = 0.95, value = 0.4 }
[noise]
relative = 0.005
floor_per_sr = 1e-4
scan_relative = 0
"""
PROJECT = """
schema_version = 1
title = "Simulated: one ink, thin and thick"
sample = "ink.toml"
[specimens.thick]
ink.thickness_um = 75
[[measurements]]
name = "thin"
data = "thin.csv"
[[measurements]]
name = "thick"
data = "thick.csv"
specimen = "thick"
[[measurements]]
name = "thick_lit_ink"
data = "thick_lit_ink.csv"
specimen = "thick"
lit_side = "ink"
"""
TRUTH = {"ink.scattering_per_mm": 60.0, "ink.absorption_per_mm": 1.0, "ink.asymmetry_parameter": 0.6}
NOISE, FLOOR = 0.005, 1e-4


def directions() -> GonioData:
    """Both sides in the plane of incidence, at three incidences."""
    rows = [
        (theta_i, theta_o, phi, 550.0, side)
        for theta_i in (0.0, 30.0, 60.0)
        for side in (False, True)
        for phi in (0.0, 180.0)
        for theta_o in np.arange(2.5, 80, 7.5)
    ]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return GonioData(*columns, bsdf_per_sr=np.ones(len(rows)), source="simulated")


def measured(sample: Sample, seed: int, factor: float = 1.0, noise: float = NOISE) -> GonioData:
    """What an instrument whose readings are too large by a factor would read of a sample, with noise."""
    at = directions()
    exact = factor * jaxink.predict(sample, at)
    sigma = np.hypot(noise * exact, FLOOR if noise else 0.0)
    values = exact + sigma * np.random.default_rng(seed).standard_normal(len(at))
    return at.replace(bsdf_per_sr=np.maximum(values, 1e-9), sigma_per_sr=np.hypot(NOISE * exact, FLOOR))


def as_simulated(project: Project, noise: float = NOISE, **factors: float) -> Project:
    """The project with measurements of the true ink; factors of the readings by measurement."""
    measurements = []
    for seed, one in enumerate(project.measurements):
        sample = one.sample.replace(TRUTH)
        data = measured(sample, seed, factors.get(one.name, 1.0), noise).replace(source=one.data.source)
        measurements.append(dataclasses.replace(one, data=data))
    return dataclasses.replace(project, measurements=tuple(measurements))


@pytest.fixture(scope="session")
def project_folder(tmp_path_factory):
    """Project file, sample file and the three measurements, without a name of the true values."""
    folder = tmp_path_factory.mktemp("project")
    (folder / "ink.toml").write_text(SAMPLE)
    (folder / "project.toml").write_text(PROJECT)
    sample = jaxink.parse_sample(SAMPLE).replace(TRUTH)
    thick = sample.replace({"ink.thickness_um": 75})
    states = {"thin": sample, "thick": thick, "thick_lit_ink": turned_over(thick)}
    for seed, (name, one) in enumerate(states.items()):
        assert one is not None
        jaxink.measurement.write_csv(measured(one, seed), folder / f"{name}.csv")
    return folder


@pytest.fixture(scope="session")
def project(project_folder) -> Project:
    return jaxink.load_project(project_folder / "project.toml")


@pytest.fixture(scope="session")
def fitted(project):
    return jaxink.fit(project)


def project_of(text: str, folder) -> Project:
    """A project of a text, with the files of a folder."""
    return parse_project(text, folder=folder)
