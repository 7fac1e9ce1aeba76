"""Over black, over white and collimated: three readings of random inks, and what they determine.

The readings are simulated by the forward model with noise of 0.3 %; what is tried is what three numbers
determine, not the model.
"""

import dataclasses

import numpy as np

import jaxink
from benchmarks.validation.joint.pull import drawn_ink
from jaxink.fitting import FitOptions
from jaxink.measurement import Readings
from jaxink.model.forward import evaluate
from jaxink.model.readings import ReadingsModel
from jaxink.projects import Measurement, Project
from jaxink.sample import Backing, Parameter, ParameterTable, Sample

CARDS = {"over_black": 0.04, "over_white": 0.85}
_NOISE = 0.003
_FILM = """
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 20
scattering_per_mm = { free = true, min = 1, max = 1000, value = 100 }
absorption_per_mm = { free = true, min = 0.01, max = 50, value = 2 }
asymmetry_parameter = { free = true, min = -0.5, max = 0.95, value = 0.5 }
"""


def _on_card(sample: Sample, reflectance: float) -> Sample:
    own = Parameter("backing.reflectance", reflectance, minimum=0.0, maximum=1.0)
    table = ParameterTable([*sample.parameters.values(), own])
    return dataclasses.replace(sample, backing=Backing("R", False), parameters=table)


def _reading(quantity: str, sample: Sample, rng: np.random.Generator) -> Readings:
    def of(value: float, sigma: float | None) -> Readings:
        none, angle = np.array([np.nan]), 0.0 if quantity == "T_collimated" else 8.0
        columns = np.array([quantity]), np.array([angle]), none, none, np.array([550.0]), np.array([value])
        return Readings(*columns, sigma=None if sigma is None else np.array([sigma]))

    exact = float(evaluate(ReadingsModel(sample, of(0.5, None)))[0])
    return of(exact * (1 + _NOISE * rng.standard_normal()), _NOISE * exact)


def found(seed: int) -> dict:
    """What a joint fit of the three finds of a random ink, with its distance from the truth."""
    rng, film = np.random.default_rng(seed), jaxink.parse_sample(_FILM)
    truth = drawn_ink(rng)
    samples = {name: _on_card(film, card) for name, card in CARDS.items()} | {"collimated": film}
    measurements = []
    for name, sample in samples.items():
        quantity = "T_collimated" if name == "collimated" else "R_total"
        data = _reading(quantity, sample.replace(truth), rng)
        names = {p: f"{name}/{p}" if p.startswith("backing.") else p for p in sample.parameters}
        measurements.append(Measurement(name, data, sample, names))
    options = FitOptions(profile="none", starts=4)
    result = jaxink.fit(Project(tuple(measurements)), options=options)
    true_extinction = truth["ink.scattering_per_mm"] + truth["ink.absorption_per_mm"]
    extinction = result["ink.scattering_per_mm"].value + result["ink.absorption_per_mm"].value
    return {
        "optical_thickness": 0.02 * true_extinction,
        "extinction_off": extinction / true_extinction - 1,
        "parameters": {
            p.name: {
                "value": p.value,
                "true": truth[p.name],
                "standard_error": p.standard_error,
                "errors_off": None
                if p.standard_error is None
                else (p.value - truth[p.name]) / p.standard_error,
                "flag": p.flag,
            }
            for p in result.parameters.free
        },
        "comparable_minima": len(result.minima.comparable) if result.minima else None,
    }
