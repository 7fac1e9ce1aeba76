"""Diagnose the simulated measurements of many inks, and write docs/validation/names.md.

python -m benchmarks.validation.names draw|diagnose|page [--unseen] [CASE ...]

``draw`` makes the measurements that are missing, ``diagnose`` the rows of results.json; without names, of all
cases that are seen, or with ``--unseen`` of those that are not. The page is written from all rows.
"""

import argparse
import json
import time
from pathlib import Path

import jaxink
from benchmarks.validation.names.cases import Case, cases
from benchmarks.validation.names.drawing import drawn, measurement, sample_text
from benchmarks.validation.names.page import write

RESULTS = Path(__file__).with_name("results.json")


def diagnosed(case: Case) -> dict:
    """What a diagnosis says of a case."""
    started = time.process_time()
    found = jaxink.diagnose(measurement(case), jaxink.parse_sample(sample_text(case)))
    return {
        "code": found.verdict.code,
        "effects": [step.effect for step in found.steps],
        "class": list(found.verdict.effects),
        "imitations": list(found.imitations),
        "reduced_chi_square": [s.fitted.reduced_chi_square for s in (found.before, found.after)],
        "sentence": found.verdict.sentence,
        "processor_s": round(time.process_time() - started),
    }


def main() -> None:
    """Do what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("task", choices=("draw", "diagnose", "page"))
    parser.add_argument("cases", nargs="*", metavar="CASE")
    parser.add_argument("--unseen", action="store_true")
    arguments = parser.parse_args()
    every, results = cases(), json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    chosen = arguments.cases or [n for n, case in every.items() if case.is_unseen == arguments.unseen]
    # One of each kind after the other, so that a part of them tells something of all kinds.
    chosen.sort(key=lambda name: int(name.rsplit("-", 1)[1]))
    for name in chosen:
        if arguments.task == "draw":
            drawn(every[name])
        elif arguments.task == "diagnose" and (arguments.cases or name not in results):
            results[name] = diagnosed(every[name])
            order = {name: results[name] for name in every if name in results}
            RESULTS.write_text(json.dumps(order, indent=1) + "\n", encoding="utf-8")
            found = results[name]
            print(
                name, found["code"], found["effects"], found["reduced_chi_square"], found["processor_s"], "s"
            )
    write(every, results)


if __name__ == "__main__":
    main()
