"""One search of one problem by one method from one start, as a line that is kept."""

import argparse
import dataclasses
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.optimisers.problems import Posed, problems
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.compiled import CompiledObjective
from jaxink.fitting.gradient import GradientSearch, starts
from jaxink.fitting.limits import Budget, SearchLimits
from jaxink.fitting.method import search
from jaxink.fitting.outcome import Search
from jaxink.fitting.uncertainty import covariance
from jaxink.numerics.precision import computing, release_programs

SEED, N_STARTS = 23, 20
# Of every search, together with the scan that precedes it; a Jacobian counts as one evaluation.
BUDGET = SearchLimits(evaluations=2000, seconds=60.0)
# No program is compiled again with more optimisation while methods are compared.
_NEVER = -(10**9)


@dataclasses.dataclass(frozen=True)
class Effort:
    """Evaluations, Jacobians and seconds that precede a search."""

    evaluations: int = 0
    jacobians: int = 0
    seconds: float = 0.0


class Bench:
    """One problem with its compiled programs.

    Parameters
    ----------
    posed
        The problem.
    """

    def __init__(self, posed: Posed):
        self.posed = posed
        self.compiled = CompiledObjective(posed.objective)
        self.compiled.count(_NEVER, _NEVER)
        free = posed.sample.parameters.free
        first = posed.objective.scale.to_unit(np.array([p.value for p in free]))
        self.starts = starts(first, N_STARTS + 1, SEED)[1:]

    def scan(self, number: int) -> dict:
        """The scan from a start, by the gradient method."""
        # Earlier checkouts, which others compare by this class, have no such module.
        from jaxink.fitting.sweep import sweep

        posed, start = self.posed, self.starts[number]
        engine = GradientSearch(posed.objective)
        self.compiled.prepare(start, jacobian=True)
        found = sweep(engine, start, posed.rugged, within=Budget(BUDGET))
        line = _line(found.whole, Effort())
        return line | {"method": "scan", "start": number, "starts": [_short(unit) for unit in found.starts]}

    def search(self, method: str, number: int, scanned: dict | None) -> dict:
        """Search by a method from a start, or from the starts that a scan has found."""
        spent, first = Effort(), [self.starts[number]]
        budget = Budget(BUDGET)
        if scanned is not None:
            spent = Effort(scanned["evaluations"], scanned["jacobians"], scanned["seconds"])
            first = [np.array(unit) for unit in scanned["starts"]]
            budget.spend(spent.evaluations + spent.jacobians, spent.seconds)
        lines: list[dict] = []
        for start in first:
            if lines and budget.is_spent(np.inf):
                break
            found = search(METHODS[method](SEED), self.compiled, start, budget)
            lines.append(_line(found, spent))
            spent = Effort(*(lines[-1][key] for key in ("evaluations", "jacobians", "seconds")))
        best = min(lines, key=lambda line: line["loss"])
        earlier = [scanned["path"]] if scanned is not None else []
        return best | {
            "method": method,
            "scan": scanned is not None,
            "start": number,
            "path": _falling([*earlier, *(line["path"] for line in lines)]),
            **{key: lines[-1][key] for key in ("evaluations", "jacobians", "seconds")},
        }


def keep_of_each(file: Path, doc: str | None, make: Callable[[Bench], Any]) -> None:
    """Write what is made of each problem, or of those that the command line names, to a file of JSON."""
    parser = argparse.ArgumentParser(description=doc)
    parser.add_argument("--problems", nargs="*")
    asked = parser.parse_args()
    kept = json.loads(file.read_text()) if file.exists() else {}
    known = problems()
    with computing():
        for name in asked.problems or known:
            release_programs()
            kept[name] = make(Bench(known[name]()))
            file.write_text(json.dumps(kept, indent=1) + "\n")


def _line(found: Search, spent: Effort) -> dict:
    path = zip(found.path.evaluations, found.path.jacobians, found.path.seconds, found.path.loss, strict=True)
    deviation = None
    if found.triangle is not None and found.gradient is not None and np.all(np.isfinite(found.triangle)):
        deviation = _short(covariance(found.triangle, found.unit, found.gradient).deviation)
    return {
        "outcome": found.outcome.name.lower(),
        "loss_start": _digits(found.loss_start),
        "loss": _digits(found.loss, 9),
        "evaluations": spent.evaluations + found.evaluations,
        "jacobians": spent.jacobians + found.jacobians,
        "seconds": round(spent.seconds + found.run_seconds, 4),
        "unit": _short(found.unit),
        "deviation": deviation,
        "path": [
            [
                int(spent.evaluations + evaluations),
                int(spent.jacobians + jacobians),
                round(float(spent.seconds + seconds), 4),
                _digits(loss),
            ]
            for evaluations, jacobians, seconds, loss in path
        ],
    }


def _falling(paths: Iterable[list]) -> list:
    """The entries that lower the loss, of paths one after the other."""
    kept: list = []
    for path in paths:
        for entry in path:
            if not kept or (entry[3] is not None and (kept[-1][3] is None or entry[3] < kept[-1][3])):
                kept.append(entry)
    return kept


def _digits(value: float, digits: int = 6) -> float | None:
    return float(f"{value:.{digits}g}") if np.isfinite(value) else None


def _short(values) -> list:
    return [_digits(float(value), 9) for value in values]
