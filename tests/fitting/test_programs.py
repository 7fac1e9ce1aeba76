"""Compiled programs are shared by samples that differ in their values only, and give what each one says."""

import dataclasses
import logging

import jax
import numpy as np
import pytest

from jaxink.fitting import FitOptions, fit
from jaxink.fitting.compiled import CompiledObjective, program_of
from jaxink.fitting.objective import make_objective
from jaxink.measurement import GonioData
from jaxink.sample import parse_sample
from jaxink.solver.config import SolverConfig
from jaxink.solver.lateral import N_FREQUENCIES

SMALL = SolverConfig(4, 4, 8, 2)
HEAD = 'schema_version = 1\nwavelength_nm = {waves}\ntitle = "{title}"\n'
PLATE = """
[[layers]]
name = "plate"
kind = "clear"
refractive_index = {index}
thickness_mm = {plate_mm}
absorption_per_mm = 0.01
"""
INK = """
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.55
thickness_um = {ink_um}
scattering_per_mm = {{ free = true, value = {start}, min = 1, max = 400 }}
absorption_per_mm = {absorption}
asymmetry_parameter = 0.5
"""
MIE = """
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "mie"
refractive_index = 1.5
thickness_um = {ink_um}
radius_nm = 150
volume_fraction = {{ free = true, value = 0.05, min = 0.01, max = 0.3 }}
particle_index = 1.8
particle_absorption_index = {{ value = {absorption}e-3 }}
"""
STRAY = "\n[effects.stray_light]\nlevel_per_sr = {{ free = true, value = {stray}, min = 0, max = 0.1 }}\n"
NOISE = "\n[noise]\nrelative = {noise}\nscan_relative = {scans}\n"
# Once tabulated, once computed in every step, because an index is free.
ROUGH = """
[layers.back_roughness]
density = "{density}"
sigma_deg = {{ free = true, value = 6, min = 1, max = 20 }}
"""
FREE_INDEX = "= {{ free = true, value = 1.55, min = 1.4, max = 1.7 }}"
KINDS = {
    "plate and ink": HEAD + PLATE + INK + NOISE,
    "spheres, two wavelengths": HEAD.replace("{waves}", "[500, 600]") + MIE + NOISE,
    "tied": HEAD + PLATE + INK.replace("{absorption}", '{{ tie = "0.01 * ink.scattering_per_mm" }}') + NOISE,
    "rough": HEAD + PLATE + INK + ROUGH + NOISE,
    "rough, free index": HEAD
    + PLATE
    + INK.replace("= 1.55", "= {{ free = true, value = 1.55, min = 1.4, max = 1.7 }}")
    + ROUGH
    + NOISE,
    "declared effect": HEAD + PLATE + INK + STRAY + NOISE,
}
FIRST = {"waves": 550, "title": "a", "index": 1.49, "plate_mm": 2, "ink_um": 20, "start": 50}
FIRST |= {"absorption": 1, "noise": 0.01, "stray": 0.01, "density": "beckmann"}
FIRST |= {"scans": 0.0}
SECOND = FIRST | {"title": "b", "plate_mm": 3, "ink_um": 35, "start": 90, "absorption": 2, "noise": 0.02}
SECOND |= {"stray": 0.02, "density": "cauchy_angle", "scans": 0.003}


def data_at(waves):
    theta_o = np.array([5.0, 30.0, 50.0, 70.0])
    columns = np.meshgrid([0.0, 40.0], theta_o, waves, [False, True], indexing="ij")
    theta_i, theta_o, wave, side = (c.ravel() for c in columns)
    return GonioData(theta_i, theta_o, np.zeros(theta_i.size), wave, side, np.full(theta_i.size, 0.1))


@pytest.mark.parametrize("kind", KINDS)
def test_samples_of_one_structure_share_their_programs(kind):
    samples = [parse_sample(KINDS[kind].format(**values)) for values in (FIRST, SECOND)]
    with jax.enable_x64(True):
        data = data_at(samples[0].wavelengths_nm)
        objectives = [make_objective(data, sample, config=SMALL) for sample in samples]
        structures = {id(program_of(objective).structure) for objective in objectives}
        assert len(structures) == 1
        for objective in objectives:
            unit = np.full(len(objective.free), 0.4)
            found = CompiledObjective(objective).residual(unit)
            # Not compiled, with the sample's own values.
            expected = objective.model.bsdf(objective.numbers(unit))
            np.testing.assert_allclose(found.predicted, expected, rtol=1e-10)
        keys = {program_of(objective).structure.key for objective in objectives}
        assert len(keys) == 1
        assert None not in keys


def test_another_structure_has_another_program():
    text = KINDS["plate and ink"].format(**FIRST)
    other = text.replace('phase_function = "henyey_greenstein"', 'phase_function = "rayleigh"')
    other = other.replace("asymmetry_parameter = 0.5", "")
    with jax.enable_x64(True):
        keys = {
            program_of(make_objective(data_at([550.0]), parse_sample(one), config=SMALL)).structure.key
            for one in (text, other, KINDS["rough"].format(**FIRST))
        }
    assert len(keys) == 3


def test_a_further_sheet_of_a_batch_compiles_nothing(caplog):
    """Each program would take 2 MB of memory for every sheet, for as long as the process lives."""

    def fitted(number):
        values = FIRST | {"title": str(number), "ink_um": 20 + number, "plate_mm": 2 + number / 10}
        values["scans"] = number / 1000
        data = data_at([550.0])
        data = dataclasses.replace(data, bsdf_per_sr=data.bsdf_per_sr * (1 + number / 10))
        return fit(data, parse_sample(KINDS["plate and ink"].format(**values)), FitOptions(config=SMALL))

    def compiled(number):
        caplog.clear()
        with caplog.at_level(logging.DEBUG, logger="jax._src.interpreters.pxla"):
            fitted(number)
        return [record.getMessage() for record in caplog.records if "Compiling" in record.getMessage()]

    assert compiled(0)
    assert compiled(1) == []


def test_number_of_stacks_tells_what_a_prediction_costs():
    field = "\n[instrument]\nbeam_diameter_mm = 2\ndetector_diameter_mm = 6\n"
    gap = "\n[effects.air_gap]\nshare = { free = true, value = 0.2, min = 0, max = 1 }\n"
    found = {}
    with jax.enable_x64(True):
        for name, more in {"two wavelengths": "", "field of view": field, "two areas": gap}.items():
            kind = "plate and ink" if more else "spheres, two wavelengths"
            sample = parse_sample(KINDS[kind].format(**FIRST) + more)
            objective = make_objective(data_at(sample.wavelengths_nm), sample, config=SMALL)
            found[name] = program_of(objective).structure.n_stacks
    # With a field of view, one stack for each frequency of the lateral displacement.
    assert found == {"two wavelengths": 2, "field of view": N_FREQUENCIES, "two areas": 2}
