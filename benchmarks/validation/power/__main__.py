"""False alarms and power of the diagnosis; writes its part of docs/diagnosis.md.

python -m benchmarks.validation.power [--loops N] [--effect-loops] [--case NAME] [--only EFFECT,...]

At twice the detection limit every data set is drawn from the model: its prediction with an effect at that
strength, nonlinear, plus the declared noise with its scan factors; the declared model is fitted to it anew, and the
residual screened: by the screen made at the fit to the case, or where fits go far after an effect, by one made at each
fit. At the other multiples the linear model of the screen serves, noise added to the direction of the
effect, unless refits find that its limit is not linear: then all are drawn from the model. Results are kept effect by
effect in benchmarks/validation/power/results.json, so that a run that was stopped goes on; --loops runs the whole procedure on
null data sets, --effect-loops on one with each effect. The first case tells of all effects it can; --case NAME adds
those that another sample has.
"""

import argparse
import dataclasses
import json
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.pages import machine, table, write_section
from benchmarks.validation.power.cases import ACCURACY, case_of
from jaxink.diagnosis import (
    Candidate,
    DiagnosisOptions,
    ScreenOptions,
    ScreenResult,
    diagnose,
    prepare_screen,
)
from jaxink.diagnosis.stage import TOLD_APART, Setup, Stage
from jaxink.effects import CATALOGUE, Scene
from jaxink.fitting import prepare_data
from jaxink.fitting.objective import noise_of
from jaxink.numerics.precision import computing
from jaxink.solver.accuracy import DEFAULT_ACCURACY
from jaxink.solver.stack import SolverConfig

MARK = "false alarms and power, by benchmarks.validation.power"
STORE = Path(__file__).with_name("results.json")
N_SETS, N_NULL, FACTORS, SEED = 50, 200, (0.5, 1.0, 2.0, 4.0), 4711
# The multiple at which data sets are drawn from the model itself; at the others the screen's linear one serves.
REFITTED = 2.0
# The multiple at which the whole procedure runs on one data set.
LOOPED = 4.0
# Relative difference between what a refit leaves of an effect and what the screen says, up to which one screen, made
# at the fit to the case, serves all data sets; beyond, every data set has a screen of its own, as in a diagnosis.
SERVED = 0.2
# Why an effect has no power to be told.
TOO_WEAK = "twice the detection limit lies beyond what is possible"


