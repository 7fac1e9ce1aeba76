"""Jacobian with an absorption free at each wavelength; writes a section of docs/validation/time-to-answer.md.

python -m benchmarks.speed.spectrum [--before CHECKOUT] [--rounds N]

Two checkouts take turns, each in a process of its own, which waits while the other one works.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.checkouts import started
from benchmarks.pages import REPOSITORY, machine, table, write_section

KEPT = Path(__file__).with_suffix(".json")
PAGE, MARK = "time-to-answer.md", "made by python -m benchmarks.speed.spectrum"
COUNTS = 6, 12, 25, 50
INCIDENCES_DEG, VIEWS_DEG = (0.0, 30.0, 60.0), np.arange(-75.0, 76.0, 15.0)
SAMPLE = """
schema_version = 1
wavelength_nm = {waves}
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.49
thickness_mm = 2
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.55
thickness_um = 20
scattering_per_mm = {{ free = true, value = 200, min = 1, max = 1000 }}
absorption_per_mm = {{ per_wavelength = true, free = true, value = {values}, min = 0.01, max = 100 }}
asymmetry_parameter = {{ free = true, value = 0.7, min = 0, max = 0.95 }}
[noise]
relative = 0.01
"""


def work() -> None:
    """Answer with the seconds of a Jacobian whenever a number of wavelengths is asked for."""
    import jax

    from jaxink.fitting import make_objective
    from jaxink.fitting.compiled import CompiledObjective
    from jaxink.numerics.precision import computing

    with computing():
        made: dict[int, tuple] = {}
        for line in sys.stdin:
            n = int(line)
            if n not in made:
                waves = np.linspace(400, 700, n).round(1)
                text = SAMPLE.format(waves=waves.tolist(), values=(1 + np.arange(n) / n).tolist())
                columns = np.meshgrid(INCIDENCES_DEG, VIEWS_DEG, waves, [False, True], indexing="ij")
                theta_i, view, wave, side = (c.ravel() for c in columns)
                sample, phi = jaxink.parse_sample(text), np.where(view < 0, 180.0, 0.0)
                data = jaxink.GonioData(theta_i, np.abs(view), phi, wave, side, np.full(view.size, 0.1))
                compiled = CompiledObjective(
                    make_objective(data, sample, config=jaxink.SolverConfig(16, 12, 32, 12))
                )
                unit = np.full(n + 2, 0.4)
                compiled.prepare(unit, jacobian=True)
                made[n] = compiled, unit
            compiled, unit = made[n]
            times = []
            for _ in range(3):
                began = time.perf_counter()
                jax.block_until_ready(compiled.linearised(unit).jacobian)
                times.append(time.perf_counter() - began)
            print(float(np.median(times)), flush=True)


def main() -> None:
    """Time both versions, keep the medians, and write the section."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--before", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--work", action="store_true")
    asked = parser.parse_args()
    if asked.work:
        work()
        return
    versions = {"before": asked.before} if asked.before else {}
    running = {
        name: started(checkout, "benchmarks.speed.spectrum", "--work")
        for name, checkout in (versions | {"now": REPOSITORY}).items()
    }
    kept: dict = {"machine": machine(), "rounds": asked.rounds, "seconds": {}}
    for n in COUNTS:
        found: dict[str, list[float]] = {name: [] for name in running}
        for _ in range(asked.rounds):
            for name, process in running.items():
                assert process.stdin is not None
                assert process.stdout is not None
                process.stdin.write(f"{n}\n")
                process.stdin.flush()
                found[name].append(float(process.stdout.readline()))
        for name, rows in found.items():
            kept["seconds"].setdefault(name, []).append(float(np.median(rows)))
            print(n, name, kept["seconds"][name][-1], flush=True)
    for process in running.values():
        process.communicate()
    KEPT.write_text(json.dumps(kept, indent=1) + "\n")
    write(kept)


def write(kept: dict) -> None:
    """The section."""
    rows = []
    for name, title in (("before", "earlier version"), ("now", "now")):
        if name in kept["seconds"]:
            of = kept["seconds"][name]
            rows.append(
                [
                    title,
                    *(f"{seconds:.3g}" for seconds in of),
                    f"{of[-1] / of[0]:.1f}",
                ]
            )
    header = ["seconds", *(f"{n} wavelengths" for n in COUNTS), f"{COUNTS[-1]} : {COUNTS[0]}"]
    points = len(INCIDENCES_DEG) * len(VIEWS_DEG) * 2
    text = f"""## Many wavelengths

One value and Jacobian of a sample with the absorption free at each wavelength, besides two parameters
shared by all, {points} points per wavelength (`python -m benchmarks.speed.spectrum`, {kept["machine"]};
medians of {kept["rounds"]} rounds in which the versions took turns).

{table(header, rows)}

A parameter given at one wavelength affects the residuals of that wavelength alone. One derivative along
the common direction of one such parameter of each wavelength therefore yields all of them (Curtis, Powell,
Reid 1974), and a Jacobian takes as many derivatives as a wavelength has parameters, however many wavelengths
there are."""
    write_section(PAGE, MARK, text)


if __name__ == "__main__":
    main()
