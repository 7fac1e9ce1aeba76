"""Diagnoses of noise draws in which nothing is missing, with stated noise and without.

python -m benchmarks.validation.noise.false_alarms [NUMBER OF DRAWS]

Effects that need no compiled program of their own are looked for: the others take too long for many draws.
"""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.validation.noise.coverage import CONFIG, DESIGNS, RELATIVE, SAMPLE, Design, exact_measurement
from jaxink.diagnosis import VerdictCode
from jaxink.effects import CATALOGUE, Case, Scene, effects_for
from jaxink.sample import Noise

RESULTS = Path(__file__).with_name("false_alarms.json")
FIT = jaxink.FitOptions(profile="none", config=CONFIG)


def diagnoses_of(design: Design, n_draws: int) -> dict:
    """How many diagnoses find an effect, and how many call the residual a misfit."""
    exact = exact_measurement(design)
    noise = Noise(use_file_sigma=False)
    if design.is_stated:
        noise = Noise(relative=RELATIVE, scan_relative=design.scan_relative, use_file_sigma=False)
    sample = dataclasses.replace(SAMPLE, noise=noise)
    scene = Scene.of(*exact.directions, row=exact.reading_order)
    forms = effects_for(Case(sample, scene, RELATIVE, FIT.accuracy), CATALOGUE).forms
    shared = tuple(dict.fromkeys(type(form) for form in forms if not form.own_program))
    options = jaxink.DiagnosisOptions(catalogue=shared, fit=FIT)
    named, misfits = [], 0
    for seed in range(n_draws):
        random = np.random.default_rng(seed)
        factor = (1 + design.scan_relative * random.normal(size=len(exact.scans)))[exact.scan_index]
        factor = factor * (1 + RELATIVE * random.normal(size=factor.size))
        found = jaxink.diagnose(exact.replace(bsdf_per_sr=exact.bsdf_per_sr * factor), sample, options)
        named += [[seed, *found.verdict.effects]] if found.steps else []
        misfits += found.verdict.code not in (VerdictCode.NO_MISFIT, VerdictCode.ORDER_REMAINS)
    return {"draws": n_draws, "effects": len(shared), "named": named, "misfits": misfits}


def main(n_draws: int) -> None:
    """Diagnose all draws of the designs in the plane of incidence, and keep what was found."""
    kept = {}
    for name, design in DESIGNS.items():
        if name.startswith("in plane"):
            kept[name] = diagnoses_of(design, n_draws)
            print(name, kept[name], flush=True)
            RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 50)
