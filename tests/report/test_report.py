"""The report of a diagnosis and its command, on one small simulated measurement with stray light."""

import base64
import dataclasses
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from typer.testing import CliRunner

import jaxink
from jaxink.cli.app import app
from jaxink.data import simulated_example
from jaxink.diagnosis import DiagnosisOptions, Verdict, diagnose
from jaxink.diagnosis.verdict import CODES
from jaxink.effects import Effect
from jaxink.effects.instrument import AngleOffset, Drift, Gain, StrayLight
from jaxink.effects.sample import AirGap, BinderIndex, Pinholes, SecondLobe, UndeclaredBacking
from jaxink.export.change import table_change
from jaxink.fitting import FitOptions
from jaxink.fitting.outcome import Outcome
from jaxink.forward import evaluate
from jaxink.measurement import GonioData
from jaxink.numerics.precision import computing
from jaxink.plots.cuts import BEFORE, FITTED, MEASURED
from jaxink.plots.diagnosis import diagnosis_figures, drawn_wavelengths
from jaxink.plots.inside import FROM_INSIDE
from jaxink.report import write_report
from jaxink.report.inside import inside_change, is_in_table

DATA, SAMPLE = map(str, simulated_example())
STRAY_PER_SR = 0.008
TRUTH = {"ink.scattering_per_mm": 120.0, "ink.absorption_per_mm": 1.0}
TOML = """
schema_version = 1
title = "Simulated: <ink> & plate"
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
thickness_um = 90
scattering_per_mm = { free = true, value = 100, min = 1, max = 1000 }
absorption_per_mm = { free = true, value = 2, min = 0, max = 50 }
asymmetry_parameter = 0.6
[noise]
scan_relative = 0.002
"""
CATALOGUE = (StrayLight, Gain, AngleOffset, Drift, BinderIndex, UndeclaredBacking)


@pytest.fixture(scope="session")
def found(coarse):
    """Diagnosis of 84 values with noise of half a per cent and a constant added."""
    sample = jaxink.parse_sample(TOML)
    signed = np.array([-80.0, -70, -55, -40, -20, -8, 0, 8, 20, 40, 55, 70, 77, 83])
    theta_i, angle, side = (
        axis.ravel() for axis in np.meshgrid([10.0, 35.0, 62.0], signed, [False, True], indexing="ij")
    )
    columns = (theta_i, np.abs(angle), np.where(angle < 0, 0.0, 180.0), np.full(angle.size, 550.0), side)
    with computing():
        model = jaxink.ForwardModel(sample, *columns, coarse)
        clean = np.asarray(model.bsdf({**sample.parameters.values_with({}), **TRUTH}))
    sigma = 0.005 * clean
    noise = np.random.default_rng(3).standard_normal(angle.size)
    data = GonioData(*columns, clean + STRAY_PER_SR + sigma * noise, sigma, source="small.csv")
    options = DiagnosisOptions(
        catalogue=CATALOGUE, n_bootstrap=500, fit=FitOptions(profile="none", config=coarse)
    )
    return diagnose(data, sample, options)


@pytest.fixture(scope="session")
def change(found, coarse):
    """Tables of the ink before and after, coarse."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jaxink.forward.ForwardModel.sizes", lambda *_: coarse)
        return inside_change(found)


def test_it_runs(found, change):
    print(found.verdict, change.of("R_II"), change.of("T_IA"))
