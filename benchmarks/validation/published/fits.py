"""Fit the published reconstructions, and keep what was found in kept/NAME-SCANS.json.

python -m benchmarks.validation.published.fits [NAME ...]

Every fit that is not kept yet is made; with names of reconstructions, only theirs. Remove a file to repeat
its fit.
"""

import dataclasses
import json
import sys
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.validation.published.judgement import inside, loss_at, misfits, truth_values, with_values
from benchmarks.validation.published.problems import EVERYTHING, NAMES, WHITE, Problem, problem, variants
from jaxink.fitting import FitOptions, FitResult, JointResult
from jaxink.numerics.precision import computing
from jaxink.sample import Sample, parse_sample, sample_text

KEPT = Path(__file__).parent / "kept"


@dataclasses.dataclass(frozen=True)
class Found:
    """What one fit found.

    Parameters
    ----------
    sample
        With the fitted values.
    outcome, converged
        How it ended, in words, and whether in a minimum.
    effort
        Jacobians and evaluations, and seconds of the searches without compilation.
    parameters
        Value, standard error (None if there is none), flag and interval by name.
    derived
        The same of the coefficients that follow.
    weakest
        Change of the logarithm of each parameter by one standard error along the combination that the data
        determine least; empty without a covariance.
    """

    sample: Sample
    outcome: str
    converged: bool
    effort: dict[str, float]
    parameters: dict[str, dict]
    derived: list[dict]
    weakest: dict[str, float]


def fit(one: Problem) -> Found:
    """Fit one problem by the default method of jaxink: a measurement, or a project of two."""
    profile = "auto" if one.name.startswith(WHITE) else "none"
    options = FitOptions(objective=one.kind, profile=profile)
    if len(one.measurements) > 1:
        joint = jaxink.fit(one.project, options=options)
        return _found(joint, with_values(one.sample, joint.values), [])
    result = jaxink.fit(one.data, one.sample, options)
    derived = [
        {
            "quantity": d.quantity,
            "wavelength_nm": d.wavelength_nm,
            "value": d.value,
            "standard_error": d.standard_error,
        }
        for d in result.derived
    ]
    return _found(result, result.sample, derived)


def _found(result: FitResult | JointResult, sample: Sample, derived: list[dict]) -> Found:
    free = {
        p.name: {"value": p.value, "standard_error": p.standard_error, "flag": p.flag, "interval": p.interval}
        for p in result.parameters.free
    }
    covariance = result.covariance
    weakest = _weakest(free, covariance.names, np.asarray(covariance.matrix)) if covariance.names else {}
    return Found(
        sample,
        result.outcome.value,
        result.outcome.converged,
        _effort(result.searches),
        free,
        derived,
        weakest,
    )


def _effort(searches) -> dict[str, float]:
    return {
        "jacobians": sum(s.jacobians for s in searches),
        "evaluations": sum(s.evaluations for s in searches),
        "run_seconds": sum(s.run_seconds for s in searches),
    }


def _weakest(parameters: dict[str, dict], names, matrix: np.ndarray) -> dict[str, float]:
    """Largest principal axis of the covariance of the logarithms, of the parameters that have an error."""
    values = np.array([parameters[name]["value"] for name in names])
    known = np.array([parameters[name]["standard_error"] is not None for name in names], bool) & (values != 0)
    if not known.any():
        return {}
    block = matrix[np.ix_(known, known)] / np.outer(values[known], values[known])
    size, axes = np.linalg.eigh(block)
    along = axes[:, -1] * np.sqrt(size[-1])
    along *= np.sign(along[np.argmax(np.abs(along))])
    return dict(zip(np.array(list(names))[known].tolist(), along.tolist(), strict=True))


def kept_file(name: str, scans: str) -> Path:
    """Where one fit is kept."""
    return KEPT / f"{name}-{scans}.json"


def kept(name: str, scans: str) -> dict:
    """One fit as it was kept."""
    return json.loads(kept_file(name, scans).read_text(encoding="utf-8"))


def made(name: str) -> tuple[str, ...]:
    """What is kept of one reconstruction, of its variants."""
    return tuple(scans for scans in variants(name) if kept_file(name, scans).exists())


def kept_sample(name: str, scans: str) -> Sample:
    """The sample that it found."""
    return parse_sample(kept(name, scans)["sample"], f"{name}, {scans}")


def reference(name: str, scans: str) -> Sample | None:
    """A sample that a search should not miss.

    The truth of spheres, or the Henyey-Greenstein fit of everything; None if that has other parameters.
    """
    sample = problem(name, scans).sample
    free = {p.name for p in sample.parameters.free}
    if name.endswith("-mie"):
        return with_values(sample, truth_values(name))
    values = {key: p["value"] for key, p in kept(name, EVERYTHING)["parameters"].items()}
    return with_values(sample, values) if free == values.keys() else None


def keep(name: str, scans: str) -> None:
    """Make one fit, compare it with what was measured and with the truth, and keep it."""
    one = problem(name, scans)
    began = time.perf_counter()
    with computing():
        found = fit(one)
    seconds = time.perf_counter() - began
    text = sample_text(found.sample)
    plain = dataclasses.asdict(dataclasses.replace(found, sample=text))
    plain |= {
        "kind": one.kind,
        "seconds": round(seconds, 1),
        "points": sum(int(d.used.sum()) for d, _ in one.measurements),
    }
    plain |= {"misfits": misfits(name, found.sample), "inside": inside(name, found.sample)}
    _write(name, scans, plain | {"loss": loss_at(one, found.sample)})


def _write(name: str, scans: str, plain: dict) -> None:
    KEPT.mkdir(exist_ok=True)
    temporary = kept_file(name, scans).with_suffix(".tmp")
    temporary.write_text(json.dumps(_short(plain), indent=1) + "\n", encoding="utf-8")
    temporary.replace(kept_file(name, scans))


def _short(value):
    """Numbers with six digits."""
    if isinstance(value, dict):
        return {key: _short(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_short(inner) for inner in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def make_missing(names) -> None:
    """Make every fit of some reconstructions that is not kept yet."""
    for name in names:
        for scans in variants(name):
            if not kept_file(name, scans).exists():
                keep(name, scans)
                found = kept(name, scans)
                print(name, scans, found["outcome"], found["seconds"], "s", flush=True)
        for scans in variants(name):
            found = kept(name, scans)
            if "loss_at_reference" not in found:
                sample = reference(name, scans)
                loss = None if sample is None else loss_at(problem(name, scans), sample)
                _write(name, scans, found | {"loss_at_reference": loss})


if __name__ == "__main__":
    make_missing(sys.argv[1:] or NAMES)
