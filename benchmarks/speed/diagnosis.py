"""Time of a whole diagnosis; writes docs/diagnosis-time.md.

python -m benchmarks.speed.diagnosis [NAME ...]

Each simulated case is diagnosed by the command in a fresh process, first with nothing compiled, then with the
programs that the first run stored; and twice by the library in one process, of which the second run counts.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import jaxink
from benchmarks.pages import machine, table, write_page
from benchmarks.simulated_data import data_file, declared_text

STORE = Path(__file__).with_suffix(".json")
NAMES = ("plain_hg", "undeclared_stray_light", "undeclared_backing")
# What decides where programs are stored.
_CHOSEN = "JAX_COMPILATION_CACHE_DIR", "JAXINK_CACHE_DIR"
TWICE = """
import sys, time, jaxink
for _ in range(2):
    began = time.perf_counter()
    jaxink.diagnose(*sys.argv[1:])
print(time.perf_counter() - began)
"""


def python_speed() -> float:
    """Seconds of five million additions in plain Python: most of a diagnosis is Python, too."""
    began, total = time.perf_counter(), 0
    for number in range(5_000_000):
        total += number
    return time.perf_counter() - began


def timed(name: str) -> dict:
    """Seconds of each kind, and what was found."""
    data = data_file(name)
    with tempfile.TemporaryDirectory() as scratch:
        sample, out = Path(scratch) / "sample.toml", Path(scratch) / "out"
        sample.write_text(declared_text(name))
        environment = {k: v for k, v in os.environ.items() if k not in _CHOSEN}
        environment["XDG_CACHE_HOME"] = str(Path(scratch) / "cache")
        command = [sys.executable, "-m", "jaxink", "diagnose", str(data), "--sample", str(sample)]
        seconds = []
        for _ in range(2):
            began = time.perf_counter()
            done = subprocess.run(
                [*command, "--out", str(out), "--quiet"], env=environment, check=False, capture_output=True
            )
            seconds.append(time.perf_counter() - began)
        report = json.loads((out / "report.json").read_text())
        again = subprocess.run(
            [sys.executable, "-c", TWICE, str(data), str(sample)],
            env=environment,
            check=True,
            capture_output=True,
            text=True,
        )
    return {
        "rows": int(jaxink.read(data).used.sum()),
        "verdict": [report["verdict"]["code"], *report["verdict"]["effects"]],
        "exit_code": done.returncode,
        "cold_s": seconds[0],
        "stored_s": seconds[1],
        "again_s": float(again.stdout),
        "python_s": python_speed(),
        "machine": machine(),
    }


def main() -> None:
    """Time what is asked for, and write the section."""
    kept = json.loads(STORE.read_text()) if STORE.exists() else {}
    for name in sys.argv[1:] or NAMES:
        kept[name] = [*kept.get(name, []), timed(name)]
        print(name, kept[name][-1], flush=True)
        STORE.write_text(json.dumps(kept, indent=1) + "\n")
    write(kept)


def write(kept: dict[str, list[dict]]) -> None:
    """The page of the runs that are kept."""
    rows = [
        [
            f"`{name}`",
            str(k["rows"]),
            " ".join(k["verdict"]),
            *(f"{k[kind]:.0f}" for kind in ("cold_s", "stored_s", "again_s")),
            f"{k['python_s']:.1f}" if "python_s" in k else "not taken",
        ]
        for name, runs in kept.items()
        for k in runs
    ]
    header = [
        "simulated measurement",
        "rows",
        "verdict",
        "command, nothing compiled, s",
        "command, programs stored, s",
        "library, second time in a process, s",
        "5 million additions in Python, s",
    ]
    machines = "; ".join(dict.fromkeys(k["machine"] for runs in kept.values() for k in runs))
    text = f"""# Computing time of a diagnosis

The times include the whole procedure: fit, complete catalogue, 2000 null data sets, refits, held-out fits,
report and figures (`python -m benchmarks.speed.diagnosis`, {machines}). Each row is one run. The last
column shows how fast the machine was at that time: it is a virtual machine with two cores, whose share of
the processor varies severalfold from hour to hour.

{table(header, rows)}
"""
    write_page("diagnosis-time.md", text)


if __name__ == "__main__":
    main()
