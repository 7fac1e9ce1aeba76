"""Searches at once and one after the other: from many starts, and of many sheets; writes at_once.json.

python -m benchmarks.optimisers.at_once [--problems NAME ...] [--searches N ...]
"""

import argparse
import json
import time
from pathlib import Path

import equinox as eqx
import numpy as np

from benchmarks.optimisers.problems import problems
from benchmarks.optimisers.searches import Bench
from benchmarks.pages import table
from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.gradient import Descent
from jaxink.fitting.many import searches_of_sheets
from jaxink.fitting.method import search
from jaxink.numerics.precision import computing

KEPT = Path(__file__).with_suffix(".json")
_PROBLEMS, _AT_ONCE, _STARTS = ("plain_hg", "white_ink_mie-mie-everything"), (1, 4, 16), 16


def of_starts(name: str) -> tuple[list[CompiledObjective], list[np.ndarray]]:
    """One problem from some of its starts."""
    bench = Bench(problems()[name]())
    return [bench.compiled] * _STARTS, bench.starts[:_STARTS]


def of_sheets(name: str) -> tuple[list[CompiledObjective], list[np.ndarray]]:
    """Simulated sheets: a problem whose values differ by noise as stated and by factors of up to 5 %."""
    posed, random = problems()[name]().objective, np.random.default_rng(5)
    compiled, sheets = CompiledObjective(posed), []
    for factor in np.linspace(0.95, 1.05, _STARTS):
        values = factor * posed.measured + posed.sigma * random.normal(size=posed.n_points)
        sheets.append(compiled.on(eqx.tree_at(lambda o: o.measured, posed, values)))
    middle = np.full(len(posed.free), 0.5)
    return sheets, [middle] * _STARTS


def measured(sheets: list[CompiledObjective], starts: list[np.ndarray], numbers: list[int]) -> list[dict]:
    """A line for each number of searches at once."""
    lines = []
    sheets[0].prepare(starts[0], jacobian=True)
    for number in numbers:
        first = searches_of_sheets(sheets, starts, number, most_steps=1)[0]
        began, cpu = time.perf_counter(), time.process_time()
        alone = [search(Descent(), one, start) for one, start in zip(sheets, starts, strict=True)]
        between, cpu_between = time.perf_counter(), time.process_time()
        together = searches_of_sheets(sheets, starts, number)
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
        print(lines[-1], flush=True)
    return lines


def of_kept() -> str:
    """Table of all problems that are kept."""
    header = ["searches", "at once", "compilation, s", "time one after the other / at once"]
    header += ["processor time likewise", "largest relative difference in the loss", "same Jacobians"]
    rows = [
        [
            what,
            str(line["at_once"]),
            f"{line['compile_seconds']:.0f}",
            f"{line['ratio']:.2f}",
            f"{line['ratio_of_processor_time']:.2f}",
            f"{line['loss']:.0e}",
            "all" if line["same_jacobians"] else "not all",
        ]
        for what, lines in json.loads(KEPT.read_text()).items()
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
            for what, made in (("starts", of_starts), ("sheets", of_sheets)):
                kept[f"{_STARTS} {what} of `{name}`"] = measured(*made(name), asked.searches)
                KEPT.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main()
