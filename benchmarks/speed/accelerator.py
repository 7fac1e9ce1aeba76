"""Work units, batches, fits and diagnoses on JAX's default device, for docs/performance.md.

python -m benchmarks.speed.accelerator RESULTS.json PART...   with JAX_PLATFORMS=cuda, then cpu

A part is ``units``, ``batches``, ``fit:NAME`` or ``diagnose:NAME`` of a simulated measurement. Results are
added to the file as they come. Every time is that of a whole call, which ends when the values are in the
host's memory.
"""

import json
import statistics
import sys
import time
from pathlib import Path

import jax
import numpy as np

import jaxink
from benchmarks.pages import machine
from benchmarks.simulated_data import data_file, declared_text
from benchmarks.speed.peers import ours
from benchmarks.speed.peers.units import SLABS, items, value_error
from benchmarks.speed.solver import W2_SIZES, matched, spectra
from jaxink.numerics.precision import computing

ROUNDS = 9
METHODS = "discrete_ordinates", "adding_doubling"
# Sizes at which docs/peers.md times each unit, or the next larger ones.
SIZES = {
    "W1": (16, 12, 32, 1),
    "W1 x 64": (16, 12, 32, 1),
    "W2": (24, 12, 48, 16),
    "W3a": (16, 14, 32, 16),
    "W3b": (16, 14, 48, 16),
    "W4": (24, 12, 48, 16),
    "W6": (24, 12, 48, 16),
    "whole sample": (16, 12, 32, 12),
}
RUNNERS = {"W4": ours.slab_with_jacobian, "W5": ours.spheres, "whole sample": ours.sample_with_jacobian}
SETS = 1, 4, 16, 64, 256, 1024


def timed(call) -> dict[str, float]:
    """Seconds of the first call, and the median of warm ones in milliseconds."""
    began = time.perf_counter()
    call()
    first_s = time.perf_counter() - began
    times = []
    for _ in range(ROUNDS):
        began = time.perf_counter()
        call()
        times.append(time.perf_counter() - began)
        if sum(times) > 20:
            break
    return {"first_s": first_s, "ms": 1e3 * statistics.median(times)}


def units(keep) -> None:
    """Every work unit by each layer method, with its error."""
    for unit in [*SIZES, "W5"]:
        for method in METHODS if unit != "W5" else ("",):
            call = RUNNERS.get(unit, ours.slab)(unit, (*SIZES.get(unit, ()), method))
            found = timed(call)
            found["ms"] /= items(unit)
            if unit in SLABS:
                found["error"] = value_error(unit, call(), {})
            keep(f"{unit}|{method}", found)


def batches(keep) -> None:
    """Time per set of parameters of W2, value and Jacobian, by the number of sets in a call."""
    from dataclasses import replace

    for method in METHODS:
        config = replace(W2_SIZES, layer_method=method)

        def value(parameters, config=config):
            return matched(parameters, config=config)

        for name, function in (("value", value), ("Jacobian", jax.jacfwd(value))):
            compiled = jax.jit(jax.vmap(function))
            for count in SETS:
                argument = np.asarray(spectra(count))
                found = timed(lambda c=compiled, a=argument: np.asarray(c(a)))
                found["ms"] /= count
                keep(f"{name} of W2 x {count}|{method}", found)
                if found["ms"] * count > 4000:
                    break


def fit(keep, name: str) -> None:
    """A fit from the declared file, first and again in the process."""
    seconds = []
    for _ in range(2):
        began = time.perf_counter()
        result = jaxink.fit(data_file(name), jaxink.parse_sample(declared_text(name), name))
        seconds.append(time.perf_counter() - began)
    jacobians = sum(search.jacobians for search in result.searches)
    keep(
        f"fit:{name}",
        {
            "first_s": seconds[0],
            "again_s": seconds[1],
            "jacobians": jacobians,
            "reduced_chi_square": result.verdict.reduced_chi_square,
            "found": {p.name: p.value for p in result.parameters.free},
        },
    )


def diagnose(keep, name: str) -> None:
    """A diagnosis from the declared file, first and again in the process."""
    seconds = []
    for _ in range(2):
        began = time.perf_counter()
        report = jaxink.diagnose(data_file(name), jaxink.parse_sample(declared_text(name), name))
        seconds.append(time.perf_counter() - began)
        verdict = report.verdict
        keep(
            f"diagnose:{name}",
            {"seconds": list(seconds), "verdict": " ".join([str(verdict.code), *verdict.effects])},
        )


def main() -> None:
    """Run the parts that are asked for."""
    target, *parts = sys.argv[1:]
    path = Path(target)
    kept = json.loads(path.read_text()) if path.exists() else {}
    device = jax.devices()[0]
    mine = kept.setdefault(f"{device.platform}: {device.device_kind}", {"machine": machine()})

    def keep(key: str, found: dict) -> None:
        mine[key] = found
        print(key, {k: round(v, 6) if isinstance(v, float) else v for k, v in found.items()}, flush=True)
        path.write_text(json.dumps(kept, indent=1) + "\n")

    for part in parts:
        kind, _, name = part.partition(":")
        if name:
            {"fit": fit, "diagnose": diagnose}[kind](keep, name)
        else:
            with computing():
                {"units": units, "batches": batches}[kind](keep)


if __name__ == "__main__":
    main()
