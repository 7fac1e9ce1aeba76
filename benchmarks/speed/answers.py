"""How long a person waits for a fit and for a diagnosis; writes docs/validation/time-to-answer.md.

python -m benchmarks.speed.answers [--before CHECKOUT] [--runs N] [COMMAND:NAME ...]

Each command runs in a fresh process on a simulated measurement, first with nothing stored, then with the
programs that the first run stored; and the library runs it twice in one process, of which the second run
counts. Another checkout of jaxink takes turns with this one. A run is kept with the commit that last changed
the source, and with the speed of the machine meanwhile. A name with "+" is a design with a pattern of
benchmarks.validation.outside, which no effect of the catalogue describes. A name with "@init" has the sample
file that `jaxink init` writes from the measurement alone.
"""

import argparse
import compileall
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.pages import machine, section_after, table, write_page
from benchmarks.simulated_data import data_file, declared_text
from benchmarks.speed.spectrum import MARK, PAGE
from benchmarks.validation.outside.patterns import simulated
from jaxink.measurement.text_file import write_csv

KEPT = Path(__file__).with_suffix(".json")
HERE = Path(jaxink.__file__).parents[2]
TASKS = (
    "fit:plain_hg",
    "diagnose:plain_hg",
    "diagnose:undeclared_stray_light",
    "diagnose:undeclared_backing",
    "diagnose:undeclared_thin_patches",
    "diagnose:undeclared_air_gap",
    "diagnose:undeclared_rough_surface",
    "diagnose:undeclared_lateral_loss",
    "diagnose:plain_hg+ghost_reflex",
    "diagnose:white_ink_mie@init",
    "diagnose:coloured_ink",
)
# What decides where programs are stored.
_CHOSEN = "JAX_COMPILATION_CACHE_DIR", "JAXINK_CACHE_DIR", "XDG_CACHE_HOME"
TWICE = """
import sys, time, jaxink
for _ in range(2):
    began = time.perf_counter()
    getattr(jaxink, sys.argv[1])(*sys.argv[2:])
print(time.perf_counter() - began)
"""
KINDS = ("cold_s", "stored_s", "again_s")


def python_speed() -> float:
    """Seconds of five million additions in plain Python: how fast the machine is just now."""
    began, total = time.perf_counter(), 0
    for number in range(5_000_000):
        total += number
    return time.perf_counter() - began


def code_of(checkout: Path) -> str:
    """The commit that last changed the source of a checkout; with a "+" if it was changed since."""

    def git(*words: str) -> str:
        command = ["git", "-C", str(checkout), *words, "--", "src"]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    return git("log", "-1", "--format=%h") + ("+" if git("status", "--porcelain") else "")


def first_sample(measurement: Path) -> str:
    """The sample file that `jaxink init` writes, with nothing known but the measurement."""
    with tempfile.TemporaryDirectory() as scratch:
        file = Path(scratch) / "sample.toml"
        command = [sys.executable, "-m", "jaxink", "init", str(measurement), "--out", str(file)]
        subprocess.run(command, check=True, capture_output=True, stdin=subprocess.DEVNULL)
        return file.read_text()


def timed(task: str, checkout: Path) -> dict:
    """Seconds of each kind for one checkout, and what was found."""
    command, name = task.split(":")
    with tempfile.TemporaryDirectory() as scratch:
        sample, out = Path(scratch) / "sample.toml", Path(scratch) / "out"
        design, _, pattern = name.removesuffix("@init").partition("+")
        measurement = data_file(design)
        sample.write_text(first_sample(measurement) if name.endswith("@init") else declared_text(design))
        if pattern:
            measurement = Path(scratch) / "measurement.csv"
            write_csv(simulated(pattern, "weak")[0], measurement)
        environment = {k: v for k, v in os.environ.items() if k not in _CHOSEN}
        environment |= {"XDG_CACHE_HOME": f"{scratch}/cache", "PYTHONPATH": str(checkout / "src")}
        inputs = [str(measurement), str(sample)]

        def seconds(arguments: list[str]) -> tuple[float, str]:
            began = time.perf_counter()
            done = subprocess.run(
                [sys.executable, *arguments], env=environment, check=False, capture_output=True, text=True
            )
            return time.perf_counter() - began, done.stdout

        whole = ["-m", "jaxink", command, inputs[0], "--sample", inputs[1], "--out", str(out), "--quiet"]
        speeds, found = [python_speed()], {}
        for kind in ("cold_s", "stored_s"):
            found[kind] = seconds(whole)[0]
            speeds.append(python_speed())
        found["again_s"] = float(seconds(["-c", TWICE, command, *inputs])[1])
        speeds.append(python_speed())
        file = out / ("report.json" if command == "diagnose" else "result.json")
        verdict = json.loads(file.read_text())["verdict"]
    return found | {
        "verdict": " ".join([verdict["code"], *verdict.get("effects", [])]),
        "python_s": float(np.median(speeds)),
        "machine": machine(),
        "code": code_of(checkout),
    }


