"""Do the standard errors that a plan foresees hold?

Random inks of unknown thickness are simulated by the forward model and measured once, which determines only
the product of thickness and concentration. The first measurement of the plan is then simulated with the
plan's noise, added, and fitted, with ten draws of all noise.
"""

import dataclasses

import numpy as np

import jaxink
from benchmarks.validation.joint.next_one import joint_with_first, noisy
from benchmarks.validation.joint.pull import directions, drawn_ink, sheets
from jaxink.fitting import FitOptions
from jaxink.sample import Sample

DRAWS = 10
_OPTIONS = FitOptions(profile="none", accuracy=1e-3)
_NOISE = 0.005
_THICKNESS = "ink.thickness_um"


def _sample() -> Sample:
    """The thin sheet, of which no one knows the thickness."""
    thin = sheets()["thin"]
    table = thin.parameters.replace(_THICKNESS, free=True, minimum=15.0, maximum=60.0)
    noise = dataclasses.replace(thin.noise, scan_relative=0.0)
    return dataclasses.replace(thin, parameters=table, noise=noise)


def found(seed: int) -> dict:
    """Foreseen and fitted standard errors of one ink, and distances from the truth."""
    rng, sample = np.random.default_rng(300 + seed), _sample()
    truth = drawn_ink(rng) | {_THICKNESS: float(rng.uniform(20, 45))}
    seen, plan, draws = sample.replace(truth), None, []
    for _ in range(DRAWS):
        data = noisy(directions(), seen, rng, lambda f: _NOISE * f)
        before = jaxink.fit(data, sample, _OPTIONS)
        plan = plan or jaxink.plan_measurement(before)
        after = joint_with_first(before, plan, truth, rng)
        draws.append({n: [after[n].value - truth[n], after[n].standard_error] for n in truth})
    assert plan is not None
    return {
        "truth": truth,
        "undetermined": list(plan.undetermined),
        "measurement": plan.best.words,
        "now": plan.targets,
        "foreseen": plan.best.standard_errors,
        "ranges": plan.best.ranges,
        "draws": draws,
    }