class Case:
    """One measurement as the pattern of directions, sample and noise."""

    def __init__(self, name: str):
        data, self.sample = case_of(name)
        self.data = prepare_data(data, self.sample)
        used = self.data.used
        scene = Scene.of(*(c[used] for c in self.data.directions), self.data.row[used])
        accuracy = ACCURACY.get(name, DEFAULT_ACCURACY)
        result = jaxink.fit(self.data, self.sample, jaxink.FitOptions(profile="none", accuracy=accuracy))
        noise = noise_of(self.data, self.sample)
        self.setup = Setup(
            self.sample,
            self.data,
            noise,
            SolverConfig(**result.solver),
            scene,
            CATALOGUE,
            ScreenOptions(),
            accuracy,
        )
        self.relative, self.floor = self.sample.noise.relative, self.sample.noise.floor_per_sr
        self.stage = Stage(self.setup, (), result.values)
        self.directions = self.stage.directions()
        self.candidates = [
            Candidate(name, np.stack([d.column for d in found], axis=1), found[0].effect.sign)
            for name, found in self.directions.items()
        ]
        self.prepared = prepare_screen(
            self.stage.jacobian, self.candidates, at_bound=self.stage.at_bound, options=ScreenOptions()
        )
        self.screened = self.prepared.screen(self.stage.residual)
        self._limits: dict[str, float] = {}

    def drawn(self, predicted, rng):
        """Measured values for a true BSDF."""
        of = self.stage.bench.objective
        common = of.scan_relative * rng.standard_normal(of.n_scans)[of.scan]
        independent = np.hypot(self.relative * predicted, self.floor) * rng.standard_normal(predicted.size)
        return predicted * (1 + common) + independent

    def measured_as(self, values) -> jaxink.GonioData:
        """The measurement with other values at its used points."""
        bsdf = self.data.bsdf_per_sr.copy()
        bsdf[self.data.used] = values
        return self.data.replace(bsdf_per_sr=bsdf)

    def follows(self, name, predicted, factor) -> bool:
        """Whether fits go so far after an effect that the screen, made where they begin, misjudges what is left."""
        direction, limit = self.limit(name)
        fitted = self.stage.bench.fit(self.stage.solution.values, self.stage.free, measured=predicted)
        linear = (factor * limit * self.length(direction.column)) ** 2
        return abs(fitted.chi_square / linear - 1) > SERVED

    def own_screens(self, predicted, count, rng):
        """Screens of data sets drawn around a true BSDF, each made where the fit to it ended."""
        for _ in range(count):
            setup = dataclasses.replace(self.setup, data=self.measured_as(self.drawn(predicted, rng)))
            stage = Stage(setup, (), self.stage.solution.values)
            yield stage.screened(stage.directions())

    def residuals(self, predicted, count, rng):
        """Whitened residuals of refits to data sets drawn around a true BSDF."""
        bench = self.stage.bench
        found = []
        for _ in range(count):
            bench.replace_measured(self.drawn(predicted, rng))
            solution = bench.fit(self.stage.solution.values, self.stage.free)
            found.append(bench.whiten(solution.predicted_per_sr, bench.measured - solution.predicted_per_sr))
        return np.array(found)

    def limit(self, name):
        """The direction in which least of an effect is seen, and its detection limit, as a report has it."""
        row = self.screened[name]
        inner = int(np.nanargmin(row.detection_limits))
        direction = self.directions[name][inner]
        if name not in self._limits:
            linear = float(row.detection_limits[inner])
            self._limits[name] = self.stage.limit_by_refits(direction, linear, row.critical_z)
        return direction, self._limits[name]

    def at_strength(self, name, factor):
        """True BSDF with an effect at a multiple of its detection limit, where that is least; and the direction.

        Where the screen's strength is a share of the area that is like a setting, which the effect itself does not
        know, its own strength is taken at which the free parameters leave as much; where already the least of its
        range leaves more, that share of the area.
        """
        direction, limit = self.limit(name)
        effect = direction.effect
        term, here = effect.strength, direction.setting.get(effect.strength.name)
        bench = self.stage.own_bench(effect) if effect.own_program else self.stage.bench
        values = self.stage.solution.values | {t.name: t.value for t in effect.terms} | direction.setting

        def at(strength):
            return bench.predict(values | {term.name: strength})

        if here is None or effect.scales:
            step = factor * limit * (1.0 if here is None else here - effect.neutral)
            return (at(effect.neutral + step) if step <= term.maximum - effect.neutral else None), direction
        base = self.stage.solution.predicted_per_sr
        wanted = factor * limit * self.length(direction.column)
        end = max(effect.neutral, term.minimum)

        def left(predicted):
            return self.length(self.stage.bench.whiten(base, predicted - base))

        if left(at(end)) > wanted:
            return base + factor * limit * (at(here) - base), direction
        low, high = np.log([end, here]) if term.scale == "log" else (end, here)
        for _ in range(12):
            middle = (low + high) / 2
            predicted = at(float(np.exp(middle)) if term.scale == "log" else middle)
            if left(predicted) < wanted:
                low = middle
            else:
                high = middle
        return predicted, direction

    def length(self, column) -> float:
        """Length of what the free parameters cannot imitate of a change."""
        return float(np.linalg.norm(self.stage.remainder(column)))

    def screens(self, residuals):
        """The case's own screen of some residuals."""
        _, adjusted = self.prepared.p_values(residuals)
        for residual, p in zip(residuals, adjusted, strict=True):
            if np.nanmin(p) <= self.setup.options.level:
                yield self.prepared.screen(residual)


