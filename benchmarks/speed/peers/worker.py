"""Process of one contender: answers requests, one JSON line each, until its input ends.

python -m benchmarks.speed.peers.worker UNIT NUMBER FOLDER
"""

import importlib
import json
import os
import platform
import sys
import time
from contextlib import nullcontext
from importlib.metadata import version
from pathlib import Path

import numpy as np

from benchmarks.speed.peers.contenders import CONTENDERS

# Packages whose version matters as much.
BENEATH = {"jaxink": ("jax", "jaxlib"), "miepython": ("numba",), "pydisort": ("torch",)}


def main() -> None:
    """Serve the contender of that number in that unit."""
    unit, number, folder = sys.argv[1], int(sys.argv[2]), Path(sys.argv[3])
    contender = CONTENDERS[unit][number]
    # What C libraries print goes elsewhere, the answers keep the pipe for themselves.
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    session = nullcontext()
    if contender.package == "jaxink":
        from jaxink.numerics.precision import computing

        session = computing()
    run = None
    with session:
        for line in sys.stdin:
            request = json.loads(line)
            try:
                if request["do"] == "build":
                    module, function = contender.function.split(":")
                    make = getattr(importlib.import_module(f"benchmarks.speed.peers.{module}"), function)
                    size = request["size"]
                    run = make(unit, tuple(size) if isinstance(size, list) else size)
                    np.savez(folder / f"{number}.npz", **run())
                    packages = contender.package, *BENEATH.get(contender.package, ())
                    versions = {package: version(package) for package in packages}
                    answer = {"versions": versions, "python": platform.python_version()}
                else:
                    answer = {"seconds": timed(run, request["repeats"])}
            except Exception as error:
                answer = {"failed": type(error).__name__, "message": str(error)}
            answers.write(json.dumps(answer) + "\n")
            answers.flush()


def timed(run, repeats: int) -> float:
    """Seconds of one call, the mean of several."""
    if repeats > 1:
        # What the other processes have put out of the caches comes back.
        run()
    start = time.perf_counter()
    for _ in range(repeats):
        run()
    return (time.perf_counter() - start) / repeats


if __name__ == "__main__":
    main()
