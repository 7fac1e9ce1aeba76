"""jaxink side by side with its peers, on the same work at the same accuracy.

python -m benchmarks.speed.peers [--peers-python PYTHON] [--units W1,W2] [--rounds 7] [--limit 60]

The peers are those of benchmarks/speed/peers/requirements.txt; `--peers-python` names the interpreter of the
environment that has them. Every contender lives in a process of its own, and the processes are asked in turn
for one timing each, while all others wait.
"""

import argparse
import json
import os
import platform
import sys
import time
from pathlib import Path

from benchmarks.pages import page_path, write_page
from benchmarks.speed.peers.contenders import THREADS
from benchmarks.speed.peers.page import page, verdicts
from benchmarks.speed.peers.rounds import run_unit
from benchmarks.speed.peers.units import TOLERANCE, UNITS


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


def main() -> None:
    """Write docs/validation/peers.md and docs/peers.json."""
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
    target = page_path("peers.json")
    target.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    write_page("peers.md", page(report))
    print(f"{time.monotonic() - begin:.0f} s")


if __name__ == "__main__":
    main()
