"""The study of one case: how often an effect is called first, and what the whole procedure says."""

import numpy as np

from benchmarks.validation.power.drawing import Case
from jaxink.diagnosis import DiagnosisOptions, ScreenResult, SearchPolicy, Testability, diagnose

N_SETS, N_NULL, FACTORS, SEED = 50, 200, (0.5, 1.0, 2.0, 4.0), 4711
# Level of significance at which false alarms are counted.
LEVEL = 0.05
# The multiple at which data sets are drawn from the model itself; at others the screen's linear one serves.
REFITTED = 2.0
# The multiple at which the whole procedure runs on one data set.
LOOPED = 4.0
# Why an effect has no power to be told.
TOO_WEAK = "twice the detection limit lies beyond what is possible"


def is_first(screened: ScreenResult, name: str) -> bool:
    """Whether the class of an effect is called first."""
    called = {
        c.name: c.predicted_delta_chi_square
        for c in screened.candidates
        if np.nan_to_num(c.p_adjusted, nan=1.0) <= screened.options.level
    }
    return name in called and called[name] > max(called.values()) - SearchPolicy().class_delta_chi_square


def false_alarms(case: Case, count: int) -> dict[str, int]:
    """Number of data sets without an effect, and of those among them that have a candidate called."""
    residuals = case.residuals(case.model.solution.predicted_per_sr, count, np.random.default_rng(SEED))
    adjusted = case.prepared.p_values(residuals).adjusted
    return {"sets": count, "called": int(np.sum(np.nanmin(adjusted, axis=1) <= LEVEL))}


def power(case: Case, position: int, name: str) -> dict:
    """How often an effect is called first at multiples of its detection limit; or why that is not asked."""
    row = case.screened[name]
    if row.status is Testability.NOT:
        return {"reason": row.reason}
    direction, limit = case.limit(name)
    if limit >= direction.largest or case.at_strength(name, REFITTED)[0] is None:
        return {"reason": TOO_WEAK}
    # Where the free parameters follow an effect further than a linear screen knows, it says nothing.
    is_linear = limit == float(np.nanmin(row.detection_limits))
    counts, anew = {}, []
    for factor in FACTORS:
        rng = np.random.default_rng([SEED, position, int(10 * factor)])
        if is_linear and factor != REFITTED:
            change = factor * limit * direction.column
            screens = case.screens(rng.standard_normal((N_SETS, change.size)) + change)
        else:
            predicted, _ = case.at_strength(name, factor)
            if predicted is None:
                break
            if case.follows(name, predicted, factor):
                screens = case.own_screens(predicted, N_SETS, rng)
                anew.append(str(factor))
            else:
                screens = case.screens(case.residuals(predicted, N_SETS, rng))
        counts[str(factor)] = sum(is_first(screened, name) for screened in screens)
    setting = {k.split(".")[-1]: v for k, v in direction.setting.items()}
    return {
        "limit": limit * direction.column_strength,
        "unit": direction.unit,
        "setting": ", ".join(f"{k} {v:g}" for k, v in setting.items()),
        "named": counts,
        "own_screens": anew,
    }


def verdict_on(case: Case, measured) -> list[str]:
    """Code and names by the whole procedure."""
    found = diagnose(case.measured_as(measured), case.sample, DiagnosisOptions())
    return [found.verdict.code, *found.verdict.effects]


def null_loops(case: Case, count: int, store: dict, save) -> None:
    """The whole procedure on data sets without any effect."""
    rng = np.random.default_rng(SEED + 1)
    base = case.model.solution.predicted_per_sr
    sets = [case.drawn(base, rng) for _ in range(count)]
    codes = store.setdefault("loops", [])
    for measured in sets[len(codes) :]:
        codes.append(verdict_on(case, measured))
        print(len(codes), codes[-1], flush=True)
        save()


def effect_loops(case: Case, store: dict, only: list[str], save) -> None:
    """The whole procedure on one data set for each effect."""
    for position, candidate in enumerate(case.candidates):
        found = store["effects"].get(candidate.name, {"reason": ""})
        if "reason" in found or "loop" in found or (only and candidate.name not in only):
            continue
        predicted, _ = case.at_strength(candidate.name, LOOPED)
        if predicted is not None:
            rng = np.random.default_rng([SEED + 2, position])
            found["loop"] = verdict_on(case, case.drawn(predicted, rng))
            print(candidate.name, found["loop"], flush=True)
            save()
