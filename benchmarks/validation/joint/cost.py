"""Seconds of a joint fit against the number of measurements, nothing compiled and again."""

import dataclasses
import os
import subprocess
import sys
import tempfile
import time

import jaxink
from benchmarks.validation.joint.pull import drawn

COUNTS = (1, 2, 4, 8)


def seconds() -> list[dict]:
    """For each number, in a process with an empty cache: the first fit, and the median of three others."""
    rows = []
    for n in COUNTS:
        with tempfile.TemporaryDirectory() as cache:
            command = [sys.executable, "-m", "benchmarks.validation.joint.cost", str(n)]
            where = {**os.environ, "XDG_CACHE_HOME": cache}
            done = subprocess.run(command, env=where, capture_output=True, text=True, check=True)
        first, again, jacobians = done.stdout.split()
        rows.append(
            {"measurements": n, "first_s": float(first), "again_s": float(again), "jacobians": int(jacobians)}
        )
    return rows


def _project(n: int) -> jaxink.Project:
    """So many measurements of one structure: the thick sheet, drawn again and again with other noise."""
    sheets = [drawn(seed, None).measurements[1] for seed in [0] * n]
    return jaxink.Project(tuple(dataclasses.replace(one, name=f"sheet_{i}") for i, one in enumerate(sheets)))


def main() -> None:
    """Print the seconds of the first fit and of another, and the Jacobians of one."""
    project = _project(int(sys.argv[1]))
    times, result = [], None
    for _ in range(4):
        began = time.process_time()
        result = jaxink.fit(project, options=jaxink.FitOptions(profile="none", accuracy=1e-3))
        times.append(time.process_time() - began)
    assert result is not None
    print(times[0], sorted(times[1:])[1], sum(s.jacobians for s in result.searches))


if __name__ == "__main__":
    main()
