"""Seconds and memory of a fit against the number of wavelengths, each with an absorption of its own.

Each number of wavelengths is fitted in a process of its own, whose programs nobody has stored: first, again
in the same process, and its largest memory. Writes a section of docs/validation/time-to-answer.md.

python -m benchmarks.speed.many_wavelengths
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.pages import machine, table, write_section
from benchmarks.speed.spectrum import INCIDENCES_DEG, PAGE, SAMPLE, VIEWS_DEG

KEPT = Path(__file__).with_suffix(".json")
MARK = "made by python -m benchmarks.speed.many_wavelengths"
COUNTS = 7, 31, 101, 201, 401


def fitted(n: int) -> dict:
    """Fit n wavelengths twice."""
    import jaxink

    waves = np.linspace(400, 800, n)
    text = SAMPLE.format(waves=waves.tolist(), values=np.full(n, 2.0).tolist())
    sample = jaxink.parse_sample(text)
    columns = np.meshgrid(INCIDENCES_DEG, VIEWS_DEG, waves, [False, True], indexing="ij")
    theta_i, view, wave, side = (c.ravel() for c in columns)
    phi = np.where(view < 0, 180.0, 0.0)
    at = jaxink.GonioData(theta_i, np.abs(view), phi, wave, side, np.full(view.size, 0.1))
    # A smooth absorption band, half as much scattering again, and noise of the declared 1 %.
    band = {
        f"ink.absorption_per_mm@{wave:g}": 0.5 + 5 * np.exp(-(((wave - 550) / 60) ** 2)) for wave in waves
    }
    known = {name: band[name] for name in sample.parameters if name in band}
    assert len(known) == n, "one absorption for each wavelength"
    true = sample.replace(known | {"ink.scattering_per_mm": 300.0})
    exact = jaxink.predict(true, at)
    noise = np.random.default_rng(n).standard_normal(exact.size)
    data = at.replace(bsdf_per_sr=exact * (1 + 0.01 * noise))
    options, seconds = jaxink.FitOptions(profile="none", accuracy=1e-3), []
    for _ in range(2):
        began = time.perf_counter()
        result = jaxink.fit(data, sample, options)
        seconds.append(time.perf_counter() - began)
    return {
        "seconds": seconds,
        "jacobians": result.searches[0].jacobians,
        "reduced_chi_square": result.merit.reduced_chi_square,
        "memory_gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
    }


def main() -> None:
    """Time what is asked for, keep it, and write the section."""
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(fitted(int(sys.argv[2]))))
        return
    kept = {}
    for n in COUNTS:
        command = [sys.executable, "-m", "benchmarks.speed.many_wavelengths", "--one", str(n)]
        with tempfile.TemporaryDirectory() as store:
            environment = os.environ | {"JAXINK_CACHE_DIR": store}
            done = subprocess.run(command, env=environment, check=True, stdout=subprocess.PIPE, text=True)
        kept[n] = json.loads(done.stdout)
        print(n, kept[n], flush=True)
    KEPT.write_text(json.dumps({"machine": machine(), "by_count": kept}, indent=1) + "\n", encoding="utf-8")
    rows = [
        [
            str(n),
            f"{one['seconds'][0]:.1f}",
            f"{one['seconds'][1]:.1f}",
            str(one["jacobians"]),
            f"{1000 * one['seconds'][1] / n:.0f}",
            f"{one['memory_gib']:.2f}",
            f"{one['reduced_chi_square']:.3f}",
        ]
        for n, one in kept.items()
    ]
    counts = np.array(COUNTS[1:], float)
    again = np.array([kept[n]["seconds"][1] for n in COUNTS[1:]])
    slope = np.polyfit(np.log(counts), np.log(again), 1)[0]
    heads = ["wavelengths", "first, s", "again, s", "Jacobians", "again, ms a wavelength", "memory, GiB"]
    text = f"""## Fits of whole spectra

A fit of a **simulated** ink with a free absorption at each wavelength, a scattering coefficient and an
asymmetry parameter; {len(INCIDENCES_DEG) * len(VIEWS_DEG) * 2} points at each wavelength, accuracy 1e-3
({machine()}). First: nothing is compiled or stored.

{table([*heads, "reduced chi-square"], rows)}

From {COUNTS[1]} wavelengths on, the time of a fit again grows as their number to the power {slope:.2f}.
"""
    write_section(PAGE, MARK, text)


if __name__ == "__main__":
    main()
