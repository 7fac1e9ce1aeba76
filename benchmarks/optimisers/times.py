"""Time of an evaluation and of a Jacobian of each problem, side by side in one run; writes times.json.

python -m benchmarks.optimisers.times [--problems NAME ...]

The kept searches were made on days on which the machine was more or less fast. Their numbers of evaluations
and of Jacobians, times what one of each takes, compare methods nevertheless.
"""

import json
import statistics
from functools import cache
from pathlib import Path

from benchmarks.optimisers.searches import SEED, Bench, keep_of_each
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.gradient import Descent
from jaxink.fitting.limits import Budget, SearchLimits
from jaxink.fitting.method import Method, search

KEPT = Path(__file__).with_suffix(".json")
# Short searches from so many starts, the methods in turn.
_STARTS, _EVALUATIONS, _JACOBIANS = 7, 30, 8


def _each(method: Method, bench: Bench, number: int, limit: int) -> float:
    """Seconds for each evaluation of a short search, with what the method itself takes."""
    budget = Budget(SearchLimits(evaluations=limit))
    found = search(method, bench.compiled, bench.starts[number], budget)
    return found.run_seconds / (found.evaluations + found.jacobians)


def measured(bench: Bench) -> dict[str, float]:
    """Milliseconds of an evaluation of the simplex and of a Jacobian of the gradient method; medians."""
    evaluation, jacobian = [], []
    # The first start warms up both.
    for number in range(_STARTS + 1):
        evaluation.append(_each(METHODS["simplex"](SEED), bench, number, _EVALUATIONS))
        jacobian.append(_each(Descent(SEED), bench, number, _JACOBIANS))
    pairs = {"evaluation_ms": evaluation, "jacobian_ms": jacobian}
    return {key: round(1000 * statistics.median(values[1:]), 4) for key, values in pairs.items()}


@cache
def kept_times() -> dict[str, dict[str, float]]:
    """What was measured, by problem."""
    return json.loads(KEPT.read_text())


def main() -> None:
    """Measure, and keep what was found."""
    keep_of_each(KEPT, __doc__, measured)


if __name__ == "__main__":
    main()