def is_first(screened: ScreenResult, name: str) -> bool:
    """Whether the class of an effect is called first."""
    called = {
        c.name: c.predicted_drop
        for c in screened.candidates
        if np.nan_to_num(c.p_adjusted, nan=1.0) <= screened.options.level
    }
    return name in called and called[name] > max(called.values()) - TOLD_APART


def upper_limit(count: int, total: int) -> float:
    """One-sided 95 % upper confidence limit of a share (Clopper, Pearson 1934)."""
    from scipy.stats import beta

    return 1.0 if count == total else float(beta.ppf(0.95, count + 1, total - count))


def verdict_on(case: Case, measured) -> list[str]:
    """Code and names by the whole procedure."""
    found = diagnose(case.measured_as(measured), case.sample, DiagnosisOptions())
    return [found.verdict.code, *found.verdict.effects]


def null_loops(case: Case, count: int, store: dict, save) -> None:
    """The whole procedure on data sets without any effect."""
    rng = np.random.default_rng(SEED + 1)
    base = case.stage.solution.predicted_per_sr
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
            found["loop"] = verdict_on(
                case, case.drawn(predicted, np.random.default_rng([SEED + 2, position]))
            )
            print(candidate.name, found["loop"], flush=True)
            save()


def measured_effects(store: dict) -> dict[str, tuple[str, dict]]:
    """Effects with their case, the first case that can tell of each."""
    found: dict[str, tuple[str, dict]] = {}
    for case_name, case in store["cases"].items():
        for name, one in case["effects"].items():
            if "reason" not in one:
                found.setdefault(name, (case_name, one))
    return found


def page(store: dict) -> str:
    """The section."""
    seen = measured_effects(store)
    rows = []
    for name, (case_name, found) in seen.items():
        anew = found.get("own_screens", [])
        shares = [f"{found['named'].get(str(f), '-')}{' *' * (str(f) in anew)}" for f in FACTORS]
        two = found["named"].get("2.0")
        limit = "-" if two is None else f"{100 * upper_limit(two, N_SETS):.0f} %"
        size = f"{found['limit']:.3g} {found['unit']}"
        loop = found.get("loop")
        named = "-" if loop is None else ", ".join(loop[1:]) or loop[0]
        rows.append([name, case_name, size, found["setting"] or "-", *shares, limit, named])
    # What a case says that could tell, rather than one that has nothing of the kind.
    reasons: dict[str, str] = {}
    for case_name, case in store["cases"].items():
        for name, found in case["effects"].items():
            reason = found.get("reason", "")
            if reason and name not in seen and (name not in reasons or reason == TOO_WEAK):
                reasons[name] = f"{reason} (`{case_name}`)" if reason == TOO_WEAK else reason
    names = [effect.name for effect in CATALOGUE]
    unseen = [[name, reasons[name]] for name in names if name in reasons]
    missing = [name for name in names if name not in reasons and name not in seen]
    nulls = "\n".join(
        f"- Without an effect, `{name}`: {case['null']['called']} of {N_NULL} data sets have a candidate called at "
        "the 5 % level (4 to 16 expected)."
        for name, case in store["cases"].items()
        if "null" in case
    )
    loops = [(name, code) for name, case in store["cases"].items() for code in case.get("loops", [])]
    named = [code for _, code in loops if code[0] != "no_misfit"]
    what = "; ".join(f"{code[0]} {', '.join(code[1:])}".strip() for code in named)
    cases = ", ".join(dict.fromkeys(f"`{name}`" for name, _ in loops))
    header = [
        "effect",
        "case",
        "detection limit",
        "at",
        *(f"{f:g} x" for f in FACTORS),
        "upper limit at 2 x",
        "found",
    ]
    return f"""## False alarms and power

Directions, noise and ink of **simulated** measurements ({machine()}). `thin_ink` (four wavelengths, an
absorbing ink of 8 um, scans through the direction to the source) and `dense_ink` (three tenths are particles of a known
material) are patterns of our own, `coarse_...` asks for an accuracy of {ACCURACY["coarse_plain_hg"]:g} only. Null data sets, and those at twice the limit,
are drawn from the model itself with the declared noise, the declared model is fitted to each, and the residual
screened; the other multiples are drawn from the linear model of the screen, unless refits find a higher limit. One
screen, made at the fit to the case, serves all data sets; where a refit without noise leaves of an effect a fifth more or
less than that screen says, every data set has a screen of its own, made where its fit ended, as in a diagnosis (marked *).

{nulls}
- The whole procedure on {len(loops)} such data sets ({cases or "not run"}): {len(named)} do not end in `no_misfit`{": " + what if what else ""}.

Of {N_SETS} data sets with an effect at a multiple of its detection limit, in how many its class is called first: the
effect is significant, and its predicted fall of chi-square within 4 of the largest. The detection limit is the strength
that is called in half of the cases, all candidates being accounted for. The last column is the upper 95 % confidence
limit of the share at twice the limit. "found": what the whole procedure names on one data set at {LOOPED:g} times the limit
(first, then others of its class). The unit "share" stands for a part of the area that is like the setting; data are
drawn at the effect's own strength that changes as much of what the free parameters cannot imitate, or, where already the
least of its range changes more, with that share of the area.

{table(header, rows)}

Not seen by scans of this kind on these samples:

{table(["effect", "why"], unseen)}

{"Not run yet: " + ", ".join(missing) + "." if missing else ""}
"""


