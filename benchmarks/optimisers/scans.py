"""The scans of two checkouts side by side; writes scans.json.

python -m benchmarks.optimisers.scans CHECKOUT [--problems NAME ...] [--starts N ...]

On each problem with a scan, from each start: the scan, and the searches of the gradient method from where it
leads, without limits. The checkouts take turns, problem by problem, each in a process of its own.
"""

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.checkouts import tell, told
from benchmarks.optimisers.problems import problems
from benchmarks.optimisers.searches import SEED, Bench
from benchmarks.pages import REPOSITORY, table
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.method import search
from jaxink.numerics.precision import computing

KEPT = Path(__file__).with_suffix(".json")
MODULE = "benchmarks.optimisers.scans"
_STARTS = (0, 4)


def _made(name: str, numbers: list[int]) -> None:
    """Print one line for each start."""
    try:
        from jaxink.fitting.sweep import sweep
    except ImportError:
        # Of an earlier checkout.
        from jaxink.fitting.scanning import scan as sweep  # type: ignore[import-not-found,no-redef]
    with computing():
        bench = Bench(problems()[name]())
        bench.compiled.prepare(bench.starts[0], jacobian=True)
        for number in numbers:
            began = time.process_time()
            engine = GradientSearch(bench.posed.objective)
            starts, whole = sweep(engine, bench.starts[number], bench.posed.rugged)[:2]
            seconds = time.process_time() - began
            ends = [search(METHODS["gradient"](SEED), bench.compiled, np.array(start)) for start in starts]
            best = min(ends, key=lambda end: end.loss)
            line = {"jacobians": whole.jacobians, "seconds": round(seconds, 3), "loss": best.loss}
            tell({"start": number} | line | {"outcome": best.outcome.code})


def of_kept() -> str:
    """Table of all problems that are kept."""
    header = ["problem", "start", "Jacobians of the scan, before and now", "time, before / now"]
    header += ["loss after the searches, relative difference", "ended"]
    kept: dict[str, dict[str, list[dict[str, Any]]]] = json.loads(KEPT.read_text())
    rows = []
    for name, lines in kept.items():
        for before, now in zip(lines["before"], lines["now"], strict=True):
            change = abs(now["loss"] / before["loss"] - 1)
            rows.append(
                [
                    f"`{name}`",
                    str(now["start"] + 1),
                    f"{before['jacobians']} and {now['jacobians']}",
                    f"{before['seconds'] / now['seconds']:.2f}",
                    f"{change:.1e}",
                    now["outcome"],
                ]
            )
    return table(header, rows)


def main() -> None:
    """Make the scans, and keep what they found."""
    if sys.argv[1] == "--work":
        _made(sys.argv[2], list(map(int, sys.argv[3:])))
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("before", type=Path)
    parser.add_argument("--problems", nargs="*")
    parser.add_argument("--starts", type=int, nargs="*", default=list(_STARTS))
    asked = parser.parse_args()
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    rugged = [name for name, pose in problems().items() if "-mie" in name or "film" in name]
    for name in asked.problems or rugged:
        if problems()[name]().rugged is None:
            continue
        kept[name] = {
            version: told(checkout, MODULE, "--work", name, *asked.starts)
            for version, checkout in (("before", asked.before), ("now", REPOSITORY))
        }
        print(name, kept[name], flush=True)
        KEPT.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main()
