"""jaxink side by side with its peers, on the same work at the same accuracy.

python -m benchmarks.speed.peers [--peers-python PYTHON] [--units W1,W2] [--rounds 7] [--limit 60]

The peers are those of benchmarks/speed/peers/requirements.txt; `--peers-python` names the interpreter of the
environment that has them. Every contender lives in a process of its own, and the processes are asked in turn
for one timing each, while all others wait.
"""

import argparse
import json
import math
import os
import platform
import select
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.pages import REPOSITORY, table, write_page
from benchmarks.speed.peers.contenders import CONTENDERS, THREADS
from benchmarks.speed.peers.units import TITLES, TOLERANCE, UNITS, derivative_error, items, value_error

SHORT_SECONDS, SLOW_SECONDS = 5e-3, 3.0
SLOW_ROUNDS = 2
# A short call is repeated for this long within a round.
ROUND_SECONDS = 20e-3


class ContenderLostError(Exception):
    """The process of a contender ended, or took too long."""


class Worker:
    """Process of one contender."""

    def __init__(self, python: str, unit: str, number: int, folder: Path):
        self.contender, self.unit = CONTENDERS[unit][number], unit
        self.result_file = folder / f"{number}.npz"
        libraries = ("OMP", "OPENBLAS", "MKL", "NUMBA", "RAYON")
        threads = {f"{name}_NUM_THREADS": str(self.contender.threads) for name in libraries}
        self.process = subprocess.Popen(
            [python, "-m", "benchmarks.speed.peers.worker", unit, str(number), str(folder)],
            cwd=REPOSITORY,
            env=os.environ | threads,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            bufsize=0,
        )

    def ask(self, request: dict, limit: float) -> dict:
        """Answer to one request.

        Raises
        ------
        ContenderLostError
            With the reason.
        """
        try:
            self.process.stdin.write(json.dumps(request).encode() + b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise ContenderLostError(self._end()) from None
        ready, _, _ = select.select([self.process.stdout], [], [], limit)
        if not ready:
            self.stop()
            raise ContenderLostError(f"not finished in {limit:g} s")
        line = self.process.stdout.readline()
        if not line:
            raise ContenderLostError(self._end())
        return json.loads(line)

    def _end(self) -> str:
        code = self.process.wait()
        return f"crashed (signal {-code})" if code < 0 else f"ended with code {code}"

    def stop(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


def search(worker: Worker, made: dict, limit: float) -> dict:
    """Row of a contender, without times: the smallest size that passes, or the last one."""
    contender = worker.contender
    row = {
        "contender": contender.name,
        "package": contender.package,
        "note": contender.note,
        "is_peer": contender.is_peer,
        "is_reference": contender.reference,
        "times_ms": [],
    }
    for size in contender.sizes:
        try:
            answer = worker.ask({"do": "build", "size": size}, limit)
        except ContenderLostError as reason:
            print(f"  {contender.name} {size}: {reason}", flush=True)
            return row | {"failed": str(reason)}
        if "failed" in answer:
            print(f"  {contender.name} {size}: {answer['failed']} {answer['message'][:100]}", flush=True)
            row["failed"] = answer["failed"]
            continue
        row.pop("failed", None)
        with np.load(worker.result_file) as file:
            result = dict(file)
        if contender.reference:
            made.update(result)
        error = value_error(worker.unit, result, made)
        row |= answer | {"size": size, "error": error, "passes": bool(error <= TOLERANCE)}
        row["derivative_error"] = derivative_error(result, made)
        print(f"  {contender.name} {size}: error {error:.2g} {row['derivative_error'] or ''}", flush=True)
        if row["passes"]:
            break
    return row


def measure(workers: list[Worker], rows: list[dict], rounds: int, limit: float) -> None:
    """Times of all contenders, one after the other in every round."""
    repeats = {}
    for turn in range(rounds):
        for worker, row in zip(workers, rows, strict=True):
            if "failed" in row:
                continue
            try:
                if worker not in repeats:
                    # The second call of a process, warm: tells how often a round repeats it.
                    seconds = worker.ask({"do": "time", "repeats": 1}, limit)["seconds"]
                    short = seconds < SHORT_SECONDS
                    repeats[worker] = math.ceil(ROUND_SECONDS / seconds) if short else 1
                    row["rounds"] = min(rounds, SLOW_ROUNDS) if seconds > SLOW_SECONDS else rounds
                if turn < row["rounds"]:
                    answer = worker.ask({"do": "time", "repeats": repeats[worker]}, limit)
                    row["times_ms"].append(1e3 * answer["seconds"] / items(worker.unit))
            except ContenderLostError as reason:
                row["failed"] = str(reason)


def run_unit(unit: str, pythons: dict, rounds: int, limit: float) -> list[dict]:
    """Rows of one unit."""
    print(f"{unit}: {TITLES[unit]}", flush=True)
    workers, rows, made = [], [], {}
    with tempfile.TemporaryDirectory() as folder:
        try:
            for number, contender in enumerate(CONTENDERS[unit]):
                python = pythons["jaxink" if contender.package == "jaxink" else "peers"]
                worker = Worker(python, unit, number, Path(folder))
                row = search(worker, made, limit)
                if contender.timed:
                    workers.append(worker)
                    rows.append(row)
                else:
                    worker.stop()
            measure(workers, rows, rounds, limit)
        finally:
            for worker in workers:
                worker.stop()
    for row in rows:
        row["median_ms"] = statistics.median(row["times_ms"]) if row["times_ms"] else None
    return rows


def best_peer(rows: list[dict]) -> float | None:
    """Median of the fastest peer that passes."""
    times = [
        row["median_ms"]
        for row in rows
        if row["is_peer"] and row.get("passes") and row["median_ms"] is not None
    ]
    return min(times, default=None)


def median_of(units: dict, unit: str, name: str) -> float | None:
    """Median of a contender that passes, by the start of its name."""
    for row in units.get(unit, ()):
        if row["contender"].startswith(name) and row.get("passes"):
            return row["median_ms"]
    return None


def verdicts(units: dict) -> list[dict]:
    """Targets, what was reached, and whether each is met."""
    best = {unit: best_peer(rows) for unit, rows in units.items()}
    jacobian = "jaxink, value and Jacobian"
    spheres = median_of(units, "W5", "sasktran2")
    wanted = [
        ("W1", "of the best peer", 2.0, median_of(units, "W1", "jaxink"), best.get("W1")),
        ("W1 x 64", "of W1's best peer, each", 0.5, median_of(units, "W1 x 64", "jaxink"), best.get("W1")),
        ("W2", "of the best peer", 0.25, median_of(units, "W2", "jaxink"), best.get("W2")),
        ("W3b", "ms", 25.0, median_of(units, "W3b", "jaxink"), 1.0),
        ("W4", "of the best peer", 0.12, median_of(units, "W4", jacobian), best.get("W4")),
        (
            "W4",
            "of jaxink's value alone",
            4.0,
            median_of(units, "W4", jacobian),
            median_of(units, "W4", "jaxink, value only"),
        ),
        ("W5", "of sasktran2", 1.0, median_of(units, "W5", "jaxink"), spheres),
        (
            "W5",
            "of sasktran2, with derivatives",
            4.0,
            median_of(units, "W5", "jaxink, with derivatives"),
            spheres,
        ),
        ("W6", "of the best peer, per spectrum", 0.15, median_of(units, "W6", "jaxink"), best.get("W6")),
        ("whole sample", "ms", 40.0, median_of(units, "whole sample", "jaxink, default sizes"), 1.0),
    ]
    found = []
    for unit, kind, limit, ours, theirs in wanted:
        if unit not in units:
            continue
        reached = None if ours is None or theirs is None else ours / theirs
        met = None if reached is None else bool(reached <= limit)
        found.append({"unit": unit, "kind": kind, "target": limit, "reached": reached, "met": met})
    return found


def describe_machine() -> dict:
    """Processor, cores, system."""
    model = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        model = next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
        system = platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, StopIteration, KeyError):
        system = platform.system()
    return {
        "processor": f"{model} ({platform.machine()})",
        "cores": os.cpu_count(),
        "system": system,
        "python": platform.python_version(),
        "threads": THREADS,
    }


def size_text(row: dict) -> str:
    """Streams, or the sizes of jaxink."""
    size = row.get("size")
    return " x ".join(map(str, size)) if isinstance(size, list | tuple) else str(size or "-")


def row_cells(row: dict, best: float | None) -> list[str]:
    """Cells of one contender."""
    notes = [row["note"]] if row["note"] else []
    if 0 < len(row["times_ms"]) < row["most_rounds"]:
        notes.append(f"{len(row['times_ms'])} rounds")
    if "failed" in row:
        notes.append(f"then {row['failed']}" if "error" in row else row["failed"])
    if "error" not in row:
        return [row["contender"], "-", "-", "-", "-", "; ".join(notes)]
    error = f"{row['error']:.1e}" if row["passes"] else f"MISS ({row['error']:.1e})"
    error = "reference" if row["is_reference"] else error
    if row["derivative_error"] is not None:
        error += f", derivatives {row['derivative_error']:.1e}"
    median = row["median_ms"]
    time_text = "-" if median is None else f"{median:.3g}"
    ratio = "-" if best is None or median is None else f"{median / best:.2g}"
    return [row["contender"], size_text(row), error, time_text, ratio, "; ".join(notes)]


def page(report: dict) -> str:
    """Text of docs/peers.md."""
    where = report["machine"]
    versions = ", ".join(f"{name} {number}" for name, number in sorted(report["versions"].items()))
    header = ["contender", "streams or sizes", "error", "median, ms", "to the best peer", "remarks"]
    parts = []
    for unit, rows in report["units"].items():
        best = best_peer(rows)
        cells = [row_cells(row, best) for row in rows]
        parts.append(f"## {unit}\n\n{unit}: {TITLES[unit]}.\n\n{table(header, cells)}")
    targets = []
    for found in report["targets"]:
        reached = "-" if found["reached"] is None else f"{found['reached']:.2g}"
        met = {None: "not measured", True: "met", False: "missed"}[found["met"]]
        targets.append([found["unit"], f"{found['target']:g} {found['kind']}", reached, met])
    target_table = table(["work unit", "at most", "reached", ""], targets)
    return f"""# jaxink and its peers side by side

{where["processor"]}, {where["cores"]} cores, {where["system"]}, Python {where["python"]} (peers: Python
{report["peers_python"]}), {where["threads"]} threads each, double precision except mitsuba.
{versions}.

Each contender runs in a process of its own. The processes stay alive and are asked in turn for one timing
while all others wait; the times are medians of {report["rounds"]} such rounds, of warm calls, with everything
that a new set of optical parameters costs, and without compilation. A call shorter than
{1e3 * SHORT_SECONDS:g} ms is repeated within a round; one longer than {SLOW_SECONDS:g} s is measured
{SLOW_ROUNDS} times.

First each contender takes the smallest size of a list with which no radiance, up to 89 degrees, is further
than {TOLERANCE:g} (relative) from the converged reference; MISS gives the error at the largest one. Peers
that miss, or do only a small part of the work (iadpython, mitsuba), do not count as the best peer. Sizes are
streams for discrete ordinates, quadrature points for iadpython, paths for mitsuba, and for jaxink nodes
escaping x trapped x moments x orders. Derivatives are checked against central differences of nanodisort with
96 streams; their error is relative to the largest derivative. Spheres are checked against miepython:
relative, moments absolute. The whole sample is checked against jaxink itself with finer sizes.

Of the peers only iadpython and mitsuba know a refracting boundary (W3). PythonicDISORT misses W2 and is left
out of W4 and W6. Peers without derivatives take forward differences in W4, 4 solves.

## Targets

{target_table}

{chr(10).join(part + chr(10) for part in parts)}
The raw times are in [peers.json](peers.json). This page is made by `python -m benchmarks.speed.peers`; the
peers are in `benchmarks/speed/peers/requirements.txt`.
"""


def main() -> None:
    """Write docs/peers.md and docs/peers.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--peers-python", default=sys.executable, help="interpreter that has the peers")
    parser.add_argument("--units", default=",".join(UNITS), help="which work units, by commas")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--limit", type=float, default=60.0, help="seconds that one call may take")
    arguments = parser.parse_args()
    chosen = arguments.units.split(",")
    if unknown := set(chosen) - set(UNITS):
        parser.error(f"unknown units {', '.join(sorted(unknown))}; there are {', '.join(UNITS)}")
    pythons = {"jaxink": sys.executable, "peers": arguments.peers_python}
    begin = time.monotonic()
    units = {
        unit: run_unit(unit, pythons, arguments.rounds, arguments.limit) for unit in UNITS if unit in chosen
    }
    versions, peers_python = {}, platform.python_version()
    for row in (row for rows in units.values() for row in rows):
        row["most_rounds"] = arguments.rounds
        if "versions" in row:
            versions |= row.pop("versions")
            python = row.pop("python")
            peers_python = python if row["package"] != "jaxink" else peers_python
    report = {
        "machine": describe_machine(),
        "peers_python": peers_python,
        "versions": versions,
        "rounds": arguments.rounds,
        "tolerance": TOLERANCE,
        "targets": verdicts(units),
        "units": units,
    }
    target = REPOSITORY / "docs" / "peers.json"
    target.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    write_page("peers.md", page(report))
    print(f"{time.monotonic() - begin:.0f} s")


if __name__ == "__main__":
    main()
