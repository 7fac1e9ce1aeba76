"""Fits with noise relative to each reading itself, to its neighbours, and to the truth: which are biased.

python -m benchmarks.validation.noise.own_reading [NUMBER OF DRAWS]
"""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.validation.noise.coverage import CONFIG, DESIGNS, SAMPLE, exact_measurement
from jaxink.data import SIMULATED_TRUTH
from jaxink.measurement import GonioData, Noise
from jaxink.sample import Sample

RESULTS = Path(__file__).with_name("own_reading.json")
EXACT = exact_measurement(DESIGNS["in plane, scan factors 0.0%, stated"])
LEVELS = (0.005, 0.03, 0.1)


def with_sigma(data: GonioData, relative: float, kind: str) -> tuple[GonioData, Sample]:
    """Measurement and sample with noise of one kind, whose share is stated as it is."""
    if kind == "neighbours":
        noise = Noise(relative=relative, scan_relative=0.0, use_file_sigma=False)
    else:
        values = {"itself": data.bsdf_per_sr, "truth": EXACT.bsdf_per_sr}[kind]
        data, noise = data.replace(sigma_per_sr=relative * values), Noise(scan_relative=0.0)
    return data, dataclasses.replace(SAMPLE, noise=noise)


def fits_of(relative: float, kind: str, n_draws: int) -> dict[str, dict[str, float]]:
    """Mean relative error of each parameter over the draws, and mean error over the standard error."""
    options = jaxink.FitOptions(config=CONFIG, profile="none")
    errors, pulls = [], []
    for seed in range(n_draws):
        noise = np.random.default_rng(seed).normal(size=EXACT.bsdf_per_sr.size)
        data = EXACT.replace(bsdf_per_sr=EXACT.bsdf_per_sr * (1 + relative * noise))
        found = jaxink.fit(*with_sigma(data, relative, kind), options)
        for name, truth in SIMULATED_TRUTH.items():
            errors.append(found[name].value / truth - 1)
            # A fit that does not agree with its noise has no standard errors.
            error = found[name].standard_error
            pulls.append(np.nan if error is None else (found[name].value - truth) / error)
    shape = n_draws, len(SIMULATED_TRUTH)
    columns = zip(SIMULATED_TRUTH, np.reshape(errors, shape).T, np.reshape(pulls, shape).T, strict=True)
    return {
        name: {
            "error": float(f"{error.mean():.3g}"),
            "of_error": float(f"{error.std(ddof=1) / np.sqrt(n_draws):.2g}"),
            "pull": float(f"{np.nanmean(pull):.3g}"),
            "without": int(np.isnan(pull).sum()),
        }
        for name, error, pull in columns
    }


def main(n_draws: int) -> None:
    """Fit all draws, and keep what they say."""
    kept = {"draws": n_draws, "found": {}}
    for relative in LEVELS:
        for kind in ("itself", "neighbours", "truth"):
            kept["found"][f"{relative} {kind}"] = fits_of(relative, kind, n_draws)
            print(relative, kind, kept["found"][f"{relative} {kind}"], flush=True)
    RESULTS.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
