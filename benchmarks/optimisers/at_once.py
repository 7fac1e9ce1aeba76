"""Searches at once and one after the other, from the same starts; writes at_once.json.

python -m benchmarks.optimisers.at_once [--problems NAME ...] [--searches N ...]
"""

import argparse
import json
import time
from pathlib import Path

from benchmarks.optimisers.problems import problems
from benchmarks.optimisers.searches import Bench
from benchmarks.pages import table
from jaxink.fitting.gradient import Descent
from jaxink.fitting.many import searches_at_once
from jaxink.fitting.method import search
from jaxink.numerics.precision import computing

KEPT = Path(__file__).with_suffix(".json")
_PROBLEMS, _AT_ONCE, _STARTS = ("plain_hg", "white_ink_mie-mie-everything"), (1, 4, 16), 16


def measured(name: str, numbers: list[int]) -> list[dict]:
    """A line for each number of searches at once."""
    bench, lines = Bench(problems()[name]()), []
    starts = bench.starts[:_STARTS]
    bench.compiled.prepare(starts[0], jacobian=True)
    for number in numbers:
        first, *_ = searches_at_once(bench.compiled, starts[:1], number, most_steps=1)
        began, cpu = time.perf_counter(), time.process_time()
        alone = [search(Descent(), bench.compiled, start) for start in starts]
        between, cpu_between = time.perf_counter(), time.process_time()
        together = searches_at_once(bench.compiled, starts, number)
        ended, cpu_ended = time.perf_counter(), time.process_time()
        lines.append(
            {
                "at_once": number,
                "compile_seconds": first.compile_seconds,
                "ratio": (between - began) / (ended - between),
                "ratio_of_processor_time": (cpu_between - cpu) / (cpu_ended - cpu_between),
                "loss": max(abs(a.loss / b.loss - 1) for a, b in zip(alone, together, strict=True)),
                "same_jacobians": all(
                    a.jacobians == b.jacobians for a, b in zip(alone, together, strict=True)
                ),
            }
        )
        print(name, lines[-1], flush=True)
    return lines


def of_kept() -> str:
    """Table of all problems that are kept."""
    header = ["problem", "searches at once", "compilation, s", "time one after the other / at once"]
    header += ["processor time likewise", "largest relative difference in the loss", "same Jacobians"]
    rows = [
        [
            f"`{name}`",
            str(line["at_once"]),
            f"{line['compile_seconds']:.0f}",
            f"{line['ratio']:.2f}",
            f"{line['ratio_of_processor_time']:.2f}",
            f"{line['loss']:.0e}",
            "all" if line["same_jacobians"] else "not all",
        ]
        for name, lines in json.loads(KEPT.read_text()).items()
        for line in lines
    ]
    return table(header, rows)


def main() -> None:
    """Measure, and keep what was measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--problems", nargs="*", default=list(_PROBLEMS))
    parser.add_argument("--searches", type=int, nargs="*", default=list(_AT_ONCE))
    asked = parser.parse_args()
    kept = json.loads(KEPT.read_text()) if KEPT.exists() else {}
    with computing():
        for name in asked.problems:
            kept[name] = measured(name, asked.searches)
            KEPT.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main()
