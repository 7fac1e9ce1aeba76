"""The same searches by the gradient method of two checkouts; writes agreement.json.

python -m benchmarks.optimisers.agreement CHECKOUT [--problems NAME ...] [--starts N]

Every search starts alone, without a scan; the programs evaluated, the starts and the bounds are the same. The
checkouts take turns, problem by problem, each in a process of its own. What is kept is not repeated. Where
they differ, the first one searches once more, from starts moved by rounding: how far it agrees with itself.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.checkouts import tell, told
from benchmarks.optimisers.problems import problems
from benchmarks.optimisers.searches import N_STARTS, SEED, Bench
from benchmarks.pages import REPOSITORY, table
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.limits import Budget, SearchLimits
from jaxink.fitting.method import search
from jaxink.numerics.precision import computing

KEPT = Path(__file__).with_suffix(".json")
MODULE = "benchmarks.optimisers.agreement"
# Of a search; no limit of time, so that both make the same number.
LIMITS = SearchLimits(evaluations=2000)
# Of the starts, to see what rounding does to a search.
_ROUNDING = 1e-15


def _search(name: str, moved: float, first: int, last: int) -> None:
    """Print one line for each search of a problem."""
    with computing():
        bench = Bench(problems()[name]())
        for number in range(first, last):
            start = bench.starts[number] * (1 - moved)
            found = search(METHODS["gradient"](SEED), bench.compiled, start, Budget(LIMITS))
            line = {"loss": found.loss, "jacobians": found.jacobians, "seconds": round(found.run_seconds, 4)}
            tell(line | {"outcome": found.outcome.name.lower()})


def compared(before: list[dict], now: list[dict]) -> dict[str, Any]:
    """Largest relative difference in the loss, and in the Jacobians, of the searches of a problem."""
    loss = np.array([[line["loss"] for line in lines] for lines in (before, now)])
    jacobians = np.array([[line["jacobians"] for line in lines] for lines in (before, now)])
    relative = np.abs(loss[1] - loss[0]) / loss[0]
    difference = np.abs(jacobians[1] - jacobians[0])
    return {
        "starts": len(relative),
        "loss": float(np.max(relative)),
        "same_loss": int(np.sum(relative <= 1e-9)),
        "jacobians": int(np.max(difference)),
        "same_jacobians": int(np.sum(difference <= 1)),
        "median_jacobians": [float(np.median(row)) for row in jacobians],
    }


def agrees(found: dict) -> bool:
    """Whether all searches of a problem end with the same loss after the same number of Jacobians."""
    return found["same_loss"] == found["same_jacobians"] == found["starts"]


def _kept() -> dict[str, dict[str, list[dict]]]:
    return json.loads(KEPT.read_text()) if KEPT.exists() else {}


def of_kept() -> str:
    """Table of all problems that are kept."""
    header = ["problem", "starts", "same loss (1e-9)", "largest relative difference"]
    header += ["same Jacobians (within 1)", "medians of Jacobians, before and now"]
    rows = []
    for name, lines in _kept().items():
        found = compared(lines["before"], lines["now"])
        medians = " and ".join(f"{median:g}" for median in found["median_jacobians"])
        row = [f"`{name}`", str(found["starts"]), str(found["same_loss"]), f"{found['loss']:.1e}"]
        rows.append([*row, str(found["same_jacobians"]), medians])
    return table(header, rows)


def sensitive() -> str:
    """What rounding of the starts does to the searches that differ."""
    parts = []
    for name, lines in _kept().items():
        if lines.get("moved"):
            found = compared(lines["before"], lines["moved"])
            medians = " and ".join(f"{median:g}" for median in found["median_jacobians"])
            parts.append(
                f"On `{name}`, the earlier form itself, from starts moved by {_ROUNDING:g}, has the same "
                f"loss from {found['same_loss']} and the same Jacobians from {found['same_jacobians']} of "
                f"{found['starts']} starts, medians {medians}, losses within {found['loss']:.1e}."
            )
    ways = "These searches follow a long valley of hundreds of steps, in which rounding grows."
    return " ".join([*parts, ways]) if parts else ""


def main() -> None:
    """Make the searches that are missing, and print how far they agree."""
    if sys.argv[1] == "--work":
        _search(sys.argv[2], float(sys.argv[3]), *map(int, sys.argv[4:6]))
        return
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("before", type=Path)
    parser.add_argument("--problems", nargs="*")
    parser.add_argument("--starts", type=int, default=N_STARTS)
    asked = parser.parse_args()
    kept = _kept()
    for name in asked.problems or problems():
        lines = kept.setdefault(name, {"before": [], "now": []})
        for version, checkout, moved in (
            ("before", asked.before, 0.0),
            ("now", REPOSITORY, 0.0),
            ("moved", asked.before, _ROUNDING),
        ):
            if version == "moved" and agrees(compared(lines["before"], lines["now"])):
                continue
            known = lines.setdefault(version, [])
            if len(known) < asked.starts:
                known += told(checkout, MODULE, "--work", name, moved, len(known), asked.starts)
            if version != "before":
                print(name, version, compared(lines["before"], known), flush=True)
        KEPT.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main()
