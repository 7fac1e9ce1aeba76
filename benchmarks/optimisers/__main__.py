"""Make the searches that are missing, and write docs/validation/optimisers.md from those that are kept.

python -m benchmarks.optimisers [--problems NAME ...] [--methods NAME ...] [--starts N] [--minutes M] [--page]

Every search is a line of results/PROBLEM.jsonl. What is there is not repeated, so that the script can be
interrupted and continued; remove lines to repeat them. With --page, no search is made.
"""

import argparse
import time

from benchmarks.optimisers.kept import keep, kept
from benchmarks.optimisers.page import write
from benchmarks.optimisers.problems import problems
from benchmarks.optimisers.searches import N_STARTS, Bench
from jaxink.fitting.comparison_methods import METHODS
from jaxink.numerics.precision import computing, release_programs


class OutOfTime(Exception):  # noqa: N818 - it ends the run, and is no error
    """No minutes are left."""


def make_missing(name: str, pose, methods: list[str], numbers: range, ends: float) -> None:
    """Make the searches of one problem that are not kept."""
    lines = kept(name)
    done = {(line["method"], line.get("scan", True), line["start"]) for line in lines}
    scans = {line["start"]: line for line in lines if line["method"] == "scan"}
    wanted = [(m, s, k) for k in numbers for m in methods for s in (False, True)]
    if (
        all(key in done for key in wanted if not key[1])
        and lines
        and not scans
        and lines[0]["rugged"] is None
    ):
        return
    if all(key in done for key in wanted):
        return
    release_programs()
    bench = Bench(pose())
    rugged = bench.posed.rugged
    for number in numbers:
        if rugged is not None and number not in scans:
            scans[number] = bench.scan(number) | {"rugged": rugged}
            keep(name, scans[number])
        for method in methods:
            for scanned in (False, True) if rugged is not None else (False,):
                if (method, scanned, number) in done:
                    continue
                if time.monotonic() > ends:
                    raise OutOfTime
                line = bench.search(method, number, scans[number] if scanned else None)
                keep(name, line | {"rugged": rugged})
        print(f"{name}: start {number + 1}", flush=True)


def main() -> None:
    """Make searches and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--problems", nargs="*")
    parser.add_argument("--methods", nargs="*", default=list(METHODS))
    parser.add_argument("--starts", type=int, default=N_STARTS)
    parser.add_argument("--minutes", type=float, default=1e6)
    parser.add_argument("--page", action="store_true")
    arguments = parser.parse_args()
    known = problems()
    ends = time.monotonic() + 60 * arguments.minutes
    chosen = [] if arguments.page else arguments.problems or list(known)
    try:
        with computing():
            for name in chosen:
                make_missing(name, known[name], arguments.methods, range(arguments.starts), ends)
    except OutOfTime:
        print("out of time; call again to continue")
    write({name: kept(name) for name in known}, known)


if __name__ == "__main__":
    main()
