"""What readings of a sphere say of four simulated prints of one ink that lack an effect.

Each print has a total reflectance, a total transmittance and a collimated transmittance.
"""

import dataclasses
import time

import numpy as np

import jaxink
from benchmarks.validation.joint.lacking import Lack, found_by, with_effect
from benchmarks.validation.joint.pull import drawn_ink, sheets
from jaxink.measurement import Readings
from jaxink.projects import Measurement, Project
from jaxink.sample import Sample

_NOISE = 0.003
_QUANTITIES = {"R_total": 8.0, "T_total": 8.0, "T_collimated": 0.0}
PRINTS = {f"print_{thickness_um}": float(thickness_um) for thickness_um in (10, 20, 40, 80)}
LACKS = {
    "nothing": Lack(),
    "gain of one": Lack("gain", ("print_40",), (("relative", 0.03),)),
    "absorbing plate": Lack("plate_absorption", tuple(PRINTS), (("absorption_per_mm", 0.03),)),
    "second lobe": Lack(
        "second_lobe", tuple(PRINTS), (("second_weight", 0.2), ("second_asymmetry_parameter", -0.4))
    ),
}


def _read(sample: Sample, rng: np.random.Generator) -> Readings:
    n = len(_QUANTITIES)
    none = np.full(n, np.nan)
    columns = np.array(list(_QUANTITIES)), np.array(list(_QUANTITIES.values())), none, none, np.full(n, 550.0)
    at = Readings(*columns, np.full(n, 0.5))
    value = jaxink.predict(sample, at)
    noisy = value * (1 + _NOISE * rng.standard_normal(n))
    return dataclasses.replace(at, value=noisy, sigma=_NOISE * value)


def found(seed: int, kind: str) -> dict:
    """What the diagnosis says of a random ink with an effect."""
    lack, rng = LACKS[kind], np.random.default_rng(200 + seed)
    truth, declared = drawn_ink(rng), sheets()["thin"]
    measurements = []
    for name, thickness_um in PRINTS.items():
        own = {"ink.thickness_um": thickness_um}
        seen, sample = declared.replace(truth | own), declared.replace(own)
        data = _read(with_effect(seen, lack) if name in lack.sheets and lack.effect else seen, rng)
        names = {p: f"{name}/{p}" if p in own else p for p in sample.parameters}
        measurements.append(Measurement(name, data, sample, names))
    began = time.perf_counter()
    options = jaxink.DiagnosisOptions(fit=jaxink.FitOptions(profile="none", accuracy=1e-3))
    made = jaxink.diagnose(Project(tuple(measurements)), options=options)
    return found_by(made, seed, kind, lack, truth, time.perf_counter() - began)
