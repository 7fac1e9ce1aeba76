"""Processes of the contenders, which are asked in turn: sizes that pass, and times."""

import json
import math
import os
import select
import statistics
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.pages import REPOSITORY
from benchmarks.speed.peers.contenders import CONTENDERS
from benchmarks.speed.peers.units import TITLES, TOLERANCE, derivative_error, items, value_error

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
