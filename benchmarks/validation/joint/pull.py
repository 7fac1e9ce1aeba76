"""Three measurements of one simulated ink, of which one has a gain error: is it named, and no other?

The measurements are simulated by the forward model with noise, which is enough here: what is tried is the
comparison of the measurements, not the model.
"""

import dataclasses

import numpy as np

import jaxink
from jaxink.measurement import GonioData
from jaxink.projects import Measurement
from jaxink.sample import Sample
from jaxink.sample.turning import turned_over

GAIN = 0.03
SHEETS = ("thin", "thick", "thick_lit_ink")
_NOISE, _FLOOR = 0.005, 1e-4
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
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 30
scattering_per_mm = { free = true, min = 1, max = 500, value = 90 }
absorption_per_mm = { free = true, min = 0, max = 50, value = 2 }
asymmetry_parameter = { free = true, min = -0.9, max = 0.95, value = 0.4 }
"""


def directions() -> GonioData:
    """Both sides in the plane of incidence, at three incidences."""
    rows = [
        (theta_i, theta_o, phi, 550.0, side)
        for theta_i in (0.0, 30.0, 60.0)
        for side in (False, True)
        for phi in (0.0, 180.0)
        for theta_o in np.arange(2.5, 80, 2.5)
    ]
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return GonioData(*columns, bsdf_per_sr=np.ones(len(rows)), source="simulated")


def drawn_ink(rng: np.random.Generator) -> dict[str, float]:
    """An ink drawn at random."""
    return {
        "ink.scattering_per_mm": float(np.exp(rng.uniform(np.log(20), np.log(200)))),
        "ink.absorption_per_mm": float(np.exp(rng.uniform(np.log(0.2), np.log(5)))),
        "ink.asymmetry_parameter": float(rng.uniform(0.1, 0.85)),
    }


def sheets() -> dict[str, Sample]:
    """The sample of each measurement."""
    thin = jaxink.parse_sample(_SAMPLE)
    thick = thin.replace({"ink.thickness_um": 75})
    turned = turned_over(thick)
    assert turned is not None
    return dict(zip(SHEETS, (thin, thick, turned), strict=True))


def drawn(seed: int, wrong: str | None) -> jaxink.Project:
    """A project of the three sheets of a random ink; the readings of one of them are too large."""
    rng, at = np.random.default_rng(seed), directions()
    truth = drawn_ink(rng)
    exact = {
        name: jaxink.predict(sample.replace(truth), at) * (1 + GAIN * (name == wrong))
        for name, sample in sheets().items()
    }
    return project_of(exact, rng)


def project_of(seen: dict[str, np.ndarray], rng: np.random.Generator) -> jaxink.Project:
    """The project of the sheets as declared, with readings of what is given for each, and noise."""
    at, measurements = directions(), []
    for name, sample in sheets().items():
        exact = seen[name]
        sigma = np.hypot(_NOISE * exact, _FLOOR)
        values = np.maximum(exact + sigma * rng.standard_normal(len(at)), 1e-9)
        data = at.replace(bsdf_per_sr=values, sigma_per_sr=sigma)
        names = {p: p if p != "ink.thickness_um" else f"{name}/{p}" for p in sample.parameters}
        noise = dataclasses.replace(sample.noise, scan_relative=0.0)
        measurements.append(Measurement(name, data, dataclasses.replace(sample, noise=noise), names))
    return jaxink.Project(tuple(measurements))


def found(seed: int, wrong: str | None) -> dict:
    """What a joint fit says of it."""
    result = jaxink.fit(drawn(seed, wrong), options=jaxink.FitOptions(profile="none", accuracy=1e-3))
    compared = result.agreement
    assert compared is not None
    outlier = compared.outlier
    return {
        "seed": seed,
        "wrong": wrong,
        "disagrees": compared.disagrees,
        "probability": compared.probability,
        "named": outlier and outlier.name,
        "offset": outlier and outlier.offset,
        "reduced_chi_square": result.reduced_chi_square,
    }
