"""Inks of Mie spheres of which one scan leaves several minima: does the first measurement of the plan decide?

The measurements are simulated by the forward model with noise. One scan in reflection, with noise of 2 %, is
fitted; the plan's first measurement is then simulated, with its own noise, and added.
"""

import dataclasses

import numpy as np

import jaxink
from jaxink.fitting import FitOptions, FitResult, JointResult
from jaxink.measurement import GonioData, Readings
from jaxink.model.forward import evaluate
from jaxink.model.readings import ReadingsModel
from jaxink.planning import MeasurementPlan
from jaxink.projects import Measurement, Project

_OPTIONS = FitOptions(profile="none", accuracy=1e-3)
_NOISE = 0.02
_SAMPLE = """
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
phase_function = "mie"
refractive_index = 1.5
thickness_um = 30
radius_nm = { free = true, min = 100, max = 600 }
volume_fraction = { free = true, min = 0.002, max = 0.5 }
particle_index = { free = true, min = 1.6, max = 2.8 }
particle_absorption_index = 0.0001
[noise]
scan_relative = 0.002
"""


def _scan() -> GonioData:
    theta_o = np.concatenate([np.arange(5.0, 81.0, 5.0)] * 2)
    phi = np.repeat([0.0, 180.0], len(theta_o) // 2)
    n, zeros = len(theta_o), np.zeros(len(theta_o))
    return GonioData(
        zeros, theta_o, phi, np.full(n, 550.0), np.zeros(n, bool), np.ones(n), source="simulated"
    )


def noisy(data, sample, rng, sigma_of):
    """The data of a sample, with noise."""
    if isinstance(data, Readings):
        exact = evaluate(ReadingsModel(sample, data))
        sigma = sigma_of(exact)
        return dataclasses.replace(data, value=exact + sigma * rng.standard_normal(len(exact)), sigma=sigma)
    exact = jaxink.predict(sample, data)
    sigma = sigma_of(exact)
    values = np.maximum(exact + sigma * rng.standard_normal(len(exact)), 1e-9)
    return data.replace(bsdf_per_sr=values, sigma_per_sr=sigma)


def found(seed: int) -> dict:
    """Minima that are not excluded, before and after the first measurement of the plan."""
    rng, sample = np.random.default_rng(1000 + seed), jaxink.parse_sample(_SAMPLE)
    truth = {
        "ink.radius_nm": float(rng.uniform(150, 450)),
        "ink.volume_fraction": float(np.exp(rng.uniform(np.log(0.01), np.log(0.15)))),
        "ink.particle_index": float(rng.uniform(1.75, 2.5)),
    }
    data = noisy(_scan(), sample.replace(truth), rng, lambda f: _NOISE * f)
    before = jaxink.fit(data, sample, _OPTIONS)
    if before.minima is None or len(before.minima.comparable) < 2:
        return {"truth": truth, "undecided": False}
    plan = jaxink.plan_measurement(before)
    after = joint_with_first(before, plan, truth, rng)
    return {
        "truth": truth,
        "undecided": True,
        "minima_before": len(before.minima.comparable),
        "separation_now": plan.separation,
        "measurement": plan.best.words,
        "forecast": plan.best.separation,
        "chance": plan.best.chance,
        "minima_after": len(after.minima.comparable) if after.minima else None,
        "values": {p.name: p.value for p in after.parameters.free},
        "standard_errors": {p.name: p.standard_error for p in after.parameters.free},
        "errors_off": {
            p.name: (p.value - truth[p.name]) / p.standard_error if p.standard_error else None
            for p in after.parameters.free
        },
    }


def joint_with_first(
    before: FitResult, plan: MeasurementPlan, truth: dict, rng: np.random.Generator
) -> JointResult:
    """The joint fit with the first measurement of the plan, simulated with the plan's noise."""
    one = plan.candidates[plan.best.name].measurement
    relative, common = plan.noise
    times = plan.readings / len(one.data)

    def sigma_of(exact):
        if isinstance(one.data, Readings):
            return np.hypot(relative / np.sqrt(times), common) * np.abs(exact)
        return relative / np.sqrt(times) * np.abs(exact)

    def shared(values):
        """What the further sample has in common with the present one."""
        return one.sample.replace({n: v for n, v in values.items() if one.names[n] == n})

    data = noisy(one.data, shared(truth), rng, sigma_of)
    # The fit begins as anew: what is known of the present one is its measurement.
    start = {p.name: p.value for p in before.sample.parameters.free}
    made = dataclasses.replace(one, data=data, sample=shared(start))
    present = Measurement("present", before.data, before.sample, {n: n for n in before.sample.parameters})
    return jaxink.fit(Project((present, made)), options=_OPTIONS)
