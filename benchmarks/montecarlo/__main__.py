"""Totals, and the BSDF in the plane of incidence, of a sample described in a JSON file.

python -m benchmarks.montecarlo SAMPLE.json [--theta DEGREES] [--photons N] [--seed N]
"""

import argparse
import json
from pathlib import Path

import numpy as np

from benchmarks.montecarlo.counts import Result
from benchmarks.montecarlo.photons import simulate
from benchmarks.montecarlo.sample import Detectors, sample_from


def main():
    """Print both."""
    parser = argparse.ArgumentParser(description="Light from a stack of layers by Monte Carlo.")
    parser.add_argument("sample", type=Path, help="JSON file with the fields of Sample")
    parser.add_argument("--theta", type=float, default=0.0, help="incidence in degrees")
    parser.add_argument("--photons", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    sample = sample_from(json.loads(arguments.sample.read_text(encoding="utf-8")))
    theta = np.arange(-80.0, 81.0, 10.0)
    sides = (False,) if sample.backing_albedo is not None else (False, True)
    side = np.repeat(sides, theta.size)
    signed = np.tile(theta, len(sides))
    detectors = Detectors(np.abs(signed), np.where(signed < 0, 0.0, 180.0), side)
    seen = sample.seen_radius_mm is not None
    result = simulate(sample, arguments.theta, arguments.photons, arguments.seed, None if seen else detectors)
    for name, batches in result.powers.items():
        print("{:12s} {:.6f} +- {:.6f}".format(name, *Result.mean_and_error(batches)))
    if result.bsdf is not None:
        for angle, far, value, error in zip(signed, side, *Result.mean_and_error(result.bsdf), strict=True):
            print(f"{'T' if far else 'R'} {angle:6.1f} deg {value:.6f} +- {error:.6f} 1/sr")


if __name__ == "__main__":
    main()
