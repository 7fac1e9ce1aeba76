"""Compare the speed of two trees of jaxink, interleaved in one run.

python -m benchmarks.speed.compare BEFORE AFTER [ROUNDS]

Each tree, a checkout of any commit, runs in its own process; the processes take turns, in random order, while
the other one waits. W2 and W4 are those of peers.md, here as samples: a layer without an index step, its
BSDF, and its BSDF with the Jacobian in three parameters. The whole sample is the embedded one.
"""

import json
import os
import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

LAYER = """
schema_version = 1
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.0
thickness_um = 1000
scattering_per_mm = { value = 39.96, free = true, min = 1, max = 100 }
absorption_per_mm = { value = 0.04, free = true, min = 0, max = 10 }
asymmetry_parameter = { value = 0.85, free = true, min = 0, max = 0.95 }
"""
INCIDENCES_DEG = (0.0, 15.0, 30.0, 45.0, 60.0)
VIEWS_DEG = (*np.arange(0.0, 88.0, 2.5), 89.0)
CALLS = 7


def cases() -> dict:
    """A compiled function and its argument for each case."""
    import jax
    import jax.numpy as jnp

    import jaxink
    from jaxink.data import simulated_example

    grid = np.meshgrid(INCIDENCES_DEG, VIEWS_DEG, [0.0, 180.0], [False, True], indexing="ij")
    theta_i, theta_o, phi, side = (axis.ravel() for axis in grid)
    columns = (theta_i, theta_o, phi, np.full(side.size, 550.0), side)
    table, file = simulated_example()
    models = {
        ("W2", "W4"): jaxink.ForwardModel(
            jaxink.parse_sample(LAYER), *columns, jaxink.SolverConfig(24, 12, 48, 16)
        ),
        ("whole sample", "whole sample, Jacobian"): jaxink.ForwardModel(
            jaxink.load_sample(file), *jaxink.read(table).directions, jaxink.SolverConfig(16, 12, 32, 12)
        ),
    }
    found = {}
    for names, model in models.items():
        free = [p for p in model.sample.parameters.values() if p.free]
        start = model.sample.parameters.values_with({})
        at = jnp.array([float(start[p.name]) for p in free])

        def bsdf(x, model=model, free=free):
            return model.bsdf({p.name: x[k] for k, p in enumerate(free)})

        def twice(x, bsdf=bsdf):
            y = bsdf(x)
            return y, y

        found[names[0]] = jax.jit(bsdf), at
        found[names[1]] = jax.jit(jax.jacfwd(twice, has_aux=True)), at
    return found


def work() -> None:
    """Answer with the median time of some calls whenever a case is asked for."""
    import jax

    from jaxink.numerics.precision import computing

    with computing():
        ready = cases()
        for function, at in ready.values():
            jax.block_until_ready(function(at))
        print(json.dumps(list(ready)), flush=True)
        for line in sys.stdin:
            function, at = ready[line.strip()]
            seconds = []
            for _ in range(CALLS):
                began = time.perf_counter()
                jax.block_until_ready(function(at))
                seconds.append(time.perf_counter() - began)
            print(json.dumps(float(np.median(seconds))), flush=True)


def compare(trees: list[str], rounds: int) -> None:
    """Print the medians of both trees and of their ratio, with its quartiles."""
    workers = []
    for tree in trees:
        environment = os.environ | {"PYTHONPATH": str(Path(tree).resolve() / "src")}
        command = [sys.executable, __file__, "--work"]
        workers.append(
            subprocess.Popen(
                command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
        )
    names = [json.loads(worker.stdout.readline()) for worker in workers][0]
    seconds = {name: ([], []) for name in names}
    for _ in range(rounds):
        for name in names:
            for k in random.sample([0, 1], 2):
                print(name, file=workers[k].stdin, flush=True)
                seconds[name][k].append(json.loads(workers[k].stdout.readline()))
    for worker in workers:
        worker.communicate()
    print("| case | before, ms | after, ms | after / before (quartiles) |\n|---|---|---|---|")
    for name, (before, after) in seconds.items():
        low, middle, high = np.quantile(np.divide(after, before), [0.25, 0.5, 0.75])
        times = " | ".join(f"{1e3 * np.median(column):.2f}" for column in (before, after))
        print(f"| {name} | {times} | {middle:.3f} ({low:.3f} to {high:.3f}) |")


if __name__ == "__main__":
    if sys.argv[1:] == ["--work"]:
        work()
    else:
        compare(sys.argv[1:3], int(sys.argv[3]) if len(sys.argv) > 3 else 60)
