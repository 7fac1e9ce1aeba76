"""What three measurements of one simulated ink lack: is it named, and where it is?

The measurements are those of `pull`, of samples that have one effect more than they declare.
"""

import dataclasses
import time

import numpy as np

import jaxink
from benchmarks.validation.joint.pull import SHEETS, directions, drawn_ink, project_of, sheets
from jaxink.diagnosis import JointDiagnosis
from jaxink.effects import CATALOGUE, Case, Scene, declare
from jaxink.sample import Sample

_CLASSES = {effect.name: effect for effect in CATALOGUE}


@dataclasses.dataclass(frozen=True)
class Lack:
    """An effect that is not declared, the sheets that have it, and its parameters by their last part."""

    effect: str = ""
    sheets: tuple[str, ...] = SHEETS
    values: tuple[tuple[str, float], ...] = ()


LACKS = {
    "nothing": Lack(),
    "gain of one": Lack("gain", ("thick",), (("relative", 0.03),)),
    "stray light of all": Lack("stray_light", SHEETS, (("level_per_sr", 0.003),)),
    "absorbing plate": Lack("plate_absorption", SHEETS, (("absorption_per_mm", 0.03),)),
    "arm offset of one": Lack("angle_offset", ("thick_lit_ink",), (("deg", 0.4),)),
    "second lobe": Lack(
        "second_lobe", SHEETS, (("second_weight", 0.2), ("second_asymmetry_parameter", -0.4))
    ),
}


def with_effect(sample: Sample, lack: Lack) -> Sample:
    """The sample with the effect, at its true values."""
    at = directions()
    scene = Scene.of_used(at)
    form = _CLASSES[lack.effect].forms(Case(sample, scene, 0.005, 1e-3))[0]
    values = {
        term.name: value for term in form.terms for key, value in lack.values if term.name.endswith(key)
    }
    return declare(sample, (form,), values)


def found(seed: int, kind: str) -> dict:
    """What the diagnosis says of a random ink with an effect."""
    lack, rng = LACKS[kind], np.random.default_rng(100 + seed)
    truth = drawn_ink(rng)
    seen = {name: sample.replace(truth) for name, sample in sheets().items()}
    if lack.effect:
        seen |= {name: with_effect(seen[name], lack) for name in lack.sheets}
    project = project_of({name: jaxink.predict(one, directions()) for name, one in seen.items()}, rng)
    began = time.perf_counter()
    options = jaxink.DiagnosisOptions(fit=jaxink.FitOptions(profile="none", accuracy=1e-3))
    made = jaxink.diagnose(project, options=options)
    return found_by(made, seed, kind, lack, truth, time.perf_counter() - began)


def found_by(
    made: JointDiagnosis, seed: int, kind: str, lack: Lack, truth: dict[str, float], seconds: float
) -> dict:
    """A row of the results."""

    def worst(result):
        rows = (result.parameters[name] for name in truth)
        return max(abs(p.value - truth[p.name]) / p.standard_error for p in rows if p.standard_error)

    return {
        "seed": seed,
        "kind": kind,
        "effect": lack.effect,
        "sheets": list(lack.sheets) if lack.effect else [],
        "steps": [[step.effect, list(step.measurements), step.statement] for step in made.steps],
        "alike": [list(step.alike) for step in made.steps],
        "reduced": [made.declared.reduced_chi_square, made.corrected.reduced_chi_square],
        "worst_parameter": [worst(made.declared), worst(made.corrected)],
        "causes": made.n_candidates,
        "seconds": seconds,
        "failures": [failure.sentence for failure in made.failures],
    }
