"""What it costs, and what it brings, to search again from elsewhere after an end at a bound.

python -m benchmarks.optimisers.bounds [--problems NAME ...]

On each problem without a scan, from each start: one search, and the default, which continues from the middle
and from the other side of the ranges of the parameters that ended at a bound. Writes bounds.json.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.optimisers.searches import SEED, Bench, keep_of_each
from benchmarks.pages import table
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.gradient import Descent
from jaxink.fitting.method import search

KEPT = Path(__file__).with_suffix(".json")
# Share of the loss by which another minimum is lower.
_LOWER = 1e-6


def _compared(bench: Bench) -> list[dict[str, Any]]:
    """Both searches from each start from which the first ends at a bound; none where a scan precedes."""
    lines: list[dict[str, Any]] = []
    if bench.posed.rugged is not None:
        return lines
    for number, start in enumerate(bench.starts):
        once = search(Descent(SEED), bench.compiled, start)
        if np.any((once.unit <= 0) | (once.unit >= 1)):
            whole = search(METHODS["gradient"](SEED), bench.compiled, start)
            lines.append(
                {
                    "start": number,
                    "jacobians": [once.jacobians, whole.jacobians],
                    "loss": [once.loss, whole.loss],
                }
            )
    return lines


def of_kept() -> str:
    """Table of the problems on which searches end at a bound."""
    header = ["problem", "searches that end at a bound", "their Jacobians", "with those from elsewhere"]
    header += ["lower minima found"]
    rows = []
    for name, lines in json.loads(KEPT.read_text()).items():
        if lines:
            once, whole = np.median([line["jacobians"] for line in lines], axis=0)
            lower = sum(line["loss"][1] < (1 - _LOWER) * line["loss"][0] for line in lines)
            rows.append([f"`{name}`", str(len(lines)), f"{once:g}", f"{whole:g}", str(lower)])
    return table(header, rows)


def main() -> None:
    """Search, and keep what was found."""
    keep_of_each(KEPT, __doc__, _compared)


if __name__ == "__main__":
    main()
