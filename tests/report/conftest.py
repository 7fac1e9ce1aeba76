"""One small simulated measurement with stray light, its diagnosis and its report."""

import dataclasses

import numpy as np
import pytest

import jaxink
from jaxink.diagnosis import DiagnosisOptions, Verdict, VerdictCode, diagnose
from jaxink.effects.instrument import Drift, StrayLight
from jaxink.effects.volume import Polydispersity
from jaxink.fitting import FitOptions
from jaxink.measurement import GonioData
from jaxink.numerics.precision import computing
from jaxink.plots.diagnosis_pages import diagnosis_figures
from jaxink.report import write_report
from jaxink.report.ink_table import inside_change
from tests.samples import STRAY_LIGHT, STRAY_PER_SR, TRUTH

CATALOGUE = (StrayLight, Drift, Polydispersity)


@pytest.fixture(scope="session")
def found(coarse):
    """Diagnosis of 84 values with noise of half a per cent and a constant added."""
    sample = jaxink.parse_sample(STRAY_LIGHT)
    signed = np.array([-80.0, -70, -55, -40, -20, -8, 0, 8, 20, 40, 55, 70, 77, 83])
    theta_i, angle, side = (
        axis.ravel() for axis in np.meshgrid([14.0, 35.0, 62.0], signed, [False, True], indexing="ij")
    )
    columns = (theta_i, np.abs(angle), np.where(angle < 0, 0.0, 180.0), np.full(angle.size, 550.0), side)
    with computing():
        model = jaxink.ForwardModel(sample, *columns, coarse)
        clean = np.asarray(model.bsdf({**sample.parameters.values_with({}), **TRUTH}))
    sigma = 0.005 * clean
    noise = np.random.default_rng(3).standard_normal(angle.size)
    data = GonioData(*columns, clean + STRAY_PER_SR + sigma * noise, sigma, source="small.csv")
    options = DiagnosisOptions(
        catalogue=CATALOGUE, n_bootstrap=500, seed=77, fit=FitOptions(profile="none", config=coarse)
    )
    return diagnose(data, sample, options)


@pytest.fixture(scope="session")
def change(found, coarse):
    """Tables of the ink before and after, coarse."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jaxink.model.forward.model_sizes", lambda *_: coarse)
        return inside_change(found)


@pytest.fixture(scope="session")
def written(found, change, tmp_path_factory):
    """Folder of a report, and what was returned."""
    folder = tmp_path_factory.mktemp("report")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jaxink.report.writing.inside_change", lambda _: change)
        return folder, write_report(found, folder)


@pytest.fixture(scope="session")
def unchanged(found):
    """The same where no effect is found."""
    verdict = Verdict(VerdictCode.NO_MISFIT, (), "No misfit: nothing to see.")
    return dataclasses.replace(found, verdict=verdict, steps=(), after=found.before, effects=())


@pytest.fixture(scope="session")
def plates(found, change):
    """Figures by name."""
    return {plate.name: plate.figure for plate in diagnosis_figures(found, change)}