def main() -> None:
    """Time what is asked for, and write the page from all that is kept."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--before", type=Path)
    parser.add_argument("--runs", type=int, default=1)
    parser.add_argument("tasks", nargs="*")
    asked = parser.parse_args()
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    versions = {"before": asked.before} if asked.before else {}
    for checkout in (*versions.values(), HERE):
        # As pip does where it installs; Python may be told not to.
        compileall.compile_dir(checkout / "src", quiet=1)
    for task in asked.tasks or TASKS:
        for _ in range(asked.runs):
            for version, checkout in (versions | {"now": HERE}).items():
                run = timed(task, checkout)
                if version != "now":
                    run["beside"] = code_of(HERE)
                kept.setdefault(task, {}).setdefault(version, []).append(run)
                print(task, version, {kind: round(run[kind], 1) for kind in KINDS}, flush=True)
                KEPT.write_text(json.dumps(kept, indent=1) + "\n")
    write(kept)


def write(kept: dict[str, dict[str, list[dict]]]) -> None:
    """The page: medians of the runs of each state of the code."""
    rows: list[list[str]] = []
    machines: dict[str, None] = {}
    for task, versions in kept.items():
        command, name = task.split(":")
        states: dict[tuple[str, str, str], list[dict]] = {}
        for version, runs in reversed(versions.items()):
            for run in reversed(runs):
                states.setdefault((version, run["code"], run.get("beside", "")), []).append(run)
                machines[run["machine"]] = None
        for (version, code, beside), runs in states.items():
            medians = [f"{np.median([run[kind] for run in runs]):.3g}" for kind in KINDS]
            speed = f"{np.median([run['python_s'] for run in runs]):.2f}"
            verdicts = " / ".join(dict.fromkeys(run["verdict"] for run in runs))
            state = code if version == "now" else f"earlier version {code}".strip()
            state += f", beside {beside}" if beside else ""
            rows.append([f"`{command}` `{name}`", state, verdicts, *medians, str(len(runs)), speed])
    header = [
        "command",
        "code",
        "verdict",
        "nothing stored, s",
        "programs stored, s",
        "again in the process, s",
        "runs",
        "5 million additions in Python, s",
    ]
    text = f"""# Time to an answer

What a person waits for: the whole command, from its start to the last file, figures included
(`python -m benchmarks.speed.answers`, {"; ".join(machines)}).
Medians of the runs of each state of the code, the newest first; it is named by the commit that last changed
the source; states before 084e1e5 by the commit with which their runs were kept. An earlier version took turns
with the state that it is beside, or else with one above it.
The first run traces and compiles every program, and stores them; the second one loads them. The third time
is that of the library, when the same process has done it before, without files. The last column shows how
fast the machine was before, between and after the runs: it is a virtual one, whose share of the processor
varies severalfold from hour to hour, so that rows with different speeds cannot be compared.
A name with "+" is that design with a weak pattern that [no effect of the catalogue
describes](outside-catalogue.md). A name with "@init" has the sample file that `jaxink init` writes from
the measurement alone: for `white_ink_mie`, an ink with Mie particles, it declares a Henyey-Greenstein phase
function.

{table(header, rows)}
"""
    write_page(PAGE, f"{text.rstrip()}{section_after(PAGE, MARK)}")


if __name__ == "__main__":
    main()
