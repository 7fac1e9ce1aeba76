"""Diagnose every simulated measurement of one wavelength without a word about its noise.

python -m benchmarks.validation.noise.unstated [NAME ...]

Each is diagnosed in a process of its own; with names, only these anew.
"""

import csv
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.simulated_data import data_file, declared_text, names, truth_of
from benchmarks.validation.simulated.diagnosis import EFFECT_OF, REPORTS
from jaxink.diagnosis import read_report

RESULTS = Path(__file__).with_name("unstated.json")


def bare_text(name: str) -> str:
    """The declared sample without its noise."""
    return re.sub(r"\n\[noise\][^\[]*", "\n", declared_text(name))


def write_bare(name: str, target: Path) -> None:
    """The measurement without the column of its standard deviation."""
    with data_file(name).open(newline="") as file, target.open("w", newline="") as out:
        rows = csv.DictReader(file)
        kept = [column for column in rows.fieldnames or () if column != "sigma_per_sr"]
        writer = csv.DictWriter(out, kept, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)


def stated(name: str) -> dict | None:
    """Verdict with the stated noise, as of the kept report; None if there is none."""
    report = REPORTS / f"{name}.json"
    return brief(read_report(report)) if report.exists() else None


def has_one_wavelength(name: str) -> bool:
    """Whether a measurement has a single wavelength."""
    with data_file(name).open(newline="") as file:
        return len({row["wavelength_nm"] for row in csv.DictReader(file)}) == 1


def diagnose(name: str) -> dict:
    """Verdict of the command, as of its report."""
    with tempfile.TemporaryDirectory() as scratch:
        sample, data, out = (Path(scratch) / part for part in ("sample.toml", f"{name}.csv", "out"))
        sample.write_text(bare_text(name))
        write_bare(name, data)
        command = [sys.executable, "-m", "jaxink", "diagnose", str(data), "--sample", str(sample)]
        done = subprocess.run([*command, "--out", str(out), "--quiet", "--no-figures"], check=False)
        report = read_report(out)
    return brief(report) | {"exit_code": done.returncode, "noise": report["noise"]["origin"]}


def brief(report: dict) -> dict:
    """What the table shows of a report."""
    return {
        "code": report["verdict"]["code"],
        "effects": report["verdict"]["effects"],
        "classes": [step["class"] for step in report["steps"]],
        "before": report["before"]["reduced_chi_square"],
        "after": report["after"]["reduced_chi_square"],
        "probability": report["after"]["probability"],
    }


def main(asked: list[str]) -> None:
    """Diagnose what is asked for or missing, and keep what is found."""
    kept = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in asked or [name for name in names() if name not in kept and has_one_wavelength(name)]:
        kept[name] = {
            "true": [EFFECT_OF[key] for key in truth_of(name)["effects"]],
            "unstated": diagnose(name),
        }
        print(name, kept[name]["unstated"]["code"], kept[name]["unstated"]["effects"], flush=True)
        RESULTS.write_text(json.dumps(dict(sorted(kept.items())), indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
