"""Work units, batches, fits and diagnoses on JAX's default device, for docs/validation/performance.md.

python -m benchmarks.speed.accelerator RESULTS.json PART...   with JAX_PLATFORMS=cuda, then cpu
python -m benchmarks.speed.accelerator --page                 from benchmarks/speed/accelerator.json

A part is ``units``, ``batches``, ``fit:NAME`` or ``diagnose:NAME`` of a simulated measurement. Results are
added to the file as they come. Every time is that of a whole call, which ends when the values are in the
host's memory.
"""

import json
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import jax
import numpy as np

import jaxink
from benchmarks.pages import filled, machine, table, write_section
from benchmarks.simulated_data import data_file, declared_text
from benchmarks.speed.peers import ours
from benchmarks.speed.peers.units import SLABS, items, value_error
from benchmarks.speed.solver import ACCELERATOR, PAGE, W2_SIZES, matched, median_ms, spectra
from jaxink.numerics.precision import computing

KEPT = Path(__file__).with_suffix(".json")
TEMPLATE = Path(__file__).with_suffix(".md.in")
METHODS = "discrete_ordinates", "adding_doubling"
# Close to those at which docs/validation/peers.md times each unit.
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
    first_s, _ = seconds_of(call)
    return {"first_s": first_s, "ms": median_ms(call, most_s=20)}


def seconds_of(call) -> tuple[float, Any]:
    """Time of one call, and what it returns."""
    began = time.perf_counter()
    found = call()
    return time.perf_counter() - began, found


def units(keep) -> None:
    """Every work unit by each layer method, with its error."""
    for unit in [*SIZES, "W5"]:
        for method in METHODS if unit in SIZES else ("",):
            call = RUNNERS.get(unit, ours.slab)(unit, (*SIZES.get(unit, ()), method))
            found = timed(call)
            found["ms"] /= items(unit)
            if unit in SLABS:
                found["error"] = value_error(unit, call(), {})
            keep(f"{unit}|{method}", found)


def batches(keep) -> None:
    """Time per set of parameters of W2, value and Jacobian, by the number of sets in a call."""
    for method in METHODS:
        value = partial(matched, config=replace(W2_SIZES, layer_method=method))
        for name, function in (("value", value), ("Jacobian", jax.jacfwd(value))):
            compiled = jax.jit(jax.vmap(function))
            for count in SETS:
                argument = np.asarray(spectra(count))
                found = timed(lambda c=compiled, a=argument: np.asarray(c(a)))
                found["ms"] /= count
                keep(f"{name} of W2 x {count}|{method}", found)


def twice(work, name: str) -> tuple[dict[str, float], Any]:
    """Times of a fit or a diagnosis from the declared file, first and again in the process."""
    sample = jaxink.parse_sample(declared_text(name), name)
    (first_s, _), (again_s, found) = (seconds_of(lambda: work(data_file(name), sample)) for _ in range(2))
    return {"first_s": first_s, "again_s": again_s}, found


def fit(keep, name: str) -> None:
    """A fit and what it found."""
    seconds, result = twice(jaxink.fit, name)
    about = {
        "jacobians": sum(search.jacobians for search in result.searches),
        "reduced_chi_square": result.verdict.reduced_chi_square,
        "found": {p.name: p.value for p in result.parameters.free},
    }
    keep(f"fit:{name}", seconds | about)


def diagnose(keep, name: str) -> None:
    """A diagnosis and its verdict."""
    seconds, report = twice(jaxink.diagnose, name)
    keep(f"diagnose:{name}", seconds | {"verdict": " ".join([report.verdict.code, *report.verdict.effects])})


def page(kept: dict) -> None:
    """Write the section of docs/validation/performance.md."""
    host, gpu = (next(kept[key] for key in kept if key.startswith(kind)) for kind in ("cpu", "gpu"))

    def cell(device: dict, key: str, time_of: str = "ms") -> str:
        return f"{device[key][time_of]:.3g}" if key in device else "not run"

    def rows(names: dict[str, str]) -> list[list[str]]:
        """Rows by the key of what was measured."""
        columns = [(device, method) for device in (gpu, host) for method in METHODS]
        return [[n, *(cell(d, f"{key}|{m}") for d, m in columns)] for key, n in names.items()]

    header = [f"{where}, {m.replace('_', ' ')}" for where in ("GPU", "host") for m in METHODS]
    each = {f"{n} of W2 x {c}": f"{n}, {c}" for n in ("value", "Jacobian") for c in SETS}
    tasks = [key for key in gpu if ":" in key]
    longer = [
        [f"`{t}`", *(cell(d, t, s) for d in (gpu, host) for s in ("first_s", "again_s"))] for t in tasks
    ]

    def gain(what: str) -> str:
        key = f"{what} of W2 x 64|{METHODS[0]}"
        return f"{host[key]['ms'] / gpu[key]['ms']:.0f}"

    name = next(key for key in kept if key.startswith("gpu")).removeprefix("gpu: ")
    parts = {
        "device": name,
        "machine": gpu["machine"].replace("gpu, ", ""),
        "units": table(["unit, ms", *header], rows({u: u for u in SIZES})),
        "spheres_gpu": cell(gpu, "W5|"),
        "spheres_host": cell(host, "W5|"),
        "batches": table(["W2: what, number of sets; ms per set", *header], rows(each)),
        "tasks": table(
            ["task", *(f"{w}, {s} call, s" for w in ("GPU", "host") for s in ("first", "second"))], longer
        ),
        "gain_value": gain("value"),
        "gain_jacobian": gain("Jacobian"),
    }
    write_section(PAGE, ACCELERATOR, filled(TEMPLATE, **parts))


def main() -> None:
    """Run the parts that are asked for, or write the page."""
    if sys.argv[1:] == ["--page"]:
        page(json.loads(KEPT.read_text()))
        return
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