def main() -> None:
    """Go on where the last run stopped, and write the section."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--case", default="plain_hg")
    parser.add_argument("--loops", type=int, default=0)
    parser.add_argument("--effect-loops", action="store_true")
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    whole = json.loads(STORE.read_text()) if STORE.exists() else {"cases": {}}
    store = whole["cases"].setdefault(arguments.case, {"effects": {}})
    effects = store["effects"]

    def save():
        """Keep what is there."""
        STORE.write_text(json.dumps(whole, indent=1) + "\n")

    with computing():
        case = Case(arguments.case)
        if "null" not in store:
            residuals = case.residuals(
                case.stage.solution.predicted_per_sr, N_NULL, np.random.default_rng(SEED)
            )
            _, adjusted = case.prepared.p_values(residuals)
            store["null"] = {"called": int(np.sum(np.nanmin(adjusted, axis=1) <= 0.05))}
            save()
        for name, reason in case.stage.listed.not_testable.items():
            effects.setdefault(name, {"reason": reason})
        for position, candidate in enumerate(case.candidates):
            name = candidate.name
            if name in effects or (arguments.only and name not in arguments.only.split(",")):
                continue
            row = case.screened[name]
            if row.status == "not_testable":
                effects[name] = {"reason": row.reason}
                continue
            direction, limit = case.limit(name)
            if limit >= direction.largest or case.at_strength(name, REFITTED)[0] is None:
                effects[name] = {"reason": TOO_WEAK}
                continue
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
            rest = {k.split(".")[-1]: v for k, v in direction.setting.items()}
            effects[name] = {
                "limit": limit * direction.column_strength,
                "unit": direction.unit,
                "setting": ", ".join(f"{k} {v:g}" for k, v in rest.items()),
                "named": counts,
                "own_screens": anew,
            }
            print(name, effects[name], flush=True)
            save()
        if arguments.loops:
            null_loops(case, arguments.loops, store, save)
        if arguments.effect_loops:
            effect_loops(case, store, arguments.only.split(",") if arguments.only else [], save)
    save()
    write_section("diagnosis.md", MARK, page(whole))


if __name__ == "__main__":
    main()
