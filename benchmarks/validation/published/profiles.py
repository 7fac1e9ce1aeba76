"""Which parameters the published scans determine: profiles of chi-square, kept in kept/NAME-profiles.json.

python -m benchmarks.validation.published.profiles [NAME ...]

Those of sample 1 are part of its fits. The Henyey-Greenstein fit of sample 3 is left out: a Jacobian of it
takes most of a second, and its scattering and asymmetry parameter run to the ends of their ranges together.
"""

import json
import sys
import time

import numpy as np

from benchmarks.pages import table
from benchmarks.validation.published.fits import KEPT, kept, kept_sample
from benchmarks.validation.published.problems import COLOURED, ROUGH, SHEET, WEIGHTED, WHITE, problem
from jaxink.fitting.gradient import GradientSearch
from jaxink.fitting.uncertainty import covariance, profile
from jaxink.numerics.precision import computing
from jaxink.solver.accuracy import DEFAULT_ACCURACY

NAMES = (f"{ROUGH}-mie", f"{ROUGH}-hg", f"{COLOURED}-mie", f"{SHEET}-mie")
# Their intervals were found with the fit.
_WITH_THE_FIT = (f"{WHITE}-mie", f"{WHITE}-hg")
# A search along a profile this much lower in chi-square is another minimum.
_LOWER = 0.1


def _file(name: str):
    return KEPT / f"{name}-profiles.json"


def make(name: str) -> dict:
    """Interval of each parameter in which chi-square rises by less than 1, all others refitted; kept."""
    if _file(name).exists():
        return json.loads(_file(name).read_text(encoding="utf-8"))
    began = time.process_time()
    one, values = problem(name, WEIGHTED), kept_sample(name, WEIGHTED).parameters.values_with({})
    found: dict = {"parameters": {}}
    with computing():
        objective = one.objective()
        known = {key: float(values[key]) for key in objective.free}
        objective = one.objective(objective.resolution_at(known, DEFAULT_ACCURACY, "fastest"))
        engine = GradientSearch(objective)
        best = engine.run(objective.scale.to_unit(np.array(list(known.values()))))
        errors = covariance(best.triangle, best.unit, best.gradient)
        for position, key in enumerate(objective.free):
            along = profile(engine, best, position, errors.deviation[position])
            ends = []
            for unit in (along.lower, along.upper):
                at = best.unit.copy()
                at[position] = unit
                ends.append(float(objective.numbers(at)[key]))
            found["parameters"][key] = {
                "value": float(objective.numbers(best.unit)[key]),
                "interval": ends,
                "open": [bool(along.open_below), bool(along.open_above)],
                "least_rise": float(np.min(along.rise)),
            }
    found |= {"chi_square": float(best.loss), "seconds": round(time.process_time() - began, 1)}
    _file(name).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return found


def _intervals(name: str) -> dict[str, tuple[float, list[float], list[bool]]]:
    """Value, interval and whether it is open, by parameter."""
    if name not in _WITH_THE_FIT:
        return {k: (p["value"], p["interval"], p["open"]) for k, p in make(name)["parameters"].items()}
    free = {p.name: p for p in problem(name, WEIGHTED).sample.parameters.free}
    found = {}
    for key, p in kept(name, WEIGHTED)["parameters"].items():
        low, high = p["interval"] or (p["value"] - p["standard_error"], p["value"] + p["standard_error"])
        found[key] = p["value"], [low, high], [low <= free[key].minimum, high >= free[key].maximum]
    return found


def text(word_of) -> str:
    """Table of the intervals.

    Parameters
    ----------
    word_of
        Word and unit for a parameter's name.
    """
    rows = []
    for name in (*_WITH_THE_FIT, *NAMES):
        cells = []
        for key, (value, (low, high), is_open) in _intervals(name).items():
            word, unit = word_of(key)
            ends = [
                f"{end:.4g}" + (" (end)" if open_ else "")
                for end, open_ in zip((low, high), is_open, strict=True)
            ]
            cells.append(f"{word} {value:.4g} [{ends[0]}, {ends[1]}]{' ' + unit if unit else ''}")
        rows.append([f"`{name}`", "; ".join(cells)])
    return table(["reconstruction", "value [interval]"], rows)


def lower_minima() -> str:
    """Sentence on whether a profile passes below the minimum that was found."""
    lower = [n for n in NAMES if min(p["least_rise"] for p in make(n)["parameters"].values()) < -_LOWER]
    if lower:
        return f"Along a profile of {', '.join(lower)}, chi-square falls below the minimum that was found."
    return "No profile passes below the minimum that was found."


def seconds() -> float:
    """Processor time of all profiles but those made with the fits."""
    return sum(make(name)["seconds"] for name in NAMES)


if __name__ == "__main__":
    for chosen in sys.argv[1:] or NAMES:
        print(chosen, make(chosen)["seconds"], "s", flush=True)
